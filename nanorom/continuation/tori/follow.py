"""Tori of modal systems by one call: from a Neimark-Sacker point on, in frequency or level."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

import attrs
import numpy as np

from nanorom.continuation.arrays import finite
from nanorom.continuation.diagrams.diagram import SpecialPoint
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.continuation.orbits.harmonics import Support, close_support, symmetry_signs
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.continuation.tori.circle import HARMONICS
from nanorom.continuation.tori.course import Course, joined
from nanorom.continuation.tori.family import Family, Member
from nanorom.continuation.tori.parameter import Level, Varied, varied
from nanorom.continuation.tori.report import Report
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.continuation.tori.settle import curve_through, recorded
from nanorom.continuation.tori.torus import Torus
from nanorom.errors import ContinuationError
from nanorom.types import Array

Counted = Callable[[int, float], None]  # tori found, parameter of the last
ALLOWED = {
    "harmonics": (HARMONICS[0], HARMONICS[-1]),
    "steps": (1, 100_000),
    "tolerance": (1e-13, 1e-3),
    "period_multiple": (1, 100),
    "waited": (0, 1_000_000),
}


@one_thread()
def follow_torus(
    system: ModalSystem,
    point: SpecialPoint | Array,
    omega: Level | None = None,
    direct: Level = 0.0,
    parametric: Level = 0.0,
    *,
    at: float | None = None,
    period_multiple: int = 1,
    waited: int = 0,
    tolerance: float = 1e-10,
    harmonics: int = 100,
    steps: int = 200,
    progress: Counted | None = None,
) -> Torus:
    """A family of tori: what branches from the response at a Neimark-Sacker point, or what a motion
    in time has settled on.

    Exactly one of `omega`, `direct` and `parametric` is a range (low, high): it is varied.

    Parameters
    ----------
    system : ModalSystem
    point : SpecialPoint or (2L,)
        An "NS" of `explore`, at the same levels; or a state (q, dq/dt) at drive phase 0 of a motion
        on a stable torus, say the end of a `sweep`: the family is followed to both sides of it.
    omega : (low, high) or float, optional
        Drive frequency, rad per unit of time of the system; that of the point if left out.
    direct, parametric : float or (low, high)
        Drive levels.
    at : float
        The value of what is varied at the point; for an "NS" and a range of omega, its own.
    period_multiple : int
        Periods of the drive after which the motion from a state returns to the same curve.
    waited : int, periods that a motion from a state is given to settle
    tolerance : float
        Size of the last harmonics of the second angle, relative to the states.
    harmonics : int
        Most harmonics of the second angle; where they do not suffice the family ends ("breakdown").
    steps : int, most to each side
    progress : called with the number of tori found and the parameter of the last

    Raises
    ------
    ContinuationError
        for another kind of point, an invalid range or level, a point outside the range; a state
        whose motion is periodic or irregular.
    """
    _check(harmonics=harmonics, steps=steps, tolerance=tolerance)
    _check(period_multiple=period_multiple, waited=waited)
    if omega is None and isinstance(point, SpecialPoint):
        omega = point.omega
    given = {"direct": direct, "parametric": parametric, "omega": omega}
    parameter = varied(system, {name: level for name, level in given.items() if level is not None})
    start = parameter.scaled(_start(parameter, point, at))
    told = _counted(progress, parameter.unit)
    follow = _Follow(parameter, start, (tolerance, harmonics, steps), told)
    if isinstance(point, SpecialPoint):
        return follow.from_orbit(point)
    return follow.from_motion(point, period_multiple, waited)


@attrs.frozen
class _Follow:
    """How families are followed: in a parameter, from a start, to limits, telling their members."""

    parameter: Varied
    start: float
    limits: tuple[float, int, int]
    told: Callable[[Member], None]

    def from_orbit(self, point: SpecialPoint) -> Torus:
        """What branches from an orbit at a Neimark-Sacker point."""
        parameter = self.parameter
        signs = _signs(parameter.equations(self.start)[0], point)
        map_ = ReturnMap(parameter.equations, point.period_multiple, signs)
        family = Family(map_, *self.limits)
        first = family.from_orbit(_scaled_state(parameter, point.state), self.start)
        course = Course().run(family, *first, parameter.span, self.told)
        return Report(parameter, map_).torus(family, course)

    def from_motion(self, state: Array, period_multiple: int, waited: int) -> Torus:
        """What a motion from a state settles on, followed to both sides."""
        parameter = self.parameter
        map_ = ReturnMap(parameter.equations, period_multiple)
        family = Family(map_, *self.limits)
        states = recorded(map_, _scaled_state(parameter, state), self.start, waited)
        curve, border = family.at_start(curve_through(states, self.start))
        sides = [
            Course().run(family, curve, border.times(sign), parameter.span, self.told)
            for sign in (-1.0, 1.0)
        ]
        return Report(parameter, map_).torus(family, joined(*sides))


def _scaled_state(parameter: Varied, state: object) -> Array:
    unit = parameter.system
    given = np.asarray(state, dtype=float)
    if given.shape != (2 * unit.size,) or not np.all(np.isfinite(given)):
        raise ContinuationError(
            f"point: give an NS point or (q, dq/dt) as {2 * unit.size} finite numbers"
        )
    return unit.inner_states(given)


def _start(parameter: Varied, point: SpecialPoint | Array, at: float | None) -> float:
    """The value of the parameter at the point; raises ContinuationError outside the range."""
    special = isinstance(point, SpecialPoint)
    if isinstance(point, SpecialPoint) and not KINDS[point.type].sheds_tori:
        allowed = " | ".join(code for code, kind in KINDS.items() if kind.sheds_tori)
        raise ContinuationError(
            f"point: found {point.type}; allowed a special point of type {allowed}"
        )
    if at is None and not (special and parameter.name == "omega"):
        raise ContinuationError(f"at: missing; give the {parameter.name} of the point")
    if at is not None and not finite(at):
        raise ContinuationError(f"at: found {at!r}; allowed a finite number")
    value = float(at) if at is not None else point.omega  # type: ignore[union-attr]
    if not parameter.holds(value):
        low, high = (limit * parameter.unit for limit in parameter.span)
        raise ContinuationError(
            f"{parameter.name}: range ({low:g}, {high:g}) does not hold the point at {value:.10g}"
        )
    return value


def _counted(progress: Counted | None, unit: float) -> Callable[[Member], None]:
    """What tells progress of every member."""
    numbers = count(1)

    def told(member: Member) -> None:
        number = next(numbers)
        if progress is not None:
            progress(number, member.curve.parameter * unit)

    return told


def _check(**given: object) -> None:
    for name, value in given.items():
        low, high = ALLOWED[name]
        if not finite(value) or not low <= value <= high:  # type: ignore[operator]
            raise ContinuationError(f"{name}: found {value!r}; allowed {low:g} to {high:g}")


def _signs(system: ScaledSystem, point: SpecialPoint) -> Array | None:
    """Signs of the modes half a period later, if the orbit of the point has that symmetry."""
    p = point.period_multiple
    numbers = (np.arange(len(point.coefficients)) + 1) // 2 % (2 * p)
    table = np.zeros((system.size, 2 * p), dtype=bool)
    for row, number in zip(point.coefficients != 0, numbers):
        table[:, number] |= row
    return symmetry_signs(system, close_support(system, Support(table)), p)
