"""Several drive levels, on as many cores as there are; the result is that of one after the
other.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from nanorom.errors import ContinuationError

from .diagram import Diagram
from .explore import explore
from .system import ModalSystem

Level = tuple[float, float]  # direct, parametric


def explore_levels(
    system: ModalSystem,
    omega: tuple[float, float],
    levels: Sequence[Level],
    processes: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> list[Diagram]:
    """`explore` at every drive level (direct, parametric), in the order of the levels.

    Parameters
    ----------
    system, omega, options : as for `explore`
    levels : (direct, parametric) pairs
    processes : number of processes; the cores at hand if left out, 1 for none but this one
    progress : called with (levels done, of how many) whenever a level is finished

    Raises
    ------
    ContinuationError
        of the first level that fails, naming the level.
    """
    found: dict[int, Diagram] = {}
    for number, diagram in explore_each(system, omega, levels, processes, **options):
        found[number] = diagram
        if progress is not None:
            progress(len(found), len(levels))
    return [found[number] for number in range(len(levels))]


def explore_each(
    system: ModalSystem,
    omega: tuple[float, float],
    levels: Sequence[Level],
    processes: int | None = None,
    **options: Any,
) -> Iterator[tuple[int, Diagram]]:
    """`explore` at every drive level: (number of the level, diagram) as they are finished.

    Parameters and errors are those of `explore_levels`.
    """
    if processes is None:
        processes = len(os.sched_getaffinity(0))
    if processes < 1:
        raise ContinuationError(f"processes: {processes} is not a positive number")
    try:
        levels = [(float(d), float(p)) for d, p in levels]
    except (TypeError, ValueError):
        raise ContinuationError("levels: give pairs of numbers (direct, parametric)") from None
    processes = min(processes, len(levels))
    if processes <= 1:
        for number, level in enumerate(levels):
            yield number, _one(system, omega, level, options)
        return
    # a forked process needs no import and no guard in the caller's script
    method = "fork" if "fork" in multiprocessing.get_all_start_methods() else "spawn"
    context = multiprocessing.get_context(method)
    others = multiprocessing.active_children()
    given = system, omega, options
    with ProcessPoolExecutor(processes, context, _start, given) as pool:
        # strong drive costs most: start there
        order = sorted(range(len(levels)), key=lambda i: -sum(abs(x) for x in levels[i]))
        waiting = {pool.submit(_shared, levels[i]): i for i in order}
        try:
            for future in as_completed(waiting):
                yield waiting[future], future.result()
        except BrokenProcessPool:
            raise ContinuationError(
                "a process was killed, perhaps for want of memory; use fewer processes"
            ) from None
        except BaseException:  # an interrupt, say: do not wait for levels under way
            for child in multiprocessing.active_children():
                if child not in others:
                    child.terminate()
            raise


# What all levels share is given to each process when it starts: tasks stay so small that the pipe
# to the processes never fills, for a full one holds up the end of a pool whose processes died.
_given: tuple[ModalSystem, tuple[float, float], dict[str, Any]]


def _start(
    system: ModalSystem, omega: tuple[float, float], options: dict[str, Any]
) -> None:
    """Leave interrupts to the parent, and do not outlive it."""
    global _given
    _given = system, omega, options
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _shared(level: Level) -> Diagram:
    system, omega, options = _given
    return _one(system, omega, level, options)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _one(
    system: ModalSystem, omega: tuple[float, float], level: Level, options: dict[str, Any]
) -> Diagram:
    try:
        return explore(system, omega, *level, **options)
    except ContinuationError as error:
        raise ContinuationError(
            f"level (direct {level[0]:g}, parametric {level[1]:g}): {error}"
        ) from None
