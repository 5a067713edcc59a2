"""Curves of special points in two parameters: drive frequency and any parameter of the system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.curves.codimension_two import NAMES
from nanorom.continuation.curves.conditioned import multipliers_of
from nanorom.continuation.curves.critical_curve import CriticalCurve
from nanorom.continuation.curves.curve import Point
from nanorom.continuation.curves.orbits import Orbits, in_units
from nanorom.continuation.curves.parameter import Parameter, through
from nanorom.continuation.diagrams.diagram import SpecialPoint
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import check_range
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers


@attrs.frozen(eq=False)
class DoublePoint:
    """A bifurcation of codimension two on a curve of special points.

    type: "R1", "R2", "R3", "R4" (strong resonances), "LPPD", "LPNS", "PDNS", "NSNS" (two at once),
    "GPD" (generalised period doubling); index: number of the point of the curve; omega in rad per
    unit of time; level of the parameter; amplitude (L,) = max |q_r|, in the units of the system;
    multipliers (2L,), largest modulus first.
    """

    type: str
    index: int
    omega: float
    level: float
    amplitude: Array
    multipliers: Numbers

    @property
    def name(self) -> str:
        """What it is called."""
        return NAMES[self.type]


@brief
@attrs.frozen(eq=False, kw_only=True)
class Locus(Orbits):
    """A curve of special points of one type, along a parameter; turns are cusps or tips of tongues.

    omega (n,) in rad per unit of time; level (n,) of the parameter followed; amplitude (n, L) =
    max |q_r| over a period, in the units of the system; turns (m,): numbers of the points at which
    the parameter turns back; coefficients: Fourier coefficients (2H + 1, L) of each orbit, as of a
    `Branch`; codimension_two: what is met on the way, in order.
    """

    type: str
    codimension_two: list[DoublePoint] = attrs.Factory(list)


@one_thread()
def locus(
    system: ModalSystem,
    point: SpecialPoint,
    direct: float,
    parametric: float,
    *,
    omega: tuple[float, float],
    level: tuple[float, float],
    parameter: str | Mapping[str, object] = "direct",
    steps: int = 200,
    largest_step: float = 0.1,
    tolerance: float = 1e-9,
    at: Sequence[float] = (),
    turns: bool = True,
    codimension_two: bool = True,
) -> Locus:
    """Follow a special point of `explore` in the plane of frequency and another parameter.

    Parameters
    ----------
    system : ModalSystem
    point : SpecialPoint found at the levels `direct` and `parametric`
    direct, parametric : levels of the point, in units of the patterns
    omega, level : (low, high), where to stop, in rad per unit of time of the system, and in the
        unit of the parameter (1 for a factor)
    parameter : "direct" or "parametric", the level that varies; "both", a factor on both;
        "damping", "stiffness", "quadratic", "cubic" or "cubic_damping", a factor on that array;
        or arrays by name, {"cubic": dB, "damping": dC}, that are added `level` times, from 0 at the
        point: any coefficient, any combination
    steps, largest_step : most steps on either side of the point; their arc length, relative to the
        size of the orbit, the frequency and the level
    tolerance : size of the last harmonics, relative to the orbit
    at : levels at which there are to be points of the curve, in the unit of `level`
    turns : whether to locate where the level turns back; a curve without is had for a third
    codimension_two : whether to look for what is met on the way, by multipliers of every orbit

    Raises
    ------
    ContinuationError : for an unknown parameter or a point that cannot be followed
    """
    given = {"direct": direct, "parametric": parametric}
    line, start = through(system, parameter, given, _size(parameter, level))
    unit = line.unit
    low, high = (value / unit.frequency for value in check_range(omega))
    _check_level(level, start)
    least, most = sorted(value / line.size for value in level)
    curve = CriticalCurve(
        origin=line.origin,
        change=line.change,
        kind=KINDS[point.type],
        double=codimension_two,
        multiple=point.period_multiple,
        limits=((low, high), (least, most)),
        tolerance=tolerance,
        at=[value / line.size for value in at],
        turning=turns,
    )
    first = _scaled(point, unit, start / line.size)
    one, other = (curve.follow(first, sign, steps, largest_step) for sign in (1.0, -1.0))
    return _result(point, line, other[::-1] + one[1:])


def _size(parameter: str | Mapping[str, object], level: tuple[float, float]) -> float:
    """The largest multiple of arrays that are added, from 0 at the point; 0 of other parameters."""
    if isinstance(parameter, str):
        return 0.0
    _check_level(level, 0.0)
    return max(abs(level[0]), abs(level[1]))


def _check_level(level: tuple[float, float], start: float) -> None:
    if not level[0] <= start <= level[1] or not np.isfinite(level).all():
        raise ContinuationError(
            f"level: range ({level[0]:g}, {level[1]:g}) does not hold that of the point, {start:g}"
        )


def _scaled(point: SpecialPoint, unit: ScaledSystem, level: float) -> Point:
    """The point that a curve starts from."""
    rate = point.omega / unit.frequency / point.period_multiple
    more = KINDS[point.type].condition.second_frequency(point.multipliers)
    return Point(unit.inner(point.coefficients), rate, level, more)


def _result(point: SpecialPoint, line: Parameter, points: list[Point]) -> Locus:
    """Points of a curve in the units of the system and of its parameter."""
    multiple = point.period_multiple
    given = in_units(line, points, multiple)
    double = [
        DoublePoint(
            found.code,
            index,
            float(given["omega"][index]),
            float(given["level"][index]),
            given["amplitude"][index],
            multipliers_of(line.at(found.level), found, multiple),
        )
        for index, found in enumerate(points)
        if found.code
    ]
    return Locus(type=point.type, codimension_two=double, **given)
