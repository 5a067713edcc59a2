"""The comb of a response: the spectrum of what an instrument sees while it sweeps, at one level."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nanorom.continuation import Branch, Comb, ModalSystem, PeriodicOrbit, comb
from nanorom.continuation.ensemble.ensemble import ensemble_of, members_of
from nanorom.errors import ContinuationError
from nanorom.results.beside import model_beside
from nanorom.results.question import Question
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.types import Array, Progress

ROWS, MOST_ROWS = 120, 2000  # drive frequencies
CELLS = 800  # of the analyser
BEYOND = 1.2  # of the highest frequency, that the band ends at
CLOSED = 1e-5  # of a state: what an orbit may be off by after its period
PERIODS, RECORDED = 300, 256  # of the drive: waited at most, and recorded


def comb_of(
    response: Response,
    model: ReducedModel,
    level: int | None = None,
    rows: int | None = None,
    progress: Progress | None = None,
) -> Comb:
    """The spectra of a sweep up through the range of a response, integrated in time.

    It starts on the largest stable orbit at the beginning of the range, or near rest.

    Parameters
    ----------
    response, model : the model is that of the response, with its damping
    level : of the drive's levels, from 1; the last if left out
    rows : drive frequencies, ROWS if left out
    progress : called as progress("drive frequencies", done, total)

    Raises
    ------
    ContinuationError
        for a level or a number of rows that is not there.
    """
    count = len(response.diagrams)
    if level is not None and not 1 <= level <= count:
        raise ContinuationError(f"level: found {level}; allowed 1 to {count}")
    rows = ROWS if rows is None else rows
    if not 2 <= rows <= MOST_ROWS:
        raise ContinuationError(f"rows: found {rows}; allowed 2 to {MOST_ROWS}")
    number = count - 1 if level is None else level - 1
    system, omega, _ = Question(response.drive, response.sweep).of(model)
    direct, parametric = response.drive.levels[number]
    highest = max(omega[1], 2 * np.pi * float(model.frequency[-1]))
    branches = response.diagrams[number].branches
    start = None
    if system.states is None:
        _check_orbits(system, branches, direct, parametric)
        start = _start(branches, omega[0])
    return comb(
        system,
        np.linspace(*omega, rows),
        (0.0, BEYOND * highest),
        direct,
        parametric,
        state=start,
        cells=CELLS,
        periods=PERIODS,
        recorded=RECORDED,
        progress=None if progress is None else partial(progress, "drive frequencies"),
    )


def _check_orbits(
    system: ModalSystem, branches: list[Branch], direct: float, parametric: float
) -> None:
    """Raise ContinuationError unless an orbit of the response is one of the model's.

    Models keep their own damping, beside which a response may have been followed with another.
    """
    stable = [(branch, np.flatnonzero(branch.stable)) for branch in branches]
    some = [(branch, int(found[len(found) // 2])) for branch, found in stable if len(found)]
    if not some:
        return
    branch, index = some[0]
    begin = _state(branch.orbit(index))
    members = members_of(system, [branch.omega[index]], direct, parametric, begin)
    ensemble = ensemble_of(system, members, CLOSED / 10, "auto", 1)
    unit = ensemble.equations.scaled
    states, rate = unit.inner_states(begin)[None, :, None], members.omega[0] / unit.frequency
    end = ensemble.run(states, np.arange(1), rate, branch.period_multiple, 1)[0]
    if np.abs(end - states).max() > CLOSED * np.abs(states).max():
        raise ContinuationError(
            "response: found orbits that are none of the model beside it, which has another "
            "damping; allowed: a response that was followed with the damping of its rom.h5"
        )


def _state(orbit: PeriodicOrbit) -> Array:
    return np.concatenate([orbit(0.0), orbit.velocity(0.0)])


def _start(branches: list[Branch], omega: float) -> Array | None:
    """The state of the largest stable orbit near a frequency, if there is one within a step."""
    best: tuple[float, Any] = (0.0, None)
    for branch in branches:
        if len(branch.omega) < 2:
            continue
        width = float(np.abs(np.diff(branch.omega)).max())
        for index in np.flatnonzero(branch.stable & (np.abs(branch.omega - omega) <= width)):
            size = float(branch.amplitude[index].max())
            if size > best[0]:
                best = size, branch.orbit(int(index))
    return None if best[1] is None else _state(best[1])


def comb_beside(
    response: Response, path: Path, level: int | None, progress: Progress | None = None
) -> Comb:
    """The comb of the response of a file, by the model beside it; raises FileError without."""
    return comb_of(response, model_beside(response, path), level, progress=progress)
