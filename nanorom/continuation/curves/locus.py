"""Curves of special points in two parameters: drive frequency and any parameter of the system.

The balance and the criticality of the orbit (`critical`) are followed by pseudo-arclength. Where
the parameter turns back along the curve there is a cusp of folds, or the tip of a tongue; these
points are located, too. Source: Detroux et al. 2015, doi:10.1016/j.cma.2015.07.017 (bifurcation
tracking with harmonic balance).
"""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.continuation.branches.march import STRAIGHT, March, StepControl
from nanorom.continuation.diagrams.diagram import SpecialPoint
from nanorom.continuation.orbits.bifurcations import KINDS, TORUS
from nanorom.continuation.orbits.conditions import REAL
from nanorom.continuation.orbits.coordinates import with_symmetries
from nanorom.continuation.orbits.harmonics import (
    HARMONIC_LADDER,
    Support,
    close_support,
    forced_support,
)
from nanorom.continuation.orbits.orbit import orbit_amplitudes
from nanorom.continuation.points.critical import CriticalBalance
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import check_range
from nanorom.continuation.system import TENSORS, ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

LEVELS = {"direct": ("direct",), "parametric": ("parametric",), "both": ("direct", "parametric")}
NEWTON = 1e-9  # of the unknowns: the last change of Newton's method
TAIL = 1e-9  # of the orbit: last harmonics beyond which there must be more
ABSENT = 1e-9  # coefficients of the orbit, relative to the largest, that are round-off
TURN = 1e-9  # of a step, to which a turn of the parameter is located
NEWTON_STEPS, EASY_STEPS = 8, 4
FIRST = 0.1  # of the largest step
LEAST_STEP = 1e-7  # arc length, in units of the unknowns
SHORT = 1e-5  # arc length below which the curve may turn as it likes: a cusp
LAST_ROWS = 4  # of the coefficients: cosine and sine of the last two harmonics


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
    unit = with_symmetries(system.scaled(direct, parametric))
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
        amplitude=np.array([orbit_amplitudes(unit.given(p.full)[None])[0] for p in points]),
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
            return {name: levels[name] * system.arrays()[name] for name in used}, 1.0
        return {parameter: system.arrays()[parameter]}, levels[parameter]
    if parameter not in TENSORS:
        known = ", ".join((*LEVELS, *TENSORS))
        raise ContinuationError(f"parameter: {parameter!r}; choose one of {known}")
    if not getattr(system, parameter).any():
        raise ContinuationError(f"parameter: {parameter!r} is zero; give the array to be added")
    return {parameter: getattr(system, parameter)}, 1.0


@attrs.frozen(eq=False)
class _Place:
    """A point of a curve in the unknowns z of a balance, and its tangent."""

    balance: CriticalBalance
    z: Array
    tangent: Array


@attrs.frozen(eq=False)
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
        self.origin, self.change, self.kind = origin, change, KINDS[point.type]
        self.multiple, self.limits = point.period_multiple, limits
        shift = 0.0
        if self.kind is TORUS:
            pairs = point.multipliers[point.multipliers.imag > REAL]
            critical = pairs[np.abs(np.abs(pairs) - 1).argmin()]
            shift = float(np.angle(critical) / (2 * np.pi))
        rate = point.omega / origin.frequency / point.period_multiple
        full = origin.inner(point.coefficients)
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
        balance = self._balance((len(self.start.full) - 1) // 2)
        z, tangent, _ = self._correct(balance, self._pack(balance, self.start), None)
        tangent *= sign * (1.0 if tangent[balance.basis.size + 1] >= 0 else -1.0)
        start = _Place(balance, z, tangent)
        points = [self._unpack(start)]
        control = StepControl(FIRST * largest, LEAST_STEP, largest, steps)
        for here, there in March(self._advance, start, control):
            points += self._turn(here, there)
            points.append(self._unpack(there))
            if not self._inside(points[-1]):
                break
        return points

    def _advance(self, here: _Place, length: float) -> tuple[_Place, bool]:
        here = self._adapt(here)
        z, tangent, steps = self._correct(
            here.balance, here.z + length * here.tangent, here.tangent
        )
        if tangent @ here.tangent < STRAIGHT and length > SHORT:
            raise ContinuationError("the curve of special points turns too fast for the step")
        return _Place(here.balance, z, tangent), steps <= EASY_STEPS

    def _turn(self, here: _Place, there: _Place) -> list[_Point]:
        """The point within a step at which the parameter turns back, if it does."""
        balance = there.balance
        before = here if here.balance is balance else self._moved(here, balance)
        level = balance.basis.size + 1
        if before.tangent[level] * there.tangent[level] >= 0:
            return []
        length = float((there.z - before.z) @ before.tangent)

        def point(a: float) -> _Place:
            z = before.z + a * before.tangent
            return _Place(balance, *self._correct(balance, z, before.tangent)[:2])

        try:
            a = brentq(lambda a: point(a).tangent[level], 0.0, length, xtol=TURN * length)
            turning = point(a)
        except (ContinuationError, ValueError):  # not to be had exactly: the nearer end
            turning = min(before, there, key=lambda place: abs(place.tangent[level]))
        return [attrs.evolve(self._unpack(turning), turn=True)]

    def _inside(self, point: _Point) -> bool:
        (low, high), (least, most) = self.limits
        return low <= point.rate * self.multiple <= high and least <= point.level <= most

    def _balance(self, harmonics: int) -> CriticalBalance:
        known = [h for h in HARMONIC_LADDER if h >= harmonics]
        h = known[0] if known else HARMONIC_LADDER[-1]
        return CriticalBalance(self.origin, self.change, self.support, self.kind, self.multiple, h)

    def _adapt(self, here: _Place) -> _Place:
        """More harmonics where the last ones are not small."""
        sizes = np.abs(self._unpack(here).full).max(axis=1)
        harmonics = here.balance.basis.harmonics
        if sizes[-LAST_ROWS:].max() <= TAIL * sizes.max() or harmonics >= HARMONIC_LADDER[-1]:
            return here
        return self._moved(here, self._balance(harmonics + 1))

    def _moved(self, here: _Place, larger: CriticalBalance) -> _Place:
        """A place with its tangent on another number of harmonics."""
        basis, n = here.balance.basis, here.balance.basis.size
        step = basis.expand(basis.unpack(here.tangent[:n]), self.origin.size)
        moved = larger.basis.pack(larger.basis.compress(step))
        tangent = np.concatenate([moved, here.tangent[n:]])
        return _Place(larger, self._pack(larger, self._unpack(here)), tangent)

    def _pack(self, balance: CriticalBalance, point: _Point) -> Array:
        x = balance.basis.pack(balance.basis.compress(point.full))
        extra = [point.rate, point.level] + ([point.shift] if self.kind is TORUS else [])
        return np.concatenate([x, extra])

    def _unpack(self, place: _Place) -> _Point:
        basis, z, n = place.balance.basis, place.z, place.balance.basis.size
        full = basis.expand(basis.unpack(z[:n]), self.origin.size)
        shift = float(z[n + 2]) if len(z) > n + 2 else 0.0
        return _Point(full, float(z[n]), float(z[n + 1]), shift)

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
            except np.linalg.LinAlgError:
                break  # and raise, as where the corrections do not shrink
            z = z + change
            if not np.all(np.isfinite(z)) or z[balance.basis.size] <= 0:
                break
            if np.abs(change).max() < NEWTON * max(1.0, np.abs(z).max()):
                return z, direction / np.linalg.norm(direction), step + 1
        raise ContinuationError("the curve of special points cannot be corrected")
