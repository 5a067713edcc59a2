"""Curves of special points in two parameters: drive frequency and any parameter of the system.

The balance and the criticality of the orbit (`critical`) are followed by pseudo-arclength. Where
the parameter turns back along the curve there is a cusp of folds, or the tip of a tongue; these
points are located, too. Source: Detroux et al. 2015, doi:10.1016/j.cma.2015.07.017 (bifurcation
tracking with harmonic balance).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.continuation.diagrams.diagram import SpecialPoint
from nanorom.continuation.orbits.harmonics import (
    HARMONIC_LADDER,
    Support,
    close_support,
    forced_support,
)
from nanorom.continuation.orbits.orbit import orbit_amplitudes
from nanorom.continuation.points.critical import CriticalBalance
from nanorom.continuation.settings import check_range
from nanorom.continuation.system import TENSORS, ModalSystem, ScaledSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

LEVELS = {"direct": ("direct",), "parametric": ("parametric",), "both": ("direct", "parametric")}
NEWTON = 1e-9
TAIL = 1e-9
ABSENT = 1e-9  # coefficients of the orbit, relative to the largest, that are round-off
TURN = 1e-9  # of a step, to which a turn of the parameter is located


@attrs.frozen(eq=False)
class Locus:
    """A curve of special points of one type.

    omega (n,); level (n,) of the parameter followed; amplitude (n, L) = max |q_r| over a period;
    turns (m,): numbers of the points at which the parameter turns back (cusps, tips of tongues).
    """

    type: str
    parameter: str
    omega: Array
    level: Array
    amplitude: Array
    turns: Numbers


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
) -> Locus:
    """Follow a special point of `explore` in the plane of drive frequency and another parameter.

    Parameters
    ----------
    system : ModalSystem
    point : SpecialPoint found at the levels `direct` and `parametric`
    omega, level : (low, high), where to stop
    parameter : "direct" or "parametric", the level that varies; "both", a factor on both;
        "damping", "stiffness", "quadratic", "cubic" or "cubic_damping", a factor on that array;
        or arrays by name, {"cubic": dB, "damping": dC}, that are added `level` times, from 0 at the
        point: any coefficient, any combination
    steps : most steps on either side of the point
    largest_step : arc length, relative to the size of the orbit, the frequency and the level

    Raises
    ------
    ContinuationError
        for an unknown parameter or a point that cannot be followed.
    """
    unit = system.scaled(direct, parametric)
    low, high = (value / unit.frequency for value in check_range(omega))
    added, start = _parameter(system, parameter, {"direct": direct, "parametric": parametric})
    if not level[0] <= start <= level[1] or not np.isfinite(level).all():
        raise ContinuationError(
            f"level: range ({level[0]:g}, {level[1]:g}) does not hold that of the point, {start:g}"
        )
    size = start or max(abs(level[0]), abs(level[1]))  # of the parameter, the unit of its steps
    change = system.change(added, unit).times(size)
    least, most = sorted(value / size for value in level)
    limits = (low, high), (least, most)
    curve = _Curve(unit.plus(change, -start / size), change, point, limits, start / size)
    forward = curve.follow(1.0, steps, largest_step)
    backward = curve.follow(-1.0, steps, largest_step)
    points = backward[::-1] + forward[1:]
    return Locus(
        type=point.type,
        parameter=parameter if isinstance(parameter, str) else ", ".join(parameter),
        omega=np.array([p.rate for p in points]) * point.period_multiple * unit.frequency,
        level=np.array([p.level for p in points]) * size,
        amplitude=np.array([orbit_amplitudes(p.full[None])[0] for p in points]) * unit.amplitude,
        turns=np.flatnonzero([p.turn for p in points]),
    )


def _parameter(
    system: ModalSystem, parameter: str | Mapping[str, object], levels: dict[str, float]
) -> tuple[dict[str, object], float]:
    """Arrays of which the system has `level` times as much, and the level at the point."""
    if not isinstance(parameter, str):
        return dict(parameter), 0.0
    if parameter in LEVELS:
        used = [name for name in LEVELS[parameter] if levels[name]]
        if not used:
            raise ContinuationError(f"parameter: the level of {parameter!r} is zero at the point")
        if parameter == "both":
            return {name: levels[name] * getattr(system, name) for name in used}, 1.0
        return {parameter: getattr(system, parameter)}, levels[parameter]
    if parameter not in TENSORS:
        known = ", ".join((*LEVELS, *TENSORS))
        raise ContinuationError(f"parameter: {parameter!r}; choose one of {known}")
    if not getattr(system, parameter).any():
        raise ContinuationError(f"parameter: {parameter!r} is zero; give the array to be added")
    return {parameter: getattr(system, parameter)}, 1.0


@dataclass(frozen=True, eq=False)
class _Point:
    """Coefficients of all modes, rate, level, second frequency (NS)."""

    full: Array
    rate: float
    level: float
    shift: float = 0.0
    turn: bool = False


class _Curve:
    """Pseudo-arclength continuation of balance and criticality."""

    def __init__(
        self,
        origin: ScaledSystem,
        change: ScaledSystem,
        point: SpecialPoint,
        limits: tuple[tuple[float, float], tuple[float, float]],
        level: float,
    ) -> None:
        self.origin, self.change, self.kind = origin, change, point.type
        self.multiple, self.limits = point.period_multiple, limits
        shift = 0.0
        if point.type == "NS":
            pairs = point.multipliers[point.multipliers.imag > 1e-9]
            critical = pairs[np.abs(np.abs(pairs) - 1).argmin()]
            shift = float(np.angle(critical) / (2 * np.pi))
        rate = point.omega / origin.frequency / point.period_multiple
        full = point.coefficients / origin.amplitude
        self.start = _Point(full, rate, level, shift)
        self.support = self._support(full)

    def _support(self, full: Array) -> Support:
        """Modes and harmonics of the orbit and of what the parameter adds to them."""
        everything = self.origin.pattern().plus(self.change.pattern(), 1.0)
        table = forced_support(everything, self.multiple).table.copy()
        present = np.abs(full) > ABSENT * np.abs(full).max(initial=0.0)
        numbers = (np.arange(len(full)) + 1) // 2 % table.shape[1]
        np.logical_or.at(table.T, numbers, present)
        return close_support(everything, Support(table))

    def follow(self, sign: float, steps: int, largest: float) -> list[_Point]:
        """Points from the start in one direction."""
        point, length, points = self.start, largest / 10, []
        balance = self._balance((len(point.full) - 1) // 2)
        z, tangent = self._correct(balance, self._pack(balance, point), None)
        tangent *= sign * (1.0 if tangent[balance.basis.size + 1] >= 0 else -1.0)
        points.append(self._unpack(balance, z))
        while len(points) <= steps:
            try:
                new, direction = self._correct(balance, z + length * tangent, tangent)
            except ContinuationError:
                length /= 3
                if length < 1e-7:
                    break
                continue
            if direction @ tangent < 0.9 and length > 1e-5:
                length /= 2
                continue
            turns = tangent[balance.basis.size + 1] * direction[balance.basis.size + 1] < 0
            points += self._turn(balance, z, tangent, length) if turns else []
            z, tangent = new, direction
            point = self._unpack(balance, z)
            points.append(point)
            if not self._inside(point):
                break
            length = min(1.4 * length, largest)
            balance, z, tangent = self._adapt(balance, point, z, tangent)
        return points

    def _turn(
        self, balance: CriticalBalance, z: Array, tangent: Array, length: float
    ) -> list[_Point]:
        """The point within a step at which the parameter turns back."""

        def point(a: float) -> tuple[Array, Array]:
            return self._correct(balance, z + a * tangent, tangent)

        try:
            a = brentq(
                lambda a: point(a)[1][balance.basis.size + 1], 0.0, length, xtol=TURN * length
            )
            return [replace(self._unpack(balance, point(a)[0]), turn=True)]
        except (ContinuationError, ValueError):
            return []

    def _inside(self, point: _Point) -> bool:
        (low, high), (least, most) = self.limits
        return low <= point.rate * self.multiple <= high and least <= point.level <= most

    def _balance(self, harmonics: int) -> CriticalBalance:
        known = [h for h in HARMONIC_LADDER if h >= harmonics]
        h = known[0] if known else HARMONIC_LADDER[-1]
        return CriticalBalance(self.origin, self.change, self.support, self.kind, self.multiple, h)

    def _adapt(
        self, balance: CriticalBalance, point: _Point, z: Array, tangent: Array
    ) -> tuple[CriticalBalance, Array, Array]:
        """More harmonics where the last ones are not small."""
        sizes = np.abs(point.full).max(axis=1)
        if sizes[-4:].max() <= TAIL * sizes.max() or balance.basis.harmonics >= HARMONIC_LADDER[-1]:
            return balance, z, tangent
        larger = self._balance(balance.basis.harmonics + 1)
        n, size = balance.basis.size, self.origin.size
        step = balance.basis.expand(balance.basis.unpack(tangent[:n]), size)
        moved = larger.basis.pack(larger.basis.compress(step))
        return larger, self._pack(larger, point), np.concatenate([moved, tangent[n:]])

    def _pack(self, balance: CriticalBalance, point: _Point) -> Array:
        x = balance.basis.pack(balance.basis.compress(point.full))
        extra = [point.rate, point.level] + ([point.shift] if self.kind == "NS" else [])
        return np.concatenate([x, extra])

    def _unpack(self, balance: CriticalBalance, z: Array) -> _Point:
        n = balance.basis.size
        full = balance.basis.expand(balance.basis.unpack(z[:n]), self.origin.size)
        return _Point(
            full, float(z[n]), float(z[n + 1]), float(z[n + 2]) if len(z) > n + 2 else 0.0
        )

    def _correct(
        self, balance: CriticalBalance, z: Array, tangent: Array | None
    ) -> tuple[Array, Array]:
        """Newton's method, orthogonal to the tangent (to the level's axis at first), and the new
        tangent.
        """
        border = np.zeros(len(z)) if tangent is None else tangent
        if tangent is None:
            border[balance.basis.size + 1] = 1.0
        right = np.zeros((len(z), 2))  # for the change, and for the tangent
        right[-1, 1] = 1.0
        for _ in range(8):
            residual, jacobian = balance.system(z)
            right[:-1, 0] = -residual
            try:
                change, direction = np.linalg.solve(np.vstack([jacobian, border]), right).T
            except np.linalg.LinAlgError:
                break
            z = z + change
            if not np.all(np.isfinite(z)) or z[balance.basis.size] <= 0:
                break
            if np.abs(change).max() < NEWTON * max(1.0, np.abs(z).max()):
                return z, direction / np.linalg.norm(direction)
        raise ContinuationError("the curve of special points cannot be corrected")
