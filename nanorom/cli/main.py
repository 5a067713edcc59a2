"""The command line: run one command, and turn every error into one line."""

from __future__ import annotations

import argparse
import logging
import os
import sys
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TextIO

from nanorom.cli.parser import build_parser
from nanorom.errors import NanoromError

PATIENCE = 10.0  # seconds that a failed rank waits for the others to fail, too


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    # Threaded BLAS makes the many small dense operations here several times slower.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    given = sys.argv[1:] if arguments is None else arguments
    options = build_parser(given).parse_args(given)
    try:
        with warnings.catch_warnings(), _quiet(not options.debug):
            warnings.showwarning = _show_warning
            options.command(options)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader of a pipe has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        return _fail(options, "interrupted", 130)
    except NanoromError as error:
        return _fail(options, str(error))
    except MemoryError:
        return _fail(options, "not enough memory; ask for fewer modes or a coarser mesh")
    except Exception as error:
        message = f"unexpected {type(error).__name__}: {error} (--debug shows where)"
        return _fail(options, message)
    return 0


@contextmanager
def _quiet(wanted: bool) -> Iterator[None]:
    """Without what libraries log of their work, such as a C compiler's command lines."""
    before = logging.root.manager.disable
    if wanted:
        logging.disable(max(before, logging.INFO))
    try:
        yield
    finally:
        logging.disable(before)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    from nanorom.launch import mpi_rank

    if mpi_rank() == 0 and not issubclass(category, DeprecationWarning):  # those are for developers
        print(f"nanorom: warning: {' '.join(str(message).split())}", file=sys.stderr)


def _fail(options: argparse.Namespace, message: str, status: int = 1) -> int:
    from nanorom.launch import mpi_rank

    together = _others_failed_too()
    if options.debug:
        traceback.print_exc()
    if mpi_rank() == 0 or not together:
        line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
        print(f"nanorom: error: {line}", file=sys.stderr, flush=True)
    if not together:
        sys.modules["mpi4py.MPI"].COMM_WORLD.Abort(status)
    return status


def _others_failed_too() -> bool:
    """Whether every rank got here; if not, the others would wait for this one for ever."""
    mpi: Any = sys.modules.get("mpi4py.MPI")  # loaded by the finite-element half, if at all
    if mpi is None or mpi.COMM_WORLD.size == 1:
        return True
    met = mpi.COMM_WORLD.Ibarrier()
    deadline = time.monotonic() + PATIENCE
    while not met.Test():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True
