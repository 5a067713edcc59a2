"""A computation in a process of its own, which ends where it takes too much time or memory."""

from __future__ import annotations

import multiprocessing
import resource
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

from nanorom.errors import NanoromError

Result = TypeVar("Result")

SECONDS = 60  # of the processor
MEMORY = 3 * 2**30  # bytes that are resident
OFTEN = 0.2  # seconds between two looks at the memory


class Bound(NanoromError):
    """A computation was ended at one of its bounds."""


def bounded(
    function: Callable[..., Result], *arguments: Any, seconds: int = SECONDS, memory: int = MEMORY
) -> Result:
    """What a function of a module returns, found by a new process.

    seconds : of the processor; memory : bytes, where the system tells (Linux).  Raises Bound where
    one of them does not suffice, and NanoromError where the process dies otherwise.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(there, seconds, function, arguments))
    process.start()
    there.close()
    try:
        while not here.poll(OFTEN):
            if _resident(process.pid) > memory:
                process.kill()
                raise Bound(f"more than {memory / 2**30:g} GB of memory")
        found: Result = here.recv()
        return found
    except EOFError:
        process.join()
        if process.exitcode == -signal.SIGXCPU:
            raise Bound(f"more than {seconds} s of the processor") from None
        raise NanoromError(f"its process ended with status {process.exitcode}") from None
    finally:
        process.join()
        here.close()


def _work(there: Connection, seconds: int, function: Callable[..., Any], arguments: Any) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 10))
    there.send(function(*arguments))


def _resident(pid: int | None) -> int:
    """Bytes of memory that a process holds; 0 if unknown."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError, ValueError):  # it has just ended, or the system is another
        return 0
    return pages * resource.getpagesize()
