"""Several drive levels, on as many cores as there are; the result is that of one after the
other.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

from nanorom.continuation.diagrams.course import EVERY, Board, Watch
from nanorom.continuation.diagrams.diagram import Diagram, Unexplored
from nanorom.continuation.diagrams.explore import explore
from nanorom.continuation.diagrams.isolas import seeds_for
from nanorom.continuation.diagrams.merging import missing_folds
from nanorom.continuation.system import ModalSystem
from nanorom.errors import ContinuationError

Level = tuple[float, float]  # direct, parametric
Jobs = dict[int, tuple[Level, dict[str, Any]]]  # level and its own options by number


def explore_levels(
    system: ModalSystem,
    omega: tuple[float, float],
    levels: Sequence[Level],
    processes: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> list[Diagram]:
    """`explore` at every drive level (direct, parametric), in the order of the levels, with the
    isolas that neighbouring levels lead to.

    Parameters
    ----------
    system, omega, options : as for `explore`
    levels : (direct, parametric) pairs, in units of the patterns
    processes : number of processes; the cores at hand if left out, 1 for none but this one
    progress : called with (levels done, of how many) whenever a level is finished

    Raises
    ------
    ContinuationError
        of the first level that fails, naming the level, when all others are finished.
    """
    found: dict[int, Diagram] = {}
    for number, diagram in explore_each(system, omega, levels, processes, **options):
        found[number] = diagram
        if progress is not None:
            progress(len(found), len(levels))
    diagrams = [found[number] for number in range(len(levels))]
    return add_isolas(system, omega, diagrams, processes, **options)


def explore_each(
    system: ModalSystem,
    omega: tuple[float, float],
    levels: Sequence[Level],
    processes: int | None = None,
    watch: Watch | None = None,
    **options: Any,
) -> Iterator[tuple[int, Diagram]]:
    """`explore` at every drive level: (number of the level, diagram) as they are finished.

    watch : told now and then what a level, by its number from 0, has come to. The other parameters,
    their units and ContinuationError are those of `explore_levels`.
    """
    levels = _checked(levels)
    # weak drive costs least: what is soon done is soon there
    order = sorted(range(len(levels)), key=lambda i: sum(abs(x) for x in levels[i]))
    jobs: Jobs = {i: (levels[i], {}) for i in order}
    yield from _each(system, omega, jobs, processes, options, watch)


def add_isolas(
    system: ModalSystem,
    omega: tuple[float, float],
    diagrams: Sequence[Diagram],
    processes: int | None = None,
    **options: Any,
) -> list[Diagram]:
    """The diagrams with the isolas to which curves of their folds, and orbits of neighbouring
    levels, lead.

    omega : the range (low, high) in rad per unit of time of the system
    diagrams : those of `explore_levels`, in the order of the levels; the other parameters are those
        they were made with. A level that gained a branch serves its neighbours in turn.
    Raises ContinuationError as `explore_levels`.
    """
    found = list(diagrams)
    folds, why = missing_folds(system, omega, found)
    if why:
        for diagram in found:
            _tell(diagram, omega[0], why)
    jobs: Jobs = {i: _job(found[i], folds=orbits) for i, orbits in folds.items()}
    changed = _gained(found, _each(system, omega, jobs, processes, options))
    changed = set(range(len(found)))
    while changed:
        jobs = {}
        for i, diagram in enumerate(found):
            others = [found[j] for j in (i - 1, i + 1) if j in changed and 0 <= j < len(found)]
            seeds = seeds_for(diagram, others)
            if seeds:
                jobs[i] = _job(diagram, seeds=seeds)
        changed = _gained(found, _each(system, omega, jobs, processes, options))
    return found


def _job(diagram: Diagram, **options: Any) -> tuple[Level, dict[str, Any]]:
    """More of a level that was explored before."""
    return (diagram.direct, diagram.parametric), {"known": diagram, **options}


def _tell(diagram: Diagram, omega: float, why: str) -> None:
    """Note that isolas were not looked for along all curves of folds."""
    if not any(left.kind == "isola" for left in diagram.unexplored):
        diagram.unexplored.append(Unexplored("isola", omega, why))


def _gained(found: list[Diagram], extended: Iterator[tuple[int, Diagram]]) -> set[int]:
    """Numbers of the levels that gained a branch; their diagrams are exchanged."""
    more = {i: diagram for i, diagram in extended if len(diagram.branches) > len(found[i].branches)}
    for i, diagram in more.items():
        found[i] = diagram
    return set(more)


def _checked(levels: Sequence[Level]) -> list[Level]:
    try:
        return [(float(d), float(p)) for d, p in levels]
    except (TypeError, ValueError):
        raise ContinuationError("levels: give pairs of numbers (direct, parametric)") from None


def cores() -> int:
    """Number of cores that this process may use; of all, where the system does not tell."""
    if hasattr(os, "sched_getaffinity"):  # Linux alone
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _each(
    system: ModalSystem,
    omega: tuple[float, float],
    jobs: Jobs,
    processes: int | None,
    options: dict[str, Any],
    watch: Watch | None = None,
) -> Iterator[tuple[int, Diagram]]:
    """The diagrams of jobs as they are finished, begun in the order of the jobs."""
    if processes is None:
        processes = cores()
    if processes < 1:
        raise ContinuationError(f"processes: {processes} is not a positive number")
    processes = min(processes, len(jobs))
    if processes <= 1:
        yield from _finished(
            (number, partial(_one, system, omega, level, options | own | _told(number, watch)))
            for number, (level, own) in jobs.items()
        )
        return
    # a forked process needs no import and no guard in the caller's script
    method = "fork" if "fork" in multiprocessing.get_all_start_methods() else "spawn"
    context = multiprocessing.get_context(method)
    others = multiprocessing.active_children()
    board = Board(jobs)
    given = system, omega, jobs, options, board if watch else None
    with ProcessPoolExecutor(processes, context, _start, given) as pool:
        waiting = {pool.submit(_shared, number): number for number in jobs}
        try:
            results = _completed(waiting, board, watch)
            yield from _finished((waiting[future], future.result) for future in results)
        except BrokenProcessPool:
            raise ContinuationError(
                "a process was killed, perhaps for want of memory; use fewer processes"
            ) from None
        except BaseException:  # an interrupt, say: do not wait for levels under way
            for child in multiprocessing.active_children():
                if child not in others:
                    child.terminate()
            raise


def _completed(
    waiting: Mapping[Future[Diagram], int], board: Board, watch: Watch | None
) -> Iterator[Future[Diagram]]:
    """Futures as they end; meanwhile what the levels have come to is told."""
    left = set(waiting)
    while left:
        done, left = wait(left, None if watch is None else EVERY, FIRST_COMPLETED)
        if watch is not None:
            board.show(watch)
        yield from done


def _told(number: int, watch: Watch | None) -> dict[str, Any]:
    """The option by which a level tells what it has come to."""
    return {} if watch is None else {"watch": partial(watch, number)}


def _finished(
    results: Iterable[tuple[int, Callable[[], Diagram]]],
) -> Iterator[tuple[int, Diagram]]:
    """Diagrams as they come; the first level that fails is told when all others are done."""
    failed: ContinuationError | None = None
    for number, result in results:
        try:
            diagram = result()
        except ContinuationError as error:
            failed = failed or error
            continue
        yield number, diagram
    if failed is not None:
        raise failed


# What all levels share is given to each process when it starts: tasks stay so small that the pipe
# to the processes never fills, for a full one holds up the end of a pool whose processes died.
_given: tuple[ModalSystem, tuple[float, float], Jobs, dict[str, Any], Board | None]


def _start(
    system: ModalSystem,
    omega: tuple[float, float],
    jobs: Jobs,
    options: dict[str, Any],
    board: Board | None,
) -> None:
    """Leave interrupts to the parent, and do not outlive it."""
    global _given
    _given = system, omega, jobs, options, board
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _shared(number: int) -> Diagram:
    system, omega, jobs, options, board = _given
    level, own = jobs[number]
    told = _told(number, None if board is None else board.write)
    return _one(system, omega, level, options | own | told)


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
