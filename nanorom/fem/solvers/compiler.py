"""The C compiler that DOLFINx's forms go through: its options, its silence, its absence, its cache.

A process that ends while it compiles leaves a source in the cache, for which every later one would
wait in vain.  So a process that compiles holds the cache, and where nobody does, a source that is
not compiled is nobody's.
"""

from __future__ import annotations

import fcntl
import logging
import os
import sysconfig
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TypeVar
from unittest.mock import patch

import attrs
import cffi

from nanorom.compiler import instructions, zig
from nanorom.errors import NanoromError

HEADERS = Path(__file__).parent / "python_abi"
Form = TypeVar("Form")
LOCK = "nanorom.lock"
LONGEST = 300.0  # s to wait for others that compile: more than a form takes on a busy machine
PAUSE = 0.1  # s


def options() -> list[str]:
    """How forms are compiled."""
    return ["-O2", "-ftree-vectorize", *instructions(), *_headers()]


def _headers() -> list[str]:
    """What a form needs of Python's headers, where this Python came without them."""
    own = Path(sysconfig.get_path("include")) / "pyconfig.h"
    return [] if own.exists() else ["-idirafter", str(HEADERS)]


def _compiler() -> dict[str, str]:
    """Variables for Zig's compiler (``pip install ziglang``), where there is no other one."""
    found = zig()
    if found is None:
        return {}
    return {
        "CC": found,
        "LDSHARED": f"{found} -shared",
    }  # it has no -Bsymbolic-functions of Debian's


def run(make: Callable[[], Form], folder: Path, compiles: bool) -> Form:
    """Make a form, compiled into a cache by this process or read there; all ranks succeed or fail.

    Raises NanoromError with the remedy where there is no C compiler.  Collective.
    """
    with at_work(), held(folder, compiles) as cache:
        try:
            return make()
        except (TimeoutError, RuntimeError):  # on every rank; told by the next trial if it stays so
            cache.clear(LONGEST)
            return make()


@contextmanager
def at_work() -> Iterator[None]:
    """Silence what the form compiler tells of itself: C command lines, numbers of points.

    Raises NanoromError with the remedy where there is no C compiler.
    """
    level = logging.root.manager.disable
    logging.disable(logging.INFO)
    try:
        with warnings.catch_warnings(), patch.dict(os.environ, _compiler()):
            warnings.filterwarnings("ignore", module="ffcx")
            yield
    except cffi.VerificationError as error:
        raise NanoromError(
            f"the forms of DOLFINx cannot be compiled ({' '.join(str(error).split())}); they need "
            "a C compiler: install gcc, or without root pip install ziglang, which is found by "
            "itself; any other is named by the variable CC"
        ) from error
    finally:
        logging.disable(level)


@attrs.define
class Cache:
    """The folder of compiled forms, held while this process compiles into it."""

    _lock: IO[str] | None
    _folder: Path

    def clear(self, patience: float = 0.0) -> None:
        """Remove what ended processes left half compiled, once no other one compiles."""
        if self._lock is None:
            return
        fcntl.flock(self._lock, fcntl.LOCK_UN)
        end = time.monotonic() + patience
        while not _locked(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB):
            if time.monotonic() > end:
                return
            time.sleep(PAUSE)
        for source in self._folder.glob("libffcx_*.c"):
            if not source.with_suffix(".c.cached").exists():
                source.unlink(missing_ok=True)
        fcntl.flock(self._lock, fcntl.LOCK_SH)


@contextmanager
def held(folder: Path, compiles: bool) -> Iterator[Cache]:
    """Hold the cache of compiled forms if this process compiles, not if it reads what another made.

    An interrupted compilation leaves nothing behind.
    """
    lock = _lock_of(folder) if compiles else None
    cache = Cache(lock, folder)
    try:
        yield cache
    except BaseException as error:
        if not isinstance(error, Exception):  # Ctrl-C: the form compiler clears after errors alone
            cache.clear()
        raise
    finally:
        if lock is not None:
            lock.close()


def _lock_of(folder: Path) -> IO[str] | None:
    """The cache's lock, shared with others that compile; None where there can be none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / LOCK).open("a", encoding="ascii")
    except OSError:  # the cache cannot be written: nothing is compiled into it
        return None
    if _locked(lock, fcntl.LOCK_SH):
        return lock
    lock.close()
    return None


def _locked(lock: IO[str], how: int) -> bool:
    try:
        fcntl.flock(lock, how)
    except OSError:  # held by another, or a file system without locks
        return False
    return True
