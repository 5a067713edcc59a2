"""Curves of special points in two parameters: drive frequency and any parameter of the system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from nanorom.continuation.curves.critical_curve import CriticalCurve
from nanorom.continuation.curves.curve import Point
from nanorom.continuation.diagrams.diagram import SpecialPoint
from nanorom.continuation.orbits.bifurcations import KINDS, TORUS
from nanorom.continuation.orbits.conditions import REAL
from nanorom.continuation.orbits.coordinates import with_symmetries
from nanorom.continuation.orbits.orbit import PeriodicOrbit, orbit_amplitudes
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import check_range
from nanorom.continuation.system import TENSORS, ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

LEVELS = {"direct": ("direct",), "parametric": ("parametric",), "both": ("direct", "parametric")}


@attrs.frozen(eq=False)
class Locus:
    """A curve of special points of one type.

    omega (n,) in rad per unit of time; level (n,) of the parameter followed; amplitude (n, L) =
    max |q_r| over a period, in the units of the system; turns (m,): numbers of the points at which
    the parameter turns back (cusps, tips of tongues); coefficients: Fourier coefficients
    (2H + 1, L) of each orbit, as of a `Branch`.
    """

    type: str
    parameter: str
    omega: Array
    level: Array
    amplitude: Array
    turns: Numbers
    period_multiple: int
    coefficients: list[Array] = attrs.field(repr=False)

    def orbit(self, index: int) -> PeriodicOrbit:
        """The critical periodic orbit at one point of the curve."""
        return PeriodicOrbit(
            self.coefficients[index], float(self.omega[index]), self.period_multiple
        )


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
) -> Locus:
    """Follow a special point of `explore` in the plane of drive frequency and another parameter.

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
    steps : most steps on either side of the point
    largest_step : arc length, relative to the size of the orbit, the frequency and the level
    tolerance : size of the last harmonics, relative to the orbit
    at : levels at which there are to be points of the curve, in the unit of `level`

    Raises
    ------
    ContinuationError
        for an unknown parameter or a point that cannot be followed.
    """
    unit = with_symmetries(system.scaled(direct, parametric))
    low, high = (value / unit.frequency for value in check_range(omega))
    added, start = _parameter(system, parameter, {"direct": direct, "parametric": parametric})
    _check_level(level, start)
    size = start or max(abs(level[0]), abs(level[1]))  # of the parameter, the unit of its steps
    change = system.change(added, unit).times(size)
    least, most = sorted(value / size for value in level)
    limits = (low, high), (least, most)
    curve = CriticalCurve(
        origin=unit.plus(change, -start / size),
        change=change,
        kind=KINDS[point.type],
        multiple=point.period_multiple,
        limits=limits,
        tolerance=tolerance,
        at=[value / size for value in at],
    )
    first = _scaled(point, unit, start / size)
    forward = curve.follow(first, 1.0, steps, largest_step)
    backward = curve.follow(first, -1.0, steps, largest_step)
    name = parameter if isinstance(parameter, str) else ", ".join(parameter)
    return _result(point, name, backward[::-1] + forward[1:], unit, size)


def _check_level(level: tuple[float, float], start: float) -> None:
    if not level[0] <= start <= level[1] or not np.isfinite(level).all():
        raise ContinuationError(
            f"level: range ({level[0]:g}, {level[1]:g}) does not hold that of the point, {start:g}"
        )


def _scaled(point: SpecialPoint, unit: ScaledSystem, level: float) -> Point:
    """The point that a curve starts from."""
    rate = point.omega / unit.frequency / point.period_multiple
    return Point(unit.inner(point.coefficients), rate, level, _second_frequency(point))


def _result(
    point: SpecialPoint,
    parameter: str,
    points: list[Point],
    unit: ScaledSystem,
    size: float,
) -> Locus:
    """Points of a curve in the units of the system and of its parameter."""
    coefficients = [unit.given(p.full) for p in points]
    return Locus(
        type=point.type,
        parameter=parameter,
        omega=np.array([p.rate for p in points]) * point.period_multiple * unit.frequency,
        level=np.array([p.level for p in points]) * size,
        amplitude=np.array([orbit_amplitudes(c[None])[0] for c in coefficients]),
        turns=np.flatnonzero([p.turn for p in points]),
        period_multiple=point.period_multiple,
        coefficients=coefficients,
    )


def _second_frequency(point: SpecialPoint) -> tuple[float, ...]:
    """Of the torus that a Neimark-Sacker point sheds, by the rate of the orbit; none of others."""
    if KINDS[point.type] is not TORUS:
        return ()
    pairs = point.multipliers[point.multipliers.imag > REAL]
    critical = pairs[np.abs(np.abs(pairs) - 1).argmin()]
    return (float(np.angle(critical) / (2 * np.pi)),)


def _parameter(
    system: ModalSystem, parameter: str | Mapping[str, object], levels: dict[str, float]
) -> tuple[dict[str, object], float]:
    """Arrays of which the system has `level` times as much, and the level at the point."""
    if not isinstance(parameter, str):
        return dict(parameter), 0.0
    if parameter in LEVELS:
        system.check_proportional()
        used = [name for name in LEVELS[parameter] if levels[name]]
        if not used:
            raise ContinuationError(f"parameter: the level of {parameter!r} is zero at the point")
        if parameter == "both":
            return {name: levels[name] * system.arrays()[name] for name in used}, 1.0
        return {parameter: system.arrays()[parameter]}, levels[parameter]
    if parameter not in TENSORS:
        known = ", ".join((*LEVELS, *TENSORS))
        raise ContinuationError(f"parameter: {parameter!r}; choose one of {known}")
    if not getattr(system, parameter).any():
        raise ContinuationError(f"parameter: {parameter!r} is zero; give the array to be added")
    return {parameter: getattr(system, parameter)}, 1.0
