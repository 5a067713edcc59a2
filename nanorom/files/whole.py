"""Files appear whole or not at all: written under a temporary name, then renamed."""

from __future__ import annotations

import os
import platform
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path

from nanorom.errors import FileError


def check_writable(path: str | Path) -> None:
    """Raise FileError unless a file can be written at the path. Call before expensive work."""
    path = Path(path)
    _check_target(path)
    check_parent(path)


def check_parent(path: Path) -> None:
    """Raise FileError unless the directory of a path is there and can be written to."""
    if not path.parent.is_dir():
        raise FileError(f"{path}: there is no directory '{path.parent}'; make it first")
    _check_directory(path.parent, path)


def check_directory(path: str | Path) -> None:
    """Raise FileError unless a directory can hold files or be made. Call before expensive work."""
    path = Path(path)
    existing = path.absolute()
    while not existing.exists():
        existing = existing.parent
    if not existing.is_dir():
        raise FileError(f"{path}: '{existing}' is not a directory")
    _check_directory(existing, path)


def make_directory(path: str | Path) -> Path:
    """The directory, made with its parents if it does not exist; raises FileError."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{path}: cannot be made: {error.strerror}") from None
    return Path(path)


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A temporary path beside ``path``, renamed to it on success and removed on failure.

    Raises FileError if the file cannot be written.
    """
    path = Path(path)
    check_writable(path)
    clear_temporary(path)
    temporary = path.with_name(_temporary(path.stem, str(os.getpid()), path.suffix))
    try:
        yield temporary
        with open(temporary, "rb") as file:  # on disk before it gets its name
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else " ".join(str(error).split())
        raise FileError(f"{path}: cannot be written: {reason}") from error
    finally:
        temporary.unlink(missing_ok=True)


def clear_temporary(path: Path) -> None:
    """Remove what runs that were killed left while they wrote a file."""
    for left in path.parent.glob(_temporary(escape(path.stem), "*", escape(path.suffix))):
        if not _is_alive(left):
            left.unlink(missing_ok=True)


def _temporary(stem: str, process: str, suffix: str) -> str:
    return f".{stem}.{platform.node()}-{process}.part{suffix}"


def _is_alive(temporary: Path) -> bool:
    """Whether the process of this machine that a temporary file belongs to still runs."""
    process = re.findall(r"-(\d+)\.part", temporary.name)
    try:
        os.kill(int(process[-1]), 0)
    except ProcessLookupError:  # the answer
        return False
    except (IndexError, OSError, OverflowError):
        pass  # of another user, or no number: it is left alone
    return True


def _check_target(path: Path) -> None:
    if path.is_dir():
        raise FileError(f"{path}: is a directory; give the name of a file")
    if path.exists() and not path.is_file():
        raise FileError(f"{path}: is not a regular file and will not be replaced")
    if path.exists() and not os.access(path, os.W_OK):
        raise FileError(f"{path}: exists and is write-protected")


def _check_directory(directory: Path, path: Path) -> None:
    """Try it: permissions alone do not tell of read-only or full file systems."""
    try:
        with tempfile.TemporaryFile(dir=directory):
            pass
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror}") from None
