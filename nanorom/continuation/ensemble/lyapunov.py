"""Largest Lyapunov exponents: how fast neighbours of a motion leave it or come back.

Source: Benettin, Galgani, Giorgilli, Strelcyn 1980, doi:10.1007/BF02128236 (tangents made
orthogonal again and again; here once a period of the drive).
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.ensemble.ensemble import Ensemble, Members, ensemble_of, members_of
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

BLOCKS = 20  # whose means tell how well the mean of all is known
ALIGNED = 0.2  # of the periods, after which tangents have turned into their directions
LEAST_PERIODS = 100
TINY = 1e-300  # of a tangent: that of a state of first order that does not matter


@brief
@attrs.frozen(eq=False)
class Lyapunov:
    """Exponents of B motions.

    omega, direct, parametric (B,); exponents (B, k): the k largest, per unit of time, falling;
    error (B, k): their standard errors, of the means over blocks of periods; state (B, 2L): at the
    end, at drive phase 0, in the system's units. NaN where the motion left all bounds.
    """

    omega: Array
    direct: Array
    parametric: Array
    exponents: Array
    error: Array
    state: Array = attrs.field(repr=False)

    @property
    def largest(self) -> Array:
        """The largest exponent (B,), per unit of time: positive of chaos, 0 on a torus."""
        return np.asarray(self.exponents[:, 0])


@one_thread()
def lyapunov(
    system: ModalSystem,
    omega: object,
    direct: object = 0.0,
    parametric: object = 0.0,
    *,
    state: object = None,
    count: int = 1,
    waited: int = 300,
    periods: int = 1000,
    tolerance: float = 1e-8,
    engine: str = "auto",
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Lyapunov:
    """The largest Lyapunov exponents of many motions in time at once: along a sweep, say.

    Parameters
    ----------
    system : ModalSystem
    omega : number or (B,), drive frequency of each motion, rad per unit of time
    direct, parametric : drive levels, one or (B,)
    state : (2L,) or (B, 2L), (q, dq/dt) at drive phase 0, say those of a sweep at these
        frequencies; a small disturbance of rest if left out
    count : k, how many exponents, 1 to 2L; the sum of all is minus the trace of the damping
    waited : drive periods before the tangents start
    periods : drive periods over which exponents are averaged; a fifth as many pass before
    tolerance : relative error of a step of the time integration
    engine, workers : as of `sweeps`
    progress : called with periods done, and how many there are

    Raises
    ------
    ContinuationError
        for invalid frequencies, levels or states, a count or numbers of periods that do not do.
    """
    members = _checked(system, omega, (direct, parametric), state, (count, waited, periods))
    ensemble = ensemble_of(system, members, tolerance, engine, workers)
    unit = ensemble.equations.scaled
    rates = members.omega[:, 0] / unit.frequency
    states = np.ascontiguousarray(unit.inner_states(members.states).T)[None]
    told = progress or (lambda done, total: None)
    states, left = _wait(ensemble, states, rates, waited)
    states, growth, gone = _grow(ensemble, states, rates, count, periods, told)
    growth = growth * (rates / (2 * np.pi) * unit.frequency)[:, None]
    means = [block.mean(axis=0) for block in np.array_split(growth, BLOCKS)]
    found = growth.mean(axis=0)
    error = np.std(means, axis=0, ddof=1) / np.sqrt(BLOCKS)
    lost = np.logical_or(left, gone)
    found[lost], error[lost] = np.nan, np.nan
    return Lyapunov(
        members.omega[:, 0],
        members.direct,
        members.parametric,
        found,
        error,
        unit.given_states(states[0].T),
    )


def _checked(
    system: ModalSystem,
    omega: object,
    levels: tuple[object, object],
    state: object,
    numbers: tuple[int, int, int],
) -> Members:
    count, waited, periods = numbers
    frequencies = np.asarray(omega, dtype=float)
    if frequencies.ndim > 1:
        raise ContinuationError("omega: give one drive frequency, or (B,) of them")
    members = members_of(system, frequencies.reshape(-1, 1), *levels, state)
    most = members.states.shape[1]
    if not 1 <= count <= most:
        raise ContinuationError(f"count: found {count}; allowed 1 to {most} exponents")
    if waited < 0 or periods < LEAST_PERIODS:
        raise ContinuationError(
            f"periods: found {periods} after {waited}; allowed {LEAST_PERIODS} or more after 0 or "
            "more"
        )
    return members


def _wait(ensemble: Ensemble, states: Array, rates: Array, periods: int) -> tuple[Array, Array]:
    everyone = np.arange(len(rates))
    if not periods:
        return states, np.zeros(len(rates), dtype=bool)
    states, _, left = ensemble.run(states, everyone, rates, periods, 1)
    states[..., left] = 0.0  # go on from rest, not to be read
    return states, left


def _grow(
    ensemble: Ensemble,
    states: Array,
    rates: Array,
    count: int,
    periods: int,
    told: Callable[[int, int], None],
) -> tuple[Array, Array, Array]:
    """States at the end, logarithmic growth (periods, B, count) of tangents, and who left."""
    members, size = len(rates), states.shape[1]
    everyone, gone = np.arange(members), np.zeros(members, dtype=bool)
    # no direction is special: orthogonal ones that touch every coordinate
    waves = np.cos(np.outer(np.arange(1, size + 1), np.arange(1, size + 1) ** 2))
    frames = np.broadcast_to(np.linalg.qr(waves)[0][:, :count], (members, size, count))
    aligned = int(ALIGNED * periods)
    growth = np.empty((periods, members, count))
    states = states[:1]
    for period in range(-aligned, periods):
        both = np.concatenate([states, frames.transpose(2, 1, 0)])
        both, _, left = ensemble.run(both, everyone, rates, 1, 1)
        both[..., left] = 0.0
        gone |= left
        states = both[:1]
        frames, factors = np.linalg.qr(both[1:].transpose(2, 1, 0))
        if period >= 0:
            sizes = np.abs(np.diagonal(factors, axis1=1, axis2=2))
            growth[period] = np.log(np.maximum(sizes, TINY))
            told(period + 1, periods)
    return states, growth, gone
