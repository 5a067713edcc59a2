"""Tori of modal systems by one call: from a Neimark-Sacker point on, in frequency or drive level."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from nanorom.errors import ContinuationError

from ..diagram import SpecialPoint
from ..explore import check_range
from ..harmonics import Support, close_support, symmetry_signs
from ..system import Array, ModalSystem, ScaledSystem, finite
from ..threads import one_thread
from .circle import HARMONICS
from .events import events
from .family import Family, Member
from .motion import QuasiPeriodic, motion
from .return_map import ReturnMap
from .torus import Torus, TorusPoint, TorusState

Level = float | tuple[float, float]


@one_thread()
def follow_torus(
    system: ModalSystem,
    point: SpecialPoint,
    omega: Level | None = None,
    direct: Level = 0.0,
    parametric: Level = 0.0,
    *,
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
    varied = _varied(system, point, omega, direct, parametric)
    _check_size("harmonics", harmonics, HARMONICS[0], HARMONICS[-1])
    _check_size("steps", steps, 1, 100_000)
    if not finite(tolerance) or not 1e-13 <= tolerance <= 1e-3:
        raise ContinuationError(f"tolerance: found {tolerance!r}; allowed 1e-13 to 1e-3")
    unit = varied.system
    map_ = ReturnMap(varied.equations, point.period_multiple, _signs(unit, point))
    family = Family(map_, tolerance, harmonics, steps)
    state = point.state / np.repeat([unit.amplitude, unit.amplitude * unit.frequency], unit.size)
    first = family.from_orbit(state, varied.start)
    members, found = [], []
    for member in family.follow(*first, varied.span):
        if members and member.step:
            found += events(family, members[-1], member)
        members.append(member)
        if progress is not None:
            progress(len(members), member.curve.parameter * varied.unit)
    report = _Report(varied, map_, family)
    return report.torus(members, [(event.type, event.member) for event in found])


@attrs.frozen(eq=False)
class _Varied:
    """Which parameter is varied: its name, unit (value at scaled parameter 1), span and start in
    that unit, and the equations at a scaled parameter.
    """

    name: str
    unit: float
    span: tuple[float, float]
    start: float
    system: ScaledSystem
    equations: Callable[[float], tuple[ScaledSystem, float]]


def _varied(
    system: ModalSystem, point: SpecialPoint, omega: Level | None, direct: Level, parametric: Level
) -> _Varied:
    given = {"omega": point.omega if omega is None else omega}
    given |= {"direct": direct, "parametric": parametric}
    ranges = [name for name, value in given.items() if np.ndim(value) == 1]
    if len(ranges) != 1:
        raise ContinuationError(
            f"omega, direct, parametric: found {len(ranges)} ranges (low, high); allowed exactly one"
        )
    name = ranges[0]
    fixed = {key: value for key, value in given.items() if key != name}
    for key, value in fixed.items():
        if not finite(value):
            raise ContinuationError(f"{key}: found {value!r}; allowed a finite number")
    low, high = check_range(given["omega"]) if name == "omega" else _level_range(name, given[name])
    scaled = system.scaled(fixed.get("direct", 0.0), fixed.get("parametric", 0.0))
    if name == "omega":
        unit, start = scaled.frequency, point.omega

        def equations(parameter: float) -> tuple[ScaledSystem, float]:
            return scaled, parameter
    else:
        unit = max(abs(low), abs(high))
        change = system.change({name: getattr(system, name)}, scaled).times(unit)
        rate = fixed["omega"] / scaled.frequency
        start = float("nan")

        def equations(parameter: float) -> tuple[ScaledSystem, float]:
            return scaled.plus(change, parameter), rate
    if name == "omega" and not low <= start <= high:
        raise ContinuationError(
            f"omega: range ({low:g}, {high:g}) does not hold the point at {start:.10g}"
        )
    return _Varied(name, unit, (low / unit, high / unit), start / unit, scaled, equations)


def _level_range(name: str, value: object) -> tuple[float, float]:
    low, high = (float(v) for v in np.asarray(value, dtype=float))
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ContinuationError(f"{name}: found ({low:g}, {high:g}); allowed a rising finite range")
    return low, high


def _check_size(name: str, value: object, low: int, high: int) -> None:
    if not finite(value) or not low <= value <= high:  # type: ignore[operator]
        raise ContinuationError(f"{name}: found {value!r}; allowed {low} to {high}")


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

    def __init__(self, varied: _Varied, map_: ReturnMap, family: Family) -> None:
        self.varied, self.map, self.family = varied, map_, family

    def torus(self, members: list[Member], found: list[tuple[str, Member]]) -> Torus:
        points = [TorusPoint(kind, self.state(member)) for kind, member in found]

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
