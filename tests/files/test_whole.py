"""A file is there whole or not at all, whatever becomes of the process that writes it."""

import os
import platform
import re
import signal
import subprocess
import sys
import time

import pytest

from nanorom.errors import FileError
from nanorom.files.whole import (
    atomic_path,
    check_directory,
    check_writable,
    make_directory,
)


def contents(directory):
    return sorted(path.name for path in directory.iterdir())


def test_file_appears_under_its_name_only_when_it_is_whole(tmp_path):
    target = tmp_path / "rom.h5"
    with atomic_path(target) as temporary:
        temporary.write_text("whole")
        assert not target.exists()
    assert target.read_text() == "whole"
    assert contents(tmp_path) == ["rom.h5"]


def test_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "rom.h5"
    target.write_text("old")
    with pytest.raises(RuntimeError, match="half way"), atomic_path(target) as temporary:
        temporary.write_text("half")
        raise RuntimeError("half way")
    assert target.read_text() == "old"
    assert contents(tmp_path) == ["rom.h5"]


def test_killed_process_leaves_the_old_file_and_the_next_one_tidies_up(tmp_path):
    target = tmp_path / "rom.h5"
    target.write_text("old")
    script = (
        "import sys, time\n"
        "from nanorom.files.whole import atomic_path\n"
        "with atomic_path(sys.argv[1]) as temporary:\n"
        "    temporary.write_text('half')\n"
        "    print('ready', flush=True)\n"
        "    time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(target)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    assert target.read_text() == "old"
    assert len(contents(tmp_path)) == 2
    other = tmp_path / f".rom.{platform.node()}-{os.getppid()}.part.h5"  # of a run under way
    other.touch()
    with atomic_path(target) as temporary:
        temporary.write_text("new")
    assert contents(tmp_path) == [other.name, "rom.h5"]


def test_full_disk_is_one_line_that_names_the_file(tmp_path):
    target = tmp_path / "rom.h5"
    with pytest.raises(FileError, match=re.escape(f"{target}: cannot be written: No space left")):
        with atomic_path(target):
            raise OSError(28, "No space left on device")
    assert contents(tmp_path) == []


@pytest.mark.parametrize("check", [check_writable, lambda p: atomic_path(p).__enter__()])
def test_targets_that_cannot_be_written_are_refused_beforehand(tmp_path, check):
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    for target, reason in [
        (tmp_path, "is a directory"),
        (tmp_path / "none" / "rom.h5", "there is no directory"),
        (fifo, "is not a regular file"),
    ]:
        with pytest.raises(FileError, match=re.escape(f"{target}: {reason}")):
            check(target)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_write_protected_directory_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(FileError, match="Permission denied"):
        check_writable(tmp_path / "rom.h5")


def test_checking_leaves_no_trace(tmp_path):
    check_writable(tmp_path / "rom.h5")
    check_directory(tmp_path / "a" / "b")
    assert contents(tmp_path) == []
    assert make_directory(tmp_path / "a" / "b").is_dir()
    with pytest.raises(FileError, match="is not a directory"):
        (tmp_path / "file").write_text("")
        check_directory(tmp_path / "file" / "b")


def test_temporary_file_keeps_the_suffix_that_decides_the_format(tmp_path):
    with atomic_path(tmp_path / "modes.png") as temporary:
        temporary.write_text("")
        assert temporary.suffix == ".png"
    assert time.time() - (tmp_path / "modes.png").stat().st_mtime < 60
