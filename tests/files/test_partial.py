"""What an interrupted computation left is found again bit for bit, or is as good as none."""

import platform
import subprocess
import sys

import numpy as np
import pytest

from nanorom.errors import FileError
from nanorom.files import partial as journal
from nanorom.files.partial import Journal, finished, partial

SHAPE = (2, 3)


@pytest.fixture
def output(tmp_path, monkeypatch):
    """A file for whose sake everything is kept at once."""
    monkeypatch.setattr(journal, "SECONDS", 0.0)
    return tmp_path / "rom.h5"


def begun(output, key="k"):
    kept = Journal(output, key)
    kept.table("mesh", SHAPE)[:, 1] = 7.0
    kept.keep()
    return partial(output)


def test_finished_columns_are_found_again_bit_for_bit(output):
    begun(output)
    table = Journal(output, "k").table("mesh", SHAPE)
    assert np.isnan(table).all(axis=0).tolist() == [True, False, True]
    assert (table[:, 1] == 7.0).all()


@pytest.mark.parametrize(
    ("key", "name", "shape"), [("l", "mesh", SHAPE), ("k", "finer", SHAPE), ("k", "mesh", (2, 4))]
)
def test_another_computation_begins_anew(output, key, name, shape):
    begun(output)
    assert np.isnan(Journal(output, key).table(name, shape)).all()


def test_tables_of_several_meshes_are_kept_together(output):
    begun(output)
    kept = Journal(output, "k")
    kept.table("finer", (2, 4))[:] = 1.0
    kept.keep()
    assert (Journal(output, "k").table("mesh", SHAPE)[:, 1] == 7.0).all()


@pytest.mark.parametrize("damage", [b"", b"text", None])
def test_a_damaged_file_is_as_good_as_none(output, damage):
    path = begun(output)
    path.write_bytes(path.read_bytes()[:500] if damage is None else damage)
    assert np.isnan(Journal(output, "k").table("mesh", SHAPE)).all()


def test_short_work_leaves_no_file_and_finished_work_takes_it_away(output, monkeypatch):
    assert begun(output).exists()
    finished(output)
    assert list(output.parent.iterdir()) == []
    monkeypatch.setattr(journal, "SECONDS", 60.0)
    assert not begun(output).exists()


def test_what_a_killed_run_was_writing_is_taken_away_with_the_journal(output):
    path = begun(output)
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    half = path.with_name(f".{path.stem}.{platform.node()}-{ended.pid}.part{path.suffix}")
    half.write_bytes(b"half")
    finished(output)
    assert list(output.parent.iterdir()) == []


def test_only_journals_are_taken_away(output):
    partial(output).write_text("somebody's notes")
    finished(output)
    assert partial(output).read_text() == "somebody's notes"


def test_without_an_output_nothing_is_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(journal, "SECONDS", 0.0)
    kept = Journal()
    kept.table("mesh", SHAPE)[:] = 1.0
    kept.keep()
    assert list(tmp_path.iterdir()) == []


def test_every_rank_is_told_that_the_first_cannot_write(output, monkeypatch):
    class Second:
        """Communicator as the second of two ranks sees it."""

        rank = 1

        def bcast(self, value):
            assert value is None
            return {} if kept is None else "rom.h5.partial: cannot be written: disk full"

    kept = None
    kept = Journal(output, "k", Second())
    with pytest.raises(FileError, match="disk full"):
        kept.keep()


def test_keeping_takes_a_small_share_of_the_time(output, monkeypatch):
    # made at 0; written from 10 to 11, so not before 11 + 1 / 0.05 = 31 again
    clock = iter([0.0, 10.0, 11.0, 30.0, 32.0, 32.0])
    monkeypatch.setattr(journal.time, "monotonic", lambda: next(clock))
    kept = Journal(output, "k")
    for written in (True, False, True):
        partial(output).unlink(missing_ok=True)
        kept.keep()
        assert partial(output).exists() == written
