"""Curves of orbits with a critical multiplier in the plane of drive frequency and a parameter.

The balance and the criticality of the orbit (`critical`) are followed. Where the parameter turns
back along the curve there is a cusp of folds, or the tip of a tongue; bifurcations of codimension
two (`codimension_two`) are located within a step. Source: Detroux et al. 2015,
doi:10.1016/j.cma.2015.07.017 (bifurcation tracking with harmonic balance).
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.curves.codimension_two import Orbit, Row, orbit_at, rows_of
from nanorom.continuation.curves.curve import Curve, Place, Point
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.continuation.orbits.harmonics import Support
from nanorom.continuation.points.critical import CriticalBalance
from nanorom.errors import ContinuationError
from nanorom.types import Array

MEETING = 1e-5  # sine of a pair's angle: real multipliers have it 0 but for rounding
SPARE = 1.2  # times the coefficients that are wanted: so many change nothing
LEFT_OUT = 0.03  # of the tolerance: coefficients that are no unknowns


@attrs.define(eq=False, kw_only=True)
class CriticalCurve(Curve):
    """Orbits at a bifurcation of one kind; where a pair is critical, the further unknown is its
    second frequency by the rate.

    double : whether bifurcations of codimension two are looked for, which takes multipliers
    """

    kind: Kind
    double: bool = False
    _known: tuple[bytes, Orbit] | None = None  # the last place that was looked at
    _side: float = 0.0  # of the real axis, on which a pair is

    def equations(self, support: Support, harmonics: int) -> CriticalBalance:
        return CriticalBalance(
            self.origin, self.change, support, self.kind, self.multiple, harmonics
        )

    def _adapt(self, here: Place) -> Place:
        """As of any curve; without the coefficients that are next to zero."""
        here = super()._adapt(here)
        assert isinstance(here.balance, CriticalBalance)
        whole = here.balance.whole
        there = here if whole is here.balance else self._moved(here, whole)
        part = min(LEFT_OUT * self.tolerance, self.small_force)
        less = whole.without_small(there.z, part)
        wanted, known = less.basis.taken, here.balance.basis.taken
        if wanted.shape == known.shape and not (wanted & ~known).any():
            if here.balance.basis.size <= SPARE * less.basis.size:
                here.balance.begin_with(here.balance)
                return here
        less.begin_with(here.balance)
        return self._moved(there, less)

    def follow(
        self,
        first: Point,
        sign: float,
        steps: int,
        largest: float,
        direction: Array | None = None,
    ) -> list[Point]:
        """As of any curve; those of a pair end where it meets on the real axis, 1:1 or 1:2."""
        self._side = float(np.sign(_height(first))) if first.more else 0.0
        points = super().follow(first, sign, steps, largest, direction)
        return points if self._apart(points[-1]) else points[:-1]

    def _inside(self, point: Point) -> bool:
        return super()._inside(point) and self._apart(point)

    def _apart(self, point: Point) -> bool:
        """Whether a pair is one still: beyond, real ones have the same equations."""
        return not point.more or _height(point) * self._side > MEETING

    def _between(self, here: Place, there: Place) -> list[Point]:
        """Turns and levels asked for, and bifurcations of codimension two, in order."""
        found = super()._between(here, there)
        if not self.double:
            return found
        balance = there.balance
        before = here if here.balance is balance else self._moved(here, balance)
        for row in rows_of(self.kind):
            point = self._double(row, before, there)
            if point is not None:
                found.append(point)
        start, end = self._unpack(before), self._unpack(there)
        way = np.array([end.rate - start.rate, end.level - start.level])
        return sorted(
            found, key=lambda p: float(way @ [p.rate - start.rate, p.level - start.level])
        )

    def _double(self, row: Row, before: Place, there: Place) -> Point | None:
        try:
            place = self._located(before, there, lambda place: row.test(self._orbit(place)))
        except (ContinuationError, np.linalg.LinAlgError):  # no multipliers there: not told
            return None
        if place is None or not row.holds(self._orbit(place)):
            return None
        return attrs.evolve(self._unpack(place), code=row.code)

    def _orbit(self, place: Place) -> Orbit:
        key = place.z.tobytes()
        if self._known is None or self._known[0] != key:
            point = self._unpack(place)
            system = self.origin.plus(self.change, point.level)
            self._known = key, orbit_at(system, point, self.multiple, self.kind)
        return self._known[1]


def _height(point: Point) -> float:
    """Sine of the angle of the critical pair."""
    return float(np.sin(2 * np.pi * point.more[0]))
