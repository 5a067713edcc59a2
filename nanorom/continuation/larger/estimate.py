"""What a model of L modes is wrong by at points of its diagram, as more modes have it.

For each point: the orbit next to it in the larger equations, for a special point the special point
next to it there, and the modes outside that make the difference.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.diagrams.selection import PLAIN, Chosen
from nanorom.continuation.larger.correction import Correction, change_of, first_correction
from nanorom.continuation.larger.equations import LargerSystem
from nanorom.continuation.larger.growth import participation
from nanorom.continuation.larger.location import Place, nearby, special
from nanorom.continuation.orbits.balance import NewtonFailure
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.continuation.orbits.orbit import orbit_amplitudes
from nanorom.types import Array

LOST = 1.0  # error of a point that the larger equations do not have
SMALLEST = 1e-300  # keeps a share of nothing finite
SMALL = 1e-3  # correction whose square does not count


@attrs.frozen(eq=False)
class Estimate:
    """A point of a diagram, and what it is wrong by.

    omega, amplitude: relative change of the frequency and of the amplitude of the largest mode,
    NaN where the larger equations have no such point; moving (N,): max |q_r| there in the system's
    units; shares (N,): of the error, by the modes outside that make it.
    """

    point: Chosen
    omega: float
    amplitude: float
    moving: Array
    shares: Array

    @property
    def found(self) -> bool:
        """Whether the larger equations have such a point."""
        return bool(np.isfinite(self.omega))

    @property
    def error(self) -> float:
        """The larger of the two changes; `LOST` where there is no such point."""
        return max(abs(self.omega), abs(self.amplitude)) if self.found else LOST


def estimate(larger: LargerSystem, point: Chosen) -> Estimate:
    """What a point of the model's diagram is wrong by."""
    seen = larger.seen(point.orbit)
    first = first_correction(larger, seen)
    if point.type == PLAIN and first.size < SMALL:
        return _found(larger, point, first, Place(first.x, first.rate, first.slope))
    try:
        place = nearby(seen, first.slope)
    except NewtonFailure:  # the estimate says so: NaN
        return _lost(larger, point, first)
    if point.type == PLAIN:
        return _found(larger, point, first, place)
    kind = KINDS[point.type]
    try:
        there = special(larger, seen, place, kind, point.multipliers)
        result = _found(larger, point, first, there)
    except NewtonFailure:
        there, result = place, _lost(larger, point, first)
    if kind.turns:
        return _along(result)
    critical = kind.condition.nearest(point.multipliers)
    part = participation(larger, seen, there.x, there.rate, critical)
    part[larger.inside] = 0.0
    share = part / max(float(part.sum()), SMALLEST)
    return attrs.evolve(result, shares=result.shares + result.error * share)


def _along(result: Estimate) -> Estimate:
    """A fold's estimate, its shares those of the whole error.

    Modes outside move a fold along its branch, too, and where that is flat by far more than they
    move the branch, which is what the first correction sees.
    """
    total = float(result.shares.sum())
    if not 0.0 < total < result.error:
        return result
    return attrs.evolve(result, shares=result.shares * (result.error / total))


def _lost(larger: LargerSystem, point: Chosen, first: Correction) -> Estimate:
    moving = larger.scaled.amplitude * first.moving
    return Estimate(point, np.nan, np.nan, moving, first.shares)


def _found(larger: LargerSystem, point: Chosen, first: Correction, place: Place) -> Estimate:
    full = larger.orbit(first.seen, place.x, place.rate).coefficients
    moving = larger.scaled.amplitude * orbit_amplitudes(full[None])[0]
    largest = int(point.amplitude.argmax())
    after = moving[larger.inside[[largest]]]
    (change,) = change_of(after, float(point.amplitude[largest]))
    omega = place.rate / first.seen.rate - 1
    return Estimate(point, omega, float(change), moving, first.shares)
