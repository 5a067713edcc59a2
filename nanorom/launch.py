"""What surrounds a process: its rank, whether finite elements are at hand, and who watches it."""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec

from nanorom.errors import NanoromError
from nanorom.types import Progress

LOG = logging.getLogger("nanorom")
PAUSE = 1.0  # s between two words of what is under way
P = ParamSpec("P")


@contextmanager
def finite_elements() -> Iterator[None]:
    """Turn a missing finite-element library into one line with the remedy."""
    try:
        yield
    except ImportError as error:
        cause: BaseException | None = error
        while cause is not None:  # C++ modules make an import error of Ctrl-C
            if isinstance(cause, KeyboardInterrupt):
                raise KeyboardInterrupt from error
            cause = cause.__cause__ or cause.__context__
        raise NanoromError(
            f"this needs DOLFINx, petsc4py, slepc4py and gmsh ({error}); "
            "use ./run, pip install 'nanorom[fem]' (Linux) or the container image"
        ) from error


def mpi_rank() -> int:
    """Rank of this process as its launcher gives it, without loading MPI; 0 when run alone."""
    for name in ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"):
        if name in os.environ:
            return int(os.environ[name])
    return 0


class Watched:
    """A progress(stage, done, total) that is logged, too: as "nanorom", at the level INFO."""

    def __init__(self, show: Progress | None) -> None:
        self._show = show

    def __call__(self, stage: str, done: int, total: int) -> None:
        LOG.info("%s: %d of %d", stage, done, total)
        if self._show is not None:
            self._show(stage, done, total)


def seldom(call: Callable[P, None]) -> Callable[P, None]:
    """The call, left out where the last one was less than `PAUSE` before."""
    last = time.monotonic()

    def maybe(*given: P.args, **named: P.kwargs) -> None:
        nonlocal last
        if time.monotonic() - last >= PAUSE:
            last = time.monotonic()
            call(*given, **named)

    return maybe


@contextmanager
def watched(progress: Progress | None) -> Iterator[Progress]:
    """The progress of a long call: to the caller, if it asked, else as a bar in a notebook."""
    if progress is not None or mpi_rank() != 0 or not in_notebook():
        yield progress if isinstance(progress, Watched) else Watched(progress)
        return
    from tqdm.auto import tqdm

    with bar(tqdm) as show:
        yield Watched(show)


@contextmanager
def bar(kind: Any, **options: Any) -> Iterator[Progress]:
    """A bar of a class of tqdm that shows stage after stage, and goes at the end."""
    drawn = kind(leave=False, **options)

    def show(stage: str, done: int, total: int) -> None:
        drawn.total, drawn.n = total, done
        drawn.set_description_str(stage)

    try:
        yield show
    finally:
        drawn.close()


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")


def interactive() -> bool:
    """Whether somebody sits at a prompt, in a notebook or a terminal."""
    return in_notebook() or hasattr(sys, "ps1")
