"""Tori of modal systems by one call: from a Neimark-Sacker point on, in frequency or level."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.continuation.diagrams.diagram import SpecialPoint
from nanorom.continuation.orbits.harmonics import Support, close_support, symmetry_signs
from nanorom.continuation.system import ModalSystem, ScaledSystem, finite
from nanorom.continuation.threads import one_thread
from nanorom.continuation.tori.circle import HARMONICS
from nanorom.continuation.tori.events import Event, events
from nanorom.continuation.tori.family import Family, Member
from nanorom.continuation.tori.motion import QuasiPeriodic, motion
from nanorom.continuation.tori.parameter import Level, Varied, varied
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.continuation.tori.torus import Torus, TorusPoint, TorusState
from nanorom.errors import ContinuationError
from nanorom.types import Array


@one_thread()
def follow_torus(
    system: ModalSystem,
    point: SpecialPoint,
    omega: Level | None = None,
    direct: Level = 0.0,
    parametric: Level = 0.0,
    *,
    at: float | None = None,
    tolerance: float = 1e-10,
    harmonics: int = 100,
    steps: int = 200,
    progress: Callable[[int, float], None] | None = None,
) -> Torus:
    """The family of tori that branches from the response at a Neimark-Sacker point.

    Exactly one of `omega`, `direct` and `parametric` is a range (low, high): it is varied.

    Parameters
    ----------
    system : ModalSystem
    point : SpecialPoint
        An "NS" of `explore`, at the same levels.
    omega : (low, high) or float, optional
        Drive frequency, rad per unit of time of the system; that of the point if left out.
    direct, parametric : float or (low, high)
        Drive levels.
    at : float
        Where a level is varied: the level of the point.
    tolerance : float
        Size of the last harmonics of the second angle, relative to the states.
    harmonics : int
        Most harmonics of the second angle; where they do not suffice the family ends ("breakdown").
    steps : int
        Most steps.
    progress : called with the number of tori found and the parameter of the last.

    Raises
    ------
    ContinuationError
        for another kind of point, an invalid range or level, a point outside the range.
    """
    if getattr(point, "type", None) != "NS":
        raise ContinuationError(
            f"point: found {getattr(point, 'type', point)!r}; allowed a special point of type NS"
        )
    _check("harmonics", harmonics, HARMONICS[0], HARMONICS[-1])
    _check("steps", steps, 1, 100_000)
    _check("tolerance", tolerance, 1e-13, 1e-3)
    given = {"omega": point.omega if omega is None else omega}
    parameter = varied(system, given | {"direct": direct, "parametric": parametric})
    start = parameter.scaled(_start(parameter, point, at))
    unit = parameter.system
    signs = _signs(parameter.equations(start)[0], point)
    map_ = ReturnMap(parameter.equations, point.period_multiple, signs)
    family = Family(map_, tolerance, harmonics, steps)
    state = point.state / np.repeat([unit.amplitude, unit.amplitude * unit.frequency], unit.size)
    members: list[Member] = []
    found: list[Event] = []
    for member in family.follow(*family.from_orbit(state, start), parameter.span):
        if members and member.step:
            found += events(family, members[-1], member)
        members.append(member)
        if progress is not None:
            progress(len(members), member.curve.parameter * parameter.unit)
    return _Report(parameter, map_, family).torus(members, found)


def _start(parameter: Varied, point: SpecialPoint, at: float | None) -> float:
    """The value of the parameter at the point; raises ContinuationError outside the range."""
    if parameter.name != "omega" and at is None:
        raise ContinuationError(
            f"at: missing; give the {parameter.name} level at which the point was found"
        )
    value = point.omega if at is None else float(at)
    if not parameter.holds(value):
        low, high = (limit * parameter.unit for limit in parameter.span)
        raise ContinuationError(
            f"{parameter.name}: range ({low:g}, {high:g}) does not hold the point at {value:.10g}"
        )
    return value


def _check(name: str, value: object, low: float, high: float) -> None:
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


class _Report:
    """Members of a family in the user's units."""

    def __init__(self, varied: Varied, map_: ReturnMap, family: Family) -> None:
        self.varied, self.map, self.family = varied, map_, family

    def torus(self, members: list[Member], found: list[Event]) -> Torus:
        points = [TorusPoint(event.type, self.state(event.member)) for event in found]

        def at(index: int, parameter: float) -> TorusState:
            near = members[index : index + 2]
            wanted = parameter / self.varied.unit
            nearest = min(near, key=lambda member: abs(member.curve.parameter - wanted))
            return self.state(self.family.at_parameter(nearest, wanted))

        return Torus(
            [self.state(member) for member in members],
            points,
            self.map.period_multiple,
            self.varied.name,
            self.family.ending,
            at,
        )

    def state(self, member: Member) -> TorusState:
        curve, unit = member.curve, self.varied.system
        scaled = motion(self.map, curve)
        user = QuasiPeriodic(
            scaled.coefficients * unit.amplitude,
            scaled.omega * unit.frequency,
            scaled.second * unit.frequency,
            scaled.period_multiple,
        )
        duration = self.map.duration(curve.parameter) / unit.frequency
        return TorusState(
            parameter=curve.parameter * self.varied.unit,
            omega=user.omega,
            second=user.second,
            amplitude=user.amplitude(),
            exponents=member.exponents / duration,
            residual=self.family.equations.defect(curve),
            harmonics=curve.circle.harmonics,
            motion=user,
        )
