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
    tasks = [(system, omega, (float(d), float(p)), options) for d, p in levels]
    processes = min(processes, len(tasks))
    if processes <= 1:
        for number, task in enumerate(tasks):
            yield number, _one(task)
        return
    # a forked process needs no import and no guard in the caller's script
    method = "fork" if "fork" in multiprocessing.get_all_start_methods() else "spawn"
    context = multiprocessing.get_context(method)
    others = multiprocessing.active_children()
    with ProcessPoolExecutor(processes, mp_context=context, initializer=_start) as pool:
        # strong drive costs most: start there
        order = sorted(range(len(tasks)), key=lambda i: -sum(abs(x) for x in tasks[i][2]))
        waiting = {pool.submit(_one, tasks[i]): i for i in order}
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


def _start() -> None:
    """Leave interrupts to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _one(task: tuple[ModalSystem, tuple[float, float], Level, dict[str, Any]]) -> Diagram:
    system, omega, (direct, parametric), options = task
    try:
        return explore(system, omega, direct, parametric, **options)
    except ContinuationError as error:
        raise ContinuationError(
            f"level (direct {direct:g}, parametric {parametric:g}): {error}"
        ) from None
