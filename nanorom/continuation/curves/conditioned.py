"""Families of periodic orbits that meet one phase condition, along a parameter of the system.

Beside the balance, one harmonic of one output has a given phase: of a free motion, because it is
free when time begins; of a phase-locked loop, because that is what the loop holds. Frequency and
parameter are unknown.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.curves.curve import Curve, Point
from nanorom.continuation.curves.orbits import Orbits, in_units
from nanorom.continuation.curves.parameter import Parameter
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.harmonics import Basis, Support, basis_for, full_support
from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array, Numbers

SLOWEST, FASTEST = 1e-2, 1e2  # times the frequency at the beginning, where a curve ends
EDGE = 1e-9  # of a scaled level at an end of a range
TRUNCATION = 1e-11  # of multipliers that tell stability


@brief
@attrs.frozen(eq=False, kw_only=True)
class OrbitCurve(Orbits):
    """A family of periodic orbits along a parameter, in the units of the system.

    parameter: its name; level (n,); omega (n,) of the drive, or of a free motion itself, rad per
    unit of time; amplitude (n, L) = max |q_r| over a period; multipliers (n, 2L), largest modulus
    first; stable (n,); turns (m,): numbers of the points at which the parameter turns back;
    coefficients: Fourier coefficients (2H + 1, L) of each orbit, as of a `Branch`; critical:
    numbers of the points at which a free motion doubles its period or becomes a torus, and "PD" or
    "NS".
    """

    multipliers: Numbers
    stable: Array
    critical: list[tuple[int, str]] = attrs.Factory(list)


@attrs.frozen(eq=False)
class Phase:
    """That harmonic `harmonic` (of the orbit) of the output `output` (L,) @ q lags by `lag` rad."""

    output: Array
    harmonic: int
    lag: float

    def weights(self, basis: Basis) -> Array:
        """Of the packed unknowns of a basis: their weighted sum vanishes."""
        full = np.zeros((2 * basis.harmonics + 1, len(self.output)))
        full[2 * self.harmonic - 1] = np.sin(self.lag) * self.output
        full[2 * self.harmonic] = -np.cos(self.lag) * self.output
        return basis.pack(basis.compress(full))


class PhasedBalance:
    """The balance and the phase for the unknowns z = (x, rate, level); both are linear in the
    arrays of the system origin + level * change.
    """

    def __init__(
        self, origin: ScaledSystem, change: ScaledSystem, basis: Basis, phase: Phase
    ) -> None:
        self.basis = basis
        self.balance = HarmonicBalance(origin, basis)
        self.by_level = HarmonicBalance(change, basis, inertia=False)
        self.weights = phase.weights(basis)

    def system(self, z: Array) -> tuple[Array, Array]:
        """Residual (n + 1,) and Jacobian (n + 1, n + 2)."""
        basis, n = self.basis, self.basis.size
        rate, level, x = float(z[n]), float(z[n + 1]), basis.unpack(z[:n])
        residual, by_level = (
            basis.pack(each.residual(x, rate)) for each in (self.balance, self.by_level)
        )
        jacobian = np.zeros((n + 1, n + 2))
        for weight, each in ((1.0, self.balance), (level, self.by_level)):
            jacobian[:n, :n] += weight * each.jacobian_t(x, rate).T
            jacobian[:n, n] += weight * basis.pack(each.rate_derivative(x, rate))
        jacobian[:n, n + 1] = by_level
        jacobian[n, :n] = self.weights
        return np.append(residual + level * by_level, self.weights @ z[:n]), jacobian

    def residual(self, z: Array) -> Array | None:
        """Not to be had for less than `system`."""
        return None

    def solve(self, matrix: Array, right: Array) -> Array:
        """The solution (n, k) for right sides (n, k)."""
        return np.asarray(np.linalg.solve(matrix, right))


@attrs.define(eq=False, kw_only=True)
class PhasedCurve(Curve):
    """Orbits of one phase along a parameter.

    phase : what they meet
    least : size, in scaled units, of orbits below which the curve ends
    """

    phase: Phase
    least: float = 0.0

    @classmethod
    def along(
        cls,
        line: Parameter,
        phase: Phase,
        rate: float,
        level: tuple[float, float],
        at: Sequence[float],
        tolerance: float,
        least: float = 0.0,
    ) -> PhasedCurve:
        """The curve of a parameter, with points at the ends of a range and at other levels; rate:
        of the orbits at its beginning.
        """
        return cls(
            origin=line.origin,
            change=line.change,
            multiple=1,
            limits=((SLOWEST * rate, FASTEST * rate), (level[0] / line.size, level[1] / line.size)),
            tolerance=tolerance,
            at=[value / line.size for value in (*level, *at)],
            phase=phase,
            least=least,
        )

    def equations(self, support: Support, harmonics: int) -> PhasedBalance:
        basis = basis_for(support, harmonics, self.multiple)
        return PhasedBalance(self.origin, self.change, basis, self.phase)

    def _inside(self, point: Point) -> bool:
        return super()._inside(point) and float(np.abs(point.full[1:]).max()) >= self.least


def orbit_curve(
    parameter: Parameter, points: Sequence[Point], multiple: int, free: bool
) -> OrbitCurve:
    """Points of a curve in the units of the system, with their multipliers; those of a `free`
    motion are stable beside the multiplier 1 along the motion itself.
    """
    multipliers = np.array(
        [multipliers_of(parameter.at(point.level), point, multiple) for point in points]
    )
    sizes = np.abs(multipliers)
    if free:
        along = np.abs(multipliers - 1).argmin(axis=1)
        sizes[np.arange(len(points)), along] = 0.0
    stable = sizes.max(axis=1) < 1
    found = in_units(parameter, points, multiple)
    critical = [(i, point.code) for i, point in enumerate(points) if point.code]
    return OrbitCurve(multipliers=multipliers, stable=stable, critical=critical, **found)


def within(points: Sequence[Point], level: tuple[float, float], size: float) -> list[Point]:
    """The points of a curve whose levels are in a range; scaled, they are 1 at `size`."""
    low, high = level[0] / size - EDGE, level[1] / size + EDGE
    return [point for point in points if low <= point.level <= high]


def multipliers_of(system: ScaledSystem, point: Point, multiple: int) -> Numbers:
    """All multipliers (2L,) of an orbit, largest modulus first."""
    solver = FloquetSolver(system, truncation=TRUNCATION)
    given = point.full[None], np.array([point.rate]), multiple, full_support(system, multiple)
    return np.asarray(solver.multipliers(*given)[0])
