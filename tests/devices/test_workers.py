"""A process that dies or takes too long costs its own job alone."""

import pytest

from nanorom.devices.workers import each

MORTAL = """
import json, os, sys, time
for line in sys.stdin:
    job = json.loads(line)
    if job["x"] == "dies":
        os.kill(os.getpid(), 9)
    if job["x"] == "leaves":
        sys.exit(3)
    if job["x"] == "sleeps":
        time.sleep(600)
    print(json.dumps({"values": [job["x"], "." * 200000]}), flush=True)
"""
SECONDS = 5.0  # more than a process needs to begin


@pytest.fixture
def module(tmp_path, monkeypatch):
    (tmp_path / "mortal.py").write_text(MORTAL)
    monkeypatch.syspath_prepend(tmp_path)
    return "mortal"


@pytest.mark.parametrize("processes", [1, 2, 9])
def test_every_job_is_answered_once(module, processes):
    jobs = [(number, {"x": number}) for number in range(7)]
    found = list(each(jobs, processes, SECONDS, module))
    assert sorted(number for number, _ in found) == list(range(7))
    assert all(answer["values"][0] == number for number, answer in found)


def test_deaths_and_long_jobs_are_told_and_the_rest_goes_on(module):
    words = [0, "dies", 1, "sleeps", 2, "leaves", 3]
    found = dict(each([(n, {"x": x}) for n, x in enumerate(words)], 2, SECONDS, module))
    assert [found[n]["values"][0] for n in (0, 2, 4, 6)] == [0, 1, 2, 3]
    assert "SIGKILL" in found[1]["failure"] and "memory" in found[1]["failure"]
    assert "more than 5 s" in found[3]["failure"]
    assert "status 3" in found[5]["failure"]


def test_no_jobs_need_no_process():
    assert list(each([], 2, SECONDS, "there_is_none")) == []
