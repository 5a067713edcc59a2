"""Basins of attraction: which motion a start settles on, over a plane of starts.

Starts are told apart by the motions that they come to: periodic ones by their states at drive
phase 0 within the periods of a doubled motion, everything that has not settled as one.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.ensemble.sweeps import Sweeps, sweeps
from nanorom.continuation.system import ModalSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

SAME = 1e-2  # of the largest state: how far ends of one motion may be from each other
ROAMING, GONE = -1, -2  # of what has not settled, and of what has left all bounds


@brief
@attrs.frozen(eq=False)
class Basins:
    """Where starts in a plane of states settle.

    first (n,), second (m,): coordinates along the two directions, ratios of them; which (n, m):
    number of the motion, from 0 by falling share, -1 of those that have not settled, -2 of those
    that left all bounds; state (k, 2L): of each motion at drive phase 0; amplitude (k, L) = max
    |q_r|, in the system's units; share (k,): of the starts, a ratio.
    """

    first: Array
    second: Array
    which: Numbers
    state: Array = attrs.field(repr=False)
    amplitude: Array
    share: Array


def basins(
    system: ModalSystem,
    omega: float,
    plane: tuple[Array, Array],
    first: Array,
    second: Array,
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    origin: Array | None = None,
    periods: int = 2000,
    settle: float = 1e-6,
    tolerance: float = 1e-6,
    progress: Callable[[int, int], None] | None = None,
) -> Basins:
    """Integrate every start origin + first_i plane[0] + second_j plane[1] until it settles.

    Parameters
    ----------
    system : ModalSystem
    omega : drive frequency, rad per unit of time
    plane : two directions (2L,) of states (q, dq/dt), in the system's units
    first, second : (n,) and (m,), coordinates along them, ratios
    direct, parametric : drive levels
    origin : (2L,), of the plane; rest if left out
    periods : most drive periods waited
    settle : relative change of the state over two drive periods that counts as settled
    tolerance : relative error of a step of the time integration
    progress : as of `sweeps`

    Raises ContinuationError for directions of a wrong shape, and as `sweeps` does.
    """
    directions = np.asarray(plane, dtype=float)
    if directions.ndim != 2 or len(directions) != 2:
        raise ContinuationError("plane: give two directions (2L,) of states (q, dq/dt)")
    base = np.zeros(directions.shape[1]) if origin is None else np.asarray(origin, dtype=float)
    one, two = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    grid = np.stack(np.meshgrid(one, two, indexing="ij"), axis=-1).reshape(-1, 2)
    found = sweeps(
        system,
        [omega],
        direct,
        parametric,
        state=base + grid @ directions,
        periods=periods,
        settle=settle,
        tolerance=tolerance,
        progress=progress,
    )
    which, ends = _sorted(found)
    return Basins(
        one,
        two,
        which.reshape(len(one), len(two)),
        found.state[ends, 0],
        found.amplitude[ends, 0],
        np.array([(which == number).mean() for number in range(len(ends))]),
    )


def _sorted(found: Sweeps) -> tuple[Numbers, Numbers]:
    """Numbers (B,) of the motions that members have settled on, and a member of each."""
    states, settled = found.state[:, 0], found.settled[:, 0]
    which = np.where(np.isnan(found.escaped), ROAMING, GONE)
    scale = np.abs(states[settled]).max(axis=0, initial=0.0)
    scale = np.where(scale > 0, scale, 1.0)
    ends: list[int] = []
    left = np.flatnonzero(settled & np.isnan(found.escaped))
    while len(left):
        near = (np.abs(states[left] - states[left[0]]) / scale).max(axis=1) < SAME
        which[left[near]] = len(ends)
        ends.append(int(left[0]))
        left = left[~near]
    counts = [(which == number).sum() for number in range(len(ends))]
    order = np.argsort(counts)[::-1]
    place = np.argsort(order)
    known = which >= 0
    which[known] = place[which[known]]
    return which, np.array(ends, dtype=int)[order]
