"""Ctrl-C leaves what is done: levels in the file, or at a prompt in the response."""

import logging
import signal

import numpy as np
import pytest

import nanorom
from nanorom import launch
from nanorom.errors import AccuracyWarning
from nanorom.results import respond as module
from nanorom.results.respond import respond
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep

LEVELS = ["1 nPa", "2 nPa", "3 nPa"]


@pytest.fixture
def duffing():
    return nanorom.ReducedModel(
        frequency=[1 / (2 * np.pi)],
        mass=[1.0],
        label=["f01"],
        number=[1],
        stiffness=[[1.0]],
        damping=[[0.1]],
        quadratic=[[[0.0]]],
        cubic=[[[[1.0]]]],
        drive={"pressure": [1.0]},
        parametric={"tension": [[-1.0]]},
    )


@pytest.fixture
def interrupted(monkeypatch):
    """Ctrl-C after the first level that is done, also where the shell had it ignored."""

    def explore_each(system, omega, levels, *others, **options):
        diagrams = original(system, omega, levels, *others, **options)
        yield next(diagrams)
        signal.raise_signal(signal.SIGINT)

    original = module.explore_each
    monkeypatch.setattr(module, "explore_each", explore_each)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def ask(duffing, **options):
    return respond(duffing, Drive(LEVELS), Sweep("0.9 f1", "1.1 f1"), processes=1, **options)


def test_at_a_prompt_the_levels_that_are_done_are_returned(duffing, interrupted, monkeypatch):
    monkeypatch.setattr(module, "interactive", lambda: True)
    with pytest.warns(AccuracyWarning, match="interrupted: 2 of 3 drive levels are missing"):
        response = ask(duffing)
    assert response.drive.direct == (1e-9,) and response.unfinished == 2
    assert [diagram.direct for diagram in response.diagrams] == [1e-9]
    assert "2 to do" in repr(response)


def test_a_script_ends_and_its_file_keeps_the_levels(tmp_path, duffing, interrupted, monkeypatch):
    path = tmp_path / "response.h5"
    with pytest.raises(KeyboardInterrupt):
        ask(duffing)
    monkeypatch.setattr(module, "interactive", lambda: True)
    with pytest.raises(KeyboardInterrupt):
        ask(duffing, path=path)
    assert nanorom.Response.load(path).unfinished == 2


def test_progress_is_logged_and_told_once(duffing, caplog):
    told = []
    with caplog.at_level(logging.INFO, "nanorom"):
        ask(duffing, progress=lambda *state: told.append(state))
    levels = [each for each in told if each[0] == "drive levels"]
    assert levels == [("drive levels", done, 3) for done in range(4)]
    whole = [message for message in caplog.messages if message.startswith("drive levels")]
    assert whole == [f"drive levels: {done} of 3" for done in range(4)]


def test_a_notebook_shows_a_bar_where_nobody_asked_for_progress(duffing, monkeypatch):
    drawn = []

    class Bar:
        total = n = 0

        def __init__(self, **options):
            drawn.append(self)

        def set_description_str(self, text):
            self.text = text

        def close(self):
            self.closed = True

    tqdm = pytest.importorskip("tqdm.auto")
    monkeypatch.setattr(tqdm, "tqdm", Bar)
    monkeypatch.setattr(launch, "in_notebook", lambda: True)
    ask(duffing)
    (bar,) = drawn
    assert (bar.text, bar.n, bar.total, bar.closed) == ("drive levels", 3, 3, True)
    ask(duffing, progress=lambda *state: None)
    assert len(drawn) == 1
