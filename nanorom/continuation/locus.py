"""Curves of special points in two parameters: drive frequency and drive level.

An orbit is a fold (LP), a period doubling (PD), a symmetry breaking (BP) or a torus bifurcation
(NS) where an operator A becomes singular: the Jacobian of the balance on the harmonics of the
orbit, on those it does not contain, or shifted by the second frequency. A bordered system turns
that into one smooth scalar, (A b; c' 0)(v; g) = (0; 1), g = 0, whose gradient needs no second solve
than that of the transpose. The balance and g = 0 are followed by pseudo-arclength. Sources:
Govaerts 2000, doi:10.1137/1.9780898719543 (minimally extended systems); Detroux et al. 2015,
doi:10.1016/j.cma.2015.07.017 (bifurcation tracking with harmonic balance).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import attrs
import numpy as np

from nanorom.errors import ContinuationError

from .balance import HarmonicBalance
from .diagram import SpecialPoint
from .explore import check_range
from .harmonics import (
    HARMONIC_LADDER,
    Basis,
    Support,
    basis_for,
    forced_support,
    full_support,
)
from .path import orbit_amplitudes
from .system import Array, ModalSystem, ScaledSystem
from .threads import one_thread

PARAMETERS = ("direct", "parametric", "both")
NEWTON = 1e-9
TAIL = 1e-9


@attrs.frozen(eq=False)
class Locus:
    """A curve of special points of one type.

    omega (n,); level (n,) of the parameter followed; amplitude (n, L) = max |q_r| over a period.
    """

    type: str
    parameter: str
    omega: Array
    level: Array
    amplitude: Array


@one_thread()
def locus(
    system: ModalSystem,
    point: SpecialPoint,
    direct: float,
    parametric: float,
    *,
    omega: tuple[float, float],
    level: tuple[float, float],
    parameter: str = "direct",
    steps: int = 200,
    largest_step: float = 0.1,
) -> Locus:
    """Follow a special point of `explore` in the plane of drive frequency and a drive level.

    Parameters
    ----------
    system : ModalSystem
    point : SpecialPoint found at the levels `direct` and `parametric`
    omega, level : (low, high), where to stop
    parameter : "direct" or "parametric", the level that varies; "both": a factor on both
    steps : most steps on either side of the point
    largest_step : arc length, relative to the size of the orbit, the frequency and the level

    Raises
    ------
    ContinuationError
        for an unknown parameter or a point that cannot be followed.
    """
    if parameter not in PARAMETERS:
        raise ContinuationError(f"parameter: {parameter!r}; choose one of {', '.join(PARAMETERS)}")
    start_level = {"direct": direct, "parametric": parametric, "both": 1.0}[parameter]
    if start_level == 0:
        raise ContinuationError(f"parameter: the level of {parameter!r} is zero at the point")
    unit = system.scaled(direct, parametric)
    low, high = (value / unit.frequency for value in check_range(omega))
    if not level[0] <= start_level <= level[1]:
        raise ContinuationError(
            f"level: range ({level[0]:g}, {level[1]:g}) does not hold that of the point, "
            f"{start_level:g}"
        )
    limits = (low, high), (level[0] / start_level, level[1] / start_level)
    curve = _Curve(unit, parameter, point, limits)
    forward = curve.follow(1.0, steps, largest_step)
    backward = curve.follow(-1.0, steps, largest_step)
    points = backward[::-1] + forward[1:]
    return Locus(
        type=point.type,
        parameter=parameter,
        omega=np.array([p.rate for p in points]) * point.period_multiple * unit.frequency,
        level=np.array([p.level for p in points]) * start_level,
        amplitude=np.array([orbit_amplitudes(p.full[None])[0] for p in points]) * unit.amplitude,
    )


@dataclass(frozen=True, eq=False)
class _Point:
    """Coefficients of all modes, rate, level (1 at the start), second frequency (NS)."""

    full: Array
    rate: float
    level: float
    shift: float = 0.0


class _Balance:
    """The balance with the drive level as an unknown, and the critical operator beside it."""

    def __init__(
        self, unit: ScaledSystem, parameter: str, kind: str, multiple: int, h: int
    ) -> None:
        self.unit, self.parameter, self.kind = unit, parameter, kind
        support = (
            forced_support(unit, 1).stretch(multiple) if multiple > 1 else forced_support(unit)
        )
        if multiple > 1 or kind == "full":
            support = full_support(unit, multiple)
        self.support = support
        self.basis = basis_for(support, h, multiple)
        factor = 2 if kind == "PD" else 1
        self.factor = factor
        inherited = support.stretch(factor)
        if kind == "LP":
            self.wide = self.basis
            self.chosen = np.arange(self.basis.size)
        else:
            self.wide = basis_for(
                full_support(unit, multiple * factor), h * factor, multiple * factor
            )
            inside = inherited.rows_mask(h * factor).ravel()
            self.chosen = np.arange(self.wide.size) if kind == "NS" else np.flatnonzero(~inside)
        self.to_wide = self._embedding(inherited)

    def _embedding(self, inherited: Support) -> Array:
        """Positions in the flattened wide grid of the orbit's unknowns."""
        if self.wide is self.basis:
            return np.arange(self.basis.size)
        size = self.unit.size
        rows = np.where(self.basis.rows == 0, 0, (self.basis.rows - 1) % 2 + 1)
        rows = np.where(self.basis.rows == 0, 0, 2 * self.factor * self.basis.number - 2 + rows)
        grid = rows[:, None] * size + self.basis.modes[None, :]
        flat = grid.ravel()
        return flat if self.basis.unknowns is None else flat[self.basis.unknowns]

    def at(self, basis: Basis, level: float) -> HarmonicBalance:
        force = self.unit.force * (1.0 if self.parameter == "parametric" else level)
        parametric = self.unit.parametric * (1.0 if self.parameter == "direct" else level)
        return HarmonicBalance(replace(self.unit, force=force, parametric=parametric), basis)

    def level_derivative(self, x: Array) -> Array:
        """d residual / d level on the unknowns."""
        balance = self.at(self.basis, 1.0)
        result = np.zeros(self.basis.shape)
        if self.parameter != "parametric":
            result -= balance.force
        if self.parameter != "direct" and balance.has_parametric:
            v = self.basis.synthesis @ x
            g = balance.parametric.reshape(-1, balance.size, balance.size)
            result += self.basis.analysis @ np.matmul(v[:, None, :], g)[:, 0, :]
        return self.basis.pack(result)


