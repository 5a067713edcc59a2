"""Curves of orbits with a critical multiplier in the plane of drive frequency and a parameter.

The balance and the criticality of the orbit (`critical`) are followed by pseudo-arclength. Where
the parameter turns back along the curve there is a cusp of folds, or the tip of a tongue; these
points are located, too, and so are those at given levels of the parameter. Source: Detroux et al.
2015, doi:10.1016/j.cma.2015.07.017 (bifurcation tracking with harmonic balance).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.continuation.branches.march import STRAIGHT, March, StepControl
from nanorom.continuation.orbits.bifurcations import TORUS, Kind
from nanorom.continuation.orbits.harmonics import (
    HARMONIC_LADDER,
    Support,
    close_support,
    forced_support,
)
from nanorom.continuation.points.critical import CriticalBalance
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

NEWTON = 1e-9  # of the unknowns: the last change of Newton's method
ABSENT = 1e-9  # coefficients of the orbit, relative to the largest, that are round-off
TURN = 1e-9  # of a step, to which a turn of the parameter is located
NEWTON_STEPS, EASY_STEPS = 8, 4
FIRST = 0.1  # of the largest step
LEAST_STEP = 1e-7  # arc length, in units of the unknowns
SHORT = 1e-5  # arc length below which the curve may turn as it likes: a cusp
BENT = 0.2  # of a step: how far its middle may be off the chord
LAST_ROWS = 4  # of the coefficients: cosine and sine of the last two harmonics


@attrs.frozen(eq=False)
class _Place:
    """A point of a curve in the unknowns z of a balance, and its tangent."""

    balance: CriticalBalance
    support: Support
    z: Array
    tangent: Array


@attrs.frozen(eq=False)
class CriticalPoint:
    """A point of a curve in scaled units: coefficients (2H + 1, L) of all modes, rate = omega by
    the period multiple, level, second frequency by the rate (NS), whether the level turns back.
    """

    full: Array
    rate: float
    level: float
    shift: float = 0.0
    turn: bool = False


@attrs.define(eq=False)
class CriticalCurve:
    """Pseudo-arclength continuation of balance and criticality of the system origin + level *
    change, in scaled units.

    limits : of the drive frequency and of the level
    tolerance : size of the last harmonics, relative to the orbit
    at : levels at which points are located
    """

    origin: ScaledSystem
    change: ScaledSystem
    kind: Kind
    multiple: int
    limits: tuple[tuple[float, float], tuple[float, float]]
    tolerance: float
    at: Sequence[float] = ()

    def _support(self, full: Array) -> Support:
        """Modes and harmonics of the orbit and of what the parameter adds to them."""
        everything = self.origin.pattern().plus(self.change.pattern(), 1.0)
        table = forced_support(everything, self.multiple).table.copy()
        present = np.abs(full) > ABSENT * np.abs(full).max(initial=0.0)
        numbers = (np.arange(len(full)) + 1) // 2 % table.shape[1]
        np.logical_or.at(table.T, numbers, present)
        return close_support(everything, Support(table))

    def follow(
        self, first: CriticalPoint, sign: float, steps: int, largest: float
    ) -> list[CriticalPoint]:
        """Points from the first one in one direction; sign: of the change of the level."""
        support = self._support(first.full)
        balance = self._balance(support, self._harmonics(first.full))
        z, tangent, _ = self._correct(balance, self._pack(balance, first), None)
        tangent *= sign * (1.0 if tangent[balance.basis.size + 1] >= 0 else -1.0)
        start = _Place(balance, support, z, tangent)
        points = [self._unpack(start)]
        control = StepControl(FIRST * largest, LEAST_STEP, largest, steps)
        for here, there in March(self._advance, start, control):
            points += self._between(here, there)
            points.append(self._unpack(there))
            if not self._inside(points[-1]):
                break
        return points

    def _harmonics(self, full: Array) -> int:
        """How many of an orbit's harmonics are not small."""
        sizes = np.abs(full).max(axis=1)
        large = np.flatnonzero(sizes > self.tolerance * sizes.max(initial=0.0))
        return int((large.max(initial=0) + 1) // 2)

    def _advance(self, here: _Place, length: float) -> tuple[_Place, bool]:
        here = self._adapt(here)
        z, tangent, steps = self._correct(
            here.balance, here.z + length * here.tangent, here.tangent
        )
        if tangent @ here.tangent < STRAIGHT and length > SHORT:
            raise ContinuationError("the curve of special points turns too fast for the step")
        return attrs.evolve(here, z=z, tangent=tangent), steps <= EASY_STEPS

    def _between(self, here: _Place, there: _Place) -> list[CriticalPoint]:
        """The points within a step at which the parameter turns back or has a level asked for."""
        balance = there.balance
        before = here if here.balance is balance else self._moved(here, balance)
        level = balance.basis.size + 1
        turning = self._located(before, there, lambda place: float(place.tangent[level]))
        found = []
        for one, two in ((before, turning or there), (turning, there)):
            if one is None:
                break
            if one is turning:
                found.append(attrs.evolve(self._unpack(one), turn=True))
            for value in sorted(self.at, reverse=bool(one.z[level] > two.z[level])):
                place = self._at_level(one, two, value)
                found += [] if place is None else [self._unpack(place)]
        return found

    def _at_level(self, before: _Place, there: _Place, value: float) -> _Place | None:
        """The point within a step that has a level, if it is between those of its ends."""
        level = before.balance.basis.size + 1
        ends = before.z[level] - value, there.z[level] - value
        if ends[0] * ends[1] >= 0:
            return None
        z = before.z + ends[0] / (ends[0] - ends[1]) * (there.z - before.z)
        z[level] = value
        try:
            found, tangent, _ = self._correct(before.balance, z, None)
        except ContinuationError:
            found, tangent = np.full_like(z, np.inf), z
        if np.linalg.norm(found - z) < BENT * np.linalg.norm(there.z - before.z):
            return attrs.evolve(before, z=found, tangent=tangent)
        return self._located(before, there, lambda place: float(place.z[level]) - value)

    def _located(
        self, before: _Place, there: _Place, function: Callable[[_Place], float]
    ) -> _Place | None:
        """Where a function of the points of a step vanishes, if its sign changes."""
        if function(before) * function(there) >= 0:
            return None
        length = float((there.z - before.z) @ before.tangent)

        def place(a: float) -> _Place:
            z = before.z + a * before.tangent
            z, tangent, _ = self._correct(before.balance, z, before.tangent)
            return attrs.evolve(before, z=z, tangent=tangent)

        try:
            return place(brentq(lambda a: function(place(a)), 0.0, length, xtol=TURN * length))
        except (ContinuationError, ValueError):  # not to be had exactly: the nearer end
            return min(before, there, key=lambda end: abs(function(end)))

    def _inside(self, point: CriticalPoint) -> bool:
        (low, high), (least, most) = self.limits
        return low <= point.rate * self.multiple <= high and least <= point.level <= most

    def _balance(self, support: Support, harmonics: int) -> CriticalBalance:
        known = [h for h in HARMONIC_LADDER if h >= harmonics]
        h = known[0] if known else HARMONIC_LADDER[-1]
        return CriticalBalance(self.origin, self.change, support, self.kind, self.multiple, h)

    def _adapt(self, here: _Place) -> _Place:
        """More harmonics where the last ones are not small."""
        sizes = np.abs(self._unpack(here).full).max(axis=1)
        harmonics = here.balance.basis.harmonics
        if (
            sizes[-LAST_ROWS:].max() <= self.tolerance * sizes.max()
            or harmonics >= HARMONIC_LADDER[-1]
        ):
            return here
        return self._moved(here, self._balance(here.support, harmonics + 1))

    def _moved(self, here: _Place, larger: CriticalBalance) -> _Place:
        """A place with its tangent on another number of harmonics."""
        basis, n = here.balance.basis, here.balance.basis.size
        step = basis.expand(basis.unpack(here.tangent[:n]), self.origin.size)
        moved = larger.basis.pack(larger.basis.compress(step))
        tangent = np.concatenate([moved, here.tangent[n:]])
        z = self._pack(larger, self._unpack(here))
        return attrs.evolve(here, balance=larger, z=z, tangent=tangent)

    def _pack(self, balance: CriticalBalance, point: CriticalPoint) -> Array:
        x = balance.basis.pack(balance.basis.compress(point.full))
        extra = [point.rate, point.level] + ([point.shift] if self.kind is TORUS else [])
        return np.concatenate([x, extra])

    def _unpack(self, place: _Place) -> CriticalPoint:
        basis, z, n = place.balance.basis, place.z, place.balance.basis.size
        full = basis.expand(basis.unpack(z[:n]), self.origin.size)
        shift = float(z[n + 2]) if len(z) > n + 2 else 0.0
        return CriticalPoint(full, float(z[n]), float(z[n + 1]), shift)

    def _correct(
        self, balance: CriticalBalance, z: Array, tangent: Array | None
    ) -> tuple[Array, Array, int]:
        """Newton's method, orthogonal to the tangent (to the level's axis at first), the new
        tangent, and the number of corrections.
        """
        border = np.zeros(len(z)) if tangent is None else tangent
        if tangent is None:
            border[balance.basis.size + 1] = 1.0
        right = np.zeros((len(z), 2))  # for the change, and for the tangent
        right[-1, 1] = 1.0
        for step in range(NEWTON_STEPS):
            residual, jacobian = balance.system(z)
            right[:-1, 0] = -residual
            try:
                change, direction = np.linalg.solve(np.vstack([jacobian, border]), right).T
            except np.linalg.LinAlgError:  # and raise, as where the corrections do not shrink
                break
            z = z + change
            if not np.all(np.isfinite(z)) or z[balance.basis.size] <= 0:
                break
            if np.abs(change).max() < NEWTON * max(1.0, np.abs(z).max()):
                return z, direction / np.linalg.norm(direction), step + 1
        raise ContinuationError("the curve of special points cannot be corrected")
