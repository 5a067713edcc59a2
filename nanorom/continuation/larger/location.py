"""The orbit of the larger equations next to one of a model, and the special point next to its own.

Newton's method goes across the branch of the model to the larger one; a special point is then
looked for along that, by secants, with the slope of the rate for a fold and the modulus of the
multiplier nearest to the critical one for all others.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.larger.equations import LargerSystem, Seen
from nanorom.continuation.orbits.balance import HarmonicBalance, NewtonFailure
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.types import Array, Numbers

CORRECTED = 1e-7  # of an orbit: the last change of Newton's method
FIRST, WITHIN = 1e-3, 0.3  # of the orbit's size: the first step along the branch, and the longest
LONGEST = 3.0  # times the step before
CLOSE = 1e-6  # of the frequency: the last change
MOST = 12  # steps
REST = 1e-3  # size below which lengths are absolute


@attrs.frozen(eq=False)
class Place:
    """A point of the branch of the larger equations, and its unit tangent (n + 1,)."""

    x: Array
    rate: float
    tangent: Array


def nearby(seen: Seen, slope: Array) -> Place:
    """The orbit next to one of the model, across its branch; slope: dx/drate along that.

    Raises NewtonFailure if there is none.
    """
    border = np.append(slope, 1.0)
    return _corrected(seen.balance, seen.x, seen.rate, border / np.linalg.norm(border))


def _corrected(balance: HarmonicBalance, x: Array, rate: float, border: Array) -> Place:
    x, rate, factors = balance.correct(x, rate, border, CORRECTED)
    tangent = factors.solve(np.append(np.zeros(len(border) - 1), 1.0))
    return Place(x, rate, tangent / np.linalg.norm(tangent))


def moved(seen: Seen, place: Place, length: float) -> Place:
    """A point further along the branch."""
    step = length * place.tangent
    x = place.x + seen.basis.unpack(step[:-1])
    return _corrected(seen.balance, x, place.rate + float(step[-1]), place.tangent)


class Critical:
    """What vanishes at a special point: its value at a place, the multiplier followed on the way.

    multipliers : of the model's own point.
    """

    def __init__(self, larger: LargerSystem, seen: Seen, kind: Kind, multipliers: Numbers) -> None:
        self.larger, self.seen, self.kind = larger, seen, kind
        self._near = kind.condition.nearest(multipliers)

    def __call__(self, place: Place) -> float:
        if self.kind.turns:
            return float(place.tangent[-1])
        found = self.larger.multipliers(self.seen, place.x, place.rate)
        self._near = complex(found[np.argmin(np.abs(found - self._near))])
        return float(np.log(np.abs(self._near))) - self.kind.condition.growth


def special(
    larger: LargerSystem, seen: Seen, place: Place, kind: Kind, multipliers: Numbers
) -> Place:
    """The special point next to a place; multipliers: of the model's point.

    Raises NewtonFailure if there is none nearby.
    """
    critical = Critical(larger, seen, kind, multipliers)
    scale = max(float(np.abs(place.x).max()), REST)
    value, total = critical(place), 0.0
    step = FIRST * scale
    for _ in range(MOST):
        try:
            new = moved(seen, place, step)
        except NewtonFailure:
            step /= 4
            continue
        slope = ((there := critical(new)) - value) / step
        total += step
        small = abs(new.rate - place.rate) < CLOSE * new.rate
        # by the tangent that was, steps count on in its direction
        turned = np.sign(new.tangent @ place.tangent)
        place, value = new, there
        if small and abs(step) < FIRST * scale / 2:
            return place
        if slope == 0 or abs(total) > WITHIN * max(scale, 1.0):
            break
        step = float(np.clip(-value / slope, -LONGEST * abs(step), LONGEST * abs(step))) * turned
    raise NewtonFailure("no such point nearby")