class _Curve:
    """Pseudo-arclength continuation of balance and criticality."""

    def __init__(
        self,
        unit: ScaledSystem,
        parameter: str,
        point: SpecialPoint,
        limits: tuple[tuple[float, float], tuple[float, float]],
    ) -> None:
        self.unit, self.parameter, self.kind = unit, parameter, point.type
        self.multiple, self.limits = point.period_multiple, limits
        shift = 0.0
        if point.type == "NS":
            pairs = point.multipliers[point.multipliers.imag > 1e-9]
            critical = pairs[np.abs(np.abs(pairs) - 1).argmin()]
            shift = float(np.angle(critical) / (2 * np.pi))
        rate = point.omega / unit.frequency / point.period_multiple
        full = point.coefficients / unit.amplitude
        self.start = _Point(full, rate, 1.0, shift)
        self.border: tuple[Array, Array] | None = None

    def follow(self, sign: float, steps: int, largest: float) -> list[_Point]:
        """Points from the start in one direction."""
        point, tangent = self.start, None
        length, points = largest / 10, []
        self.border = None
        balance = self._balance((len(point.full) - 1) // 2)
        z = self._pack(balance, point)
        z, tangent = self._correct(balance, z, None)
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
            z, tangent = new, direction
            point = self._unpack(balance, z)
            points.append(point)
            if not self._inside(point):
                break
            length = min(1.4 * length, largest)
            balance, z, tangent = self._adapt(balance, point, z, tangent)
        return points

    def _inside(self, point: _Point) -> bool:
        (low, high), (least, most) = self.limits
        return low <= point.rate * self.multiple <= high and least <= point.level <= most

    def _balance(self, harmonics: int) -> _Balance:
        known = [h for h in HARMONIC_LADDER if h >= harmonics]
        h = known[0] if known else HARMONIC_LADDER[-1]
        return _Balance(self.unit, self.parameter, self.kind, self.multiple, h)

    def _adapt(
        self, balance: _Balance, point: _Point, z: Array, tangent: Array
    ) -> tuple[_Balance, Array, Array]:
        """More harmonics where the last ones are not small."""
        sizes = np.abs(point.full).max(axis=1)
        if sizes[-4:].max() <= TAIL * sizes.max():
            return balance, z, tangent
        larger = self._balance(balance.basis.harmonics + 1)
        n = balance.basis.size
        step = balance.basis.expand(balance.basis.unpack(tangent[:n]), self.unit.size)
        moved = larger.basis.pack(larger.basis.compress(step))
        self.border = None
        return larger, self._pack(larger, point), np.concatenate([moved, tangent[n:]])

    def _pack(self, balance: _Balance, point: _Point) -> Array:
        x = balance.basis.pack(balance.basis.compress(point.full))
        extra = [point.rate, point.level] + ([point.shift] if self.kind == "NS" else [])
        return np.concatenate([x, extra])

    def _unpack(self, balance: _Balance, z: Array) -> _Point:
        n = balance.basis.size
        full = balance.basis.expand(balance.basis.unpack(z[:n]), self.unit.size)
        return _Point(
            full, float(z[n]), float(z[n + 1]), float(z[n + 2]) if len(z) > n + 2 else 0.0
        )

    def _correct(self, balance: _Balance, z: Array, tangent: Array | None) -> tuple[Array, Array]:
        """Newton's method, orthogonal to the tangent (to the level's axis at first), and the new
        tangent.
        """
        border = np.zeros(len(z)) if tangent is None else tangent
        if tangent is None:
            border[balance.basis.size + 1] = 1.0
        for _ in range(8):
            residual, jacobian = self._system(balance, z)
            matrix = np.vstack([jacobian, border])
            change = np.linalg.solve(matrix, np.append(-residual, 0.0))
            z = z + change
            if not np.all(np.isfinite(z)) or z[balance.basis.size] <= 0:
                break
            if np.abs(change).max() < NEWTON * max(1.0, np.abs(z).max()):
                unit = np.zeros(len(z))
                unit[-1] = 1.0
                direction = np.linalg.solve(matrix, unit)
                return z, direction / np.linalg.norm(direction)
        raise ContinuationError("the curve of special points cannot be corrected")

    def _system(self, balance: _Balance, z: Array) -> tuple[Array, Array]:
        """Residual and Jacobian of balance and criticality."""
        basis, n = balance.basis, balance.basis.size
        rate, level = float(z[n]), float(z[n + 1])
        x = basis.unpack(z[:n])
        orbit = balance.at(basis, level)
        jacobian = np.zeros((len(z) - 1, len(z)))
        jacobian[:n, :n] = orbit.jacobian_t(x, rate).T
        jacobian[:n, n] = basis.pack(orbit.rate_derivative(x, rate))
        jacobian[:n, n + 1] = balance.level_derivative(x)
        value, gradient = self._criticality(balance, z)
        rows = slice(n, len(z) - 1)
        jacobian[rows] = gradient
        return np.concatenate([basis.pack(orbit.residual(x, rate)), value]), jacobian

    def _criticality(self, balance: _Balance, z: Array) -> tuple[Array, Array]:
        """g (real and imaginary part for NS) and its gradient."""
        n, wide = balance.basis.size, balance.wide
        rate, level = float(z[n]) / balance.factor, float(z[n + 1])
        flat = np.zeros(wide.shape[0] * wide.shape[1])
        if wide is balance.basis:
            x = wide.unpack(z[:n])
        else:
            flat[balance.to_wide] = z[:n]
            x = flat.reshape(wide.shape)
        operator = balance.at(wide, level)
        matrix = operator.jacobian_t(x, rate).T
        if wide.unknowns is None:
            matrix = matrix[np.ix_(balance.chosen, balance.chosen)]
        shift = float(z[n + 2]) if self.kind == "NS" else 0.0
        if self.kind == "NS":
            matrix = matrix + self._shifted(operator, x, rate, shift)
        v, w, g = self._null_vectors(matrix)
        left, right = self._spread(balance, w), self._spread(balance, v)
        gradient = np.zeros(len(z), dtype=complex)
        grid = self._second_derivative(operator, x, left, right)
        if operator.has_loss:
            grid = grid + self._loss_derivative(operator, x, rate, shift, left, right)
        packed = wide.pack(grid) if wide is balance.basis else grid.ravel()[balance.to_wide]
        gradient[:n] = -packed
        second, first = wide.second_weight * right, operator.derivative(right)
        # the rate multiplies d/dtheta, which for NS is d/dtheta + i shift
        turned = first + 1j * shift * right
        slope = 2 * rate * (second + 2j * shift * first - shift**2 * right)
        slope = slope + turned @ operator.damping_t
        gradient[n] = -(left * slope).sum() / balance.factor
        if operator.has_loss:
            gradient[n] -= self._loss_term(operator, x, left, right, turned) / balance.factor
        gradient[n + 1] = -self._level_term(balance, operator, level, left, right)
        if self.kind != "NS":
            return np.array([g.real]), gradient.real[None]
        by_shift = rate**2 * (2j * first - 2 * shift * right)
        by_shift = by_shift + 1j * rate * (right @ operator.damping_t)
        gradient[n + 2] = -(left * by_shift).sum()
        if operator.has_loss:
            by_loss = self._loss_term(operator, x, left, 0 * right, right)
            gradient[n + 2] -= 1j * rate * by_loss
        return np.array([g.real, g.imag]), np.stack([gradient.real, gradient.imag])

    def _null_vectors(self, matrix: Array) -> tuple[Array, Array, complex]:
        """Right and left vectors and g of the bordered operator; the borders follow the vectors."""
        size = len(matrix)
        if self.border is None or len(self.border[0]) != size:
            u, _, vh = np.linalg.svd(matrix)
            self.border = u[:, -1].copy(), vh[-1].conj().copy()
        b, c = self.border
        bordered = np.zeros((size + 1, size + 1), dtype=matrix.dtype)
        bordered[:size, :size] = matrix
        bordered[:size, size] = b
        bordered[size, :size] = c.conj()
        unit = np.zeros(size + 1)
        unit[-1] = 1.0
        right = np.linalg.solve(bordered, unit)
        left = np.linalg.solve(bordered.T, unit)
        return right[:size], left[:size], complex(right[size])

    def _spread(self, balance: _Balance, vector: Array) -> Array:
        """A vector on the chosen unknowns as a coefficient grid."""
        wide = balance.wide
        flat = np.zeros(wide.shape[0] * wide.shape[1], dtype=vector.dtype)
        if wide.unknowns is None:
            flat[balance.chosen] = vector
        else:
            flat[wide.unknowns] = vector
        return flat.reshape(wide.shape)

    def _second_derivative(
        self, operator: HarmonicBalance, x: Array, left: Array, right: Array
    ) -> Array:
        """w' (d Jacobian / dX) v as a coefficient grid."""
        basis, size = operator.basis, operator.size
        q, r = basis.synthesis @ x, basis.synthesis @ right
        weights = basis.analysis.T @ left
        first, second = operator.pairs
        pairs = (q[:, first] * r[:, second] + q[:, second] * r[:, first]) / 2
        tensor = 6.0 * (pairs @ operator.cubic)
        if operator.has_quadratic:
            tensor = tensor + 2.0 * (r @ operator.quadratic)
        samples = np.matmul(tensor.reshape(-1, size, size), weights[:, :, None])[:, :, 0]
        return np.asarray(basis.synthesis.T @ samples)

    def _level_term(
        self,
        balance: _Balance,
        operator: HarmonicBalance,
        level: float,
        left: Array,
        right: Array,
    ) -> complex:
        if balance.parameter == "direct" or not operator.has_parametric:
            return 0.0
        basis, size = operator.basis, operator.size
        r, weights = basis.synthesis @ right, basis.analysis.T @ left
        matrices = operator.parametric.reshape(-1, size, size) / level
        return complex((np.matmul(r[:, None, :], matrices)[:, 0, :] * weights).sum())

    def _loss_term(
        self, operator: HarmonicBalance, x: Array, left: Array, right: Array, turned: Array
    ) -> complex:
        """w' d/drate of the part of the operator that is due to nonlinear damping, on v.

        turned : the coefficients of dv/dtheta.
        """
        basis = operator.basis
        q, z, r, s = (basis.synthesis @ c for c in (x, operator.derivative(x), right, turned))
        weights = basis.analysis.T @ left
        samples = 2 * self._loss(operator, r, q, z) + self._loss(operator, q, q, s)
        return complex((samples * weights).sum())

    def _loss_derivative(
        self,
        operator: HarmonicBalance,
        x: Array,
        rate: float,
        shift: float,
        left: Array,
        right: Array,
    ) -> Array:
        """w' (d/dX of the operator's part due to nonlinear damping) v as a coefficient grid."""
        basis, tensor = operator.basis, operator.loss_tensor
        weights = basis.analysis.T @ left
        q, z = basis.synthesis @ x, rate * (basis.synthesis @ operator.derivative(x))
        r = basis.synthesis @ right
        s = rate * (basis.synthesis @ (operator.derivative(right) + 1j * shift * right))
        # of w (2 D(r, q) z + D(q, q) s), by q and by z
        by_q = 2 * np.einsum("rkjl,nr,nj,nk->nl", tensor, weights, r, z, optimize=True)
        by_q = by_q + 2 * np.einsum("rkjl,nr,nj,nk->nl", tensor, weights, q, s, optimize=True)
        by_z = 2 * np.einsum("rkjl,nr,nj,nl->nk", tensor, weights, r, q, optimize=True)
        through = basis.synthesis.T @ by_z
        grid = np.zeros_like(through)
        grid[basis.derivative_row] = basis.derivative_weight * through
        return np.asarray(basis.synthesis.T @ by_q + rate * grid)

    def _loss(self, operator: HarmonicBalance, a: Array, b: Array, velocity: Array) -> Array:
        """Samples of sum loss[r, k, j, l] a_j b_l velocity_k."""
        return np.asarray(
            np.einsum("rkjl,nj,nl,nk->nr", operator.loss_tensor, a, b, velocity, optimize=True)
        )

    def _shifted(self, operator: HarmonicBalance, x: Array, rate: float, shift: float) -> Array:
        """What a factor exp(i shift theta) adds to the operator on the full grid."""
        basis, size = operator.basis, operator.size
        rows = len(basis.rows)
        turn = np.zeros((rows, rows))
        turn[np.arange(rows), basis.derivative_row] = basis.derivative_weight[:, 0]
        eye = np.eye(size)
        added = 2j * shift * rate**2 * np.kron(turn, eye)
        added = added - (shift * rate) ** 2 * np.eye(rows * size)
        added = added + 1j * shift * rate * np.kron(np.eye(rows), operator.damping_t.T)
        if not operator.has_loss:
            return added
        friction = operator.friction(x).transpose(1, 3, 0, 2).reshape(rows * size, rows * size)
        return added + 1j * shift * rate * friction
