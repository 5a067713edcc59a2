"""States at rest along a parameter, and where they begin to move by themselves (Hopf points).

The static balance is followed by pseudo-arclength; growth rates of small motions tell where the
state loses its stability: by a complex pair (HB, a limit cycle begins), or by a real one where the
parameter turns back (LP) or does not (BP, another state at rest). Source: Kuznetsov, Elements of
Applied Bifurcation Theory, sections 3.2 and 3.4.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import attrs
import numpy as np

from nanorom.continuation.branches.march import STRAIGHT, March, StepControl
from nanorom.continuation.curves.parameter import Given, Parameter, parameter_of
from nanorom.continuation.orbits.linear import free_motions, static_force, static_stiffness
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

NEWTON, NEWTON_STEPS, EASY_STEPS = 1e-12, 10, 4  # the last change of the unknowns
FIRST, LEAST_STEP = 0.1, 1e-8  # of the largest step; arc length in scaled units
LOCATED = 1e-13  # of a step: to which bifurcations are
MOVING = 1e-9  # imaginary part of a growth rate, by its modulus, of a motion that oscillates
TURNING = 1e-4  # of a tangent: what its part along the parameter is where that turns back


@attrs.frozen(eq=False)
class RestPoint:
    """Where states at rest lose or regain stability.

    type: "HB" (a limit cycle begins), "LP" (the parameter turns back), "BP" (other states at rest
    begin); level of the parameter; omega: of the motion that begins, rad per unit of time, 0 of LP
    and BP; state (L,): q at rest, in units of the system; shape (L,): complex, of the motion that
    begins, in any unit.
    """

    type: Literal["HB", "LP", "BP"]
    level: float
    omega: float
    state: Array
    shape: Numbers


@attrs.frozen(eq=False)
class RestStates:
    """States at rest along a parameter.

    level (n,); state (n, L): q in units of the system; stable (n,); growth (n, 2L - S): growth
    rates of small motions, per unit of time, with their angular frequencies as imaginary parts; S
    states of first order; special_points: in order.
    """

    level: Array
    state: Array
    stable: Array
    growth: Numbers
    special_points: list[RestPoint]


@one_thread()
def rest_states(
    system: ModalSystem,
    level: tuple[float, float],
    parameter: Given = "direct",
    *,
    direct: float = 0.0,
    parametric: float = 0.0,
    steps: int = 500,
    largest_step: float = 0.05,
) -> RestStates:
    """Follow the state at rest from the low end of a range of a parameter.

    Parameters
    ----------
    system : ModalSystem
        Its drives may be constant (harmonic 0) alone at the levels given.
    level : (low, high) of the parameter
    parameter : "direct" or "parametric", the level that varies; the name of another array, a factor
        on it; arrays by name that are added `level` times; or another `ModalSystem`, reached at
        level 1
    direct, parametric : levels of the drives otherwise, in units of the patterns
    steps : most steps
    largest_step : arc length, relative to the range and the unit of displacement

    Raises
    ------
    ContinuationError
        for an unknown parameter, a range that is not rising, drives that oscillate, or where there
        is no state at rest at the low end.
    """
    line = parameter_of(system, parameter, level, direct, parametric)
    curve = _Curve(line, (level[0] / line.size, level[1] / line.size))
    places = list(curve.follow(steps, largest_step))
    unit, points = line.unit, []
    for before, after in zip(places[:-1], places[1:]):
        points += [curve.point(place) for place in curve.changes(before, after)]
    growth = np.array([curve.growth(place) for place in places])
    return RestStates(
        level=np.array([place.y[-1] for place in places]) * line.size,
        state=np.array([unit.given(place.y[:-1]) for place in places]),
        stable=growth.real.max(axis=1) < 0,
        growth=growth * unit.frequency,
        special_points=points,
    )


@attrs.frozen(eq=False)
class _Place:
    """State and level y (L + 1,), in scaled units, and the tangent there."""

    y: Array
    tangent: Array


class _Curve:
    """The static balance along a parameter."""

    def __init__(self, line: Parameter, limits: tuple[float, float]) -> None:
        self.line, self.limits = line, limits
        for level in limits:
            ends = line.at(level)
            if ends.force[:, 1:].any() or ends.parametric[..., 1:].any():
                raise ContinuationError(
                    "drives: found one that oscillates; allowed are constant ones (harmonic 0), "
                    "for nothing is at rest under others"
                )

    def follow(self, steps: int, largest: float) -> Iterator[_Place]:
        size = self.line.unit.size
        level = np.eye(size + 1)[-1]
        try:
            y = np.append(np.zeros(size), self.limits[0])
            start, _ = self._correct(y, level)
        except ContinuationError:
            raise ContinuationError(
                f"level: no state at rest is found at {self.limits[0] * self.line.size:g}; begin "
                "with a smaller constant drive"
            ) from None
        span = self.limits[1] - self.limits[0]
        control = StepControl(FIRST * largest * span, LEAST_STEP, largest * span, steps)
        yield start
        for _, place in March(self._advance, start, control):
            yield self._cut(place)
            if not self.limits[0] <= place.y[-1] < self.limits[1]:
                return

    def _cut(self, place: _Place) -> _Place:
        """The place, or the end of the range beyond which it is."""
        low, high = self.limits
        if low <= place.y[-1] <= high:
            return place
        y = place.y.copy()
        y[-1] = low if place.y[-1] < low else high
        return self._correct(y, np.eye(len(y))[-1])[0]

    def _advance(self, here: _Place, length: float) -> tuple[_Place, bool]:
        there, steps = self._correct(here.y + length * here.tangent, here.tangent)
        if there.tangent @ here.tangent < STRAIGHT and length > FIRST * FIRST:
            raise ContinuationError("the states at rest turn too fast for the step")
        return there, steps <= EASY_STEPS

    def _correct(self, y: Array, border: Array) -> tuple[_Place, int]:
        """Newton's method orthogonal to a border."""
        matrix = np.zeros((len(y),) * 2)
        right = np.zeros((len(y), 2))
        matrix[-1], right[-1, 1] = border, 1.0
        for step in range(NEWTON_STEPS):
            system, q = self.line.at(float(y[-1])), y[:-1]
            matrix[:-1, :-1] = static_stiffness(system, q)
            matrix[:-1, -1] = static_force(self.line.change, q)
            right[:-1, 0] = -static_force(system, q)
            try:
                change, direction = np.linalg.solve(matrix, right).T
            except np.linalg.LinAlgError:  # singular: as one that does not converge
                break
            y = y + change
            if np.abs(change).max() < NEWTON * max(1.0, np.abs(y).max()):
                return _Place(y, direction / np.linalg.norm(direction)), step + 1
        raise ContinuationError("no state at rest")

    def growth(self, place: _Place) -> Numbers:
        return free_motions(self.line.at(float(place.y[-1])), place.y[:-1])[0]

    def changes(self, before: _Place, after: _Place) -> Iterator[_Place]:
        """The places between two others at which growth rates change sign."""
        ends = [int((self.growth(place).real > 0).sum()) for place in (before, after)]
        if ends[0] == ends[1]:
            return
        length = float((after.y - before.y) @ before.tangent)
        if length < LOCATED * max(1.0, np.abs(before.y).max()):
            yield after
            return
        middle = _Place(before.y + length / 2 * before.tangent, before.tangent)
        try:
            middle = self._correct(middle.y, before.tangent)[0]
        except ContinuationError:  # where another curve of states crosses
            pass
        yield from self.changes(before, middle)
        yield from self.changes(middle, after)

    def point(self, place: _Place) -> RestPoint:
        unit = self.line.unit
        rates, shapes = free_motions(self.line.at(float(place.y[-1])), place.y[:-1])
        critical = int(np.abs(rates.real).argmin())
        omega = abs(float(rates[critical].imag))
        oscillates = omega > MOVING * float(np.abs(rates).max())
        turns = abs(place.tangent[-1]) < TURNING
        shape = shapes[:, critical]
        return RestPoint(
            type="HB" if oscillates else "LP" if turns else "BP",
            level=float(place.y[-1]) * self.line.size,
            omega=omega * unit.frequency if oscillates else 0.0,
            state=unit.given(place.y[:-1]),
            shape=unit.given(shape.real) + 1j * unit.given(shape.imag),
        )
