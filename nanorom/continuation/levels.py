"""Several drive levels, on as many cores as there are; the result is that of one after the
other.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any

from nanorom.errors import ContinuationError

from .diagram import Diagram
from .explore import explore
from .system import ModalSystem


def explore_levels(
    system: ModalSystem,
    omega: tuple[float, float],
    levels: Sequence[tuple[float, float]],
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
    pairs = [(float(direct), float(parametric)) for direct, parametric in levels]
    if processes is None:
        processes = len(os.sched_getaffinity(0))
    if processes < 1:
        raise ContinuationError(f"processes: {processes} is not a positive number")
    tasks = [(system, omega, pair, options) for pair in pairs]
    if min(processes, len(tasks)) <= 1:
        return [_report(_one(task), i, len(tasks), progress) for i, task in enumerate(tasks)]
    results: list[Diagram | None] = [None] * len(tasks)
    # a forked process needs no import and no guard in the caller's script
    method = "fork" if "fork" in multiprocessing.get_all_start_methods() else "spawn"
    context = multiprocessing.get_context(method)
    with ProcessPoolExecutor(min(processes, len(tasks)), mp_context=context) as pool:
        # strong drive costs most: start there
        order = sorted(range(len(tasks)), key=lambda i: -sum(abs(x) for x in pairs[i]))
        waiting = {pool.submit(_one, tasks[i]): i for i in order}
        for done, future in enumerate(as_completed(waiting)):
            results[waiting[future]] = _report(future.result(), done, len(tasks), progress)
    return [result for result in results if result is not None]


def _one(task: tuple[ModalSystem, tuple[float, float], tuple[float, float], dict]) -> Diagram:
    system, omega, (direct, parametric), options = task
    try:
        return explore(system, omega, direct, parametric, **options)
    except ContinuationError as error:
        raise ContinuationError(
            f"level (direct {direct:g}, parametric {parametric:g}): {error}"
        ) from None


def _report(
    diagram: Diagram, done: int, count: int, progress: Callable[[int, int], None] | None
) -> Diagram:
    if progress is not None:
        progress(done + 1, count)
    return diagram
