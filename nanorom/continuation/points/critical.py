"""Periodic orbits with a critical multiplier, with a parameter of the system as an unknown.

An orbit is a fold (LP), a period doubling (PD), a symmetry breaking (BP) or a torus bifurcation
(NS) where an operator A becomes singular: the Jacobian of the balance on the harmonics of the
orbit, on those it does not contain, or shifted by the exponent of the critical multiplier. A
bordered system turns that into one smooth scalar, (A b; c' 0)(v; g) = (0; 1), g = 0, whose gradient
needs no second solve than that of the transpose. Source: Govaerts 2000,
doi:10.1137/1.9780898719543 (minimally extended systems).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from nanorom.continuation.orbits.balance import MANY_UNKNOWNS, HarmonicBalance
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.continuation.orbits.harmonics import Basis, Support, basis_for, full_support
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

NULL_CORRECTIONS = 2  # of a null vector, when the matrix has hardly changed
INVERSE_ITERATIONS = 3  # each nearer by the ratio of the last two singular values, squared


class CriticalBalance:
    """The balance and g = 0 for the unknowns z = (x, rate, level), for a critical pair also the
    second frequency in units of the rate, on one number of harmonics.

    The system is origin + level * change: every array may depend on the parameter, and all terms
    are linear in the arrays, so both are set up once.
    """

    def __init__(
        self,
        origin: ScaledSystem,
        change: ScaledSystem,
        support: Support,
        kind: Kind,
        multiple: int,
        harmonics: int,
    ) -> None:
        self.size, self.kind = origin.size, kind
        self.basis = basis_for(support, harmonics, multiple)
        self.border: tuple[Array, Array] | None = None
        self.vector = np.zeros(0)  # right one and g, of the last residual
        self.vectors: tuple[Array, Array] | None = None  # left and right one of the last operator
        factor = self.factor = max(kind.period_factor, 1)
        inherited = support.stretch(factor)
        condition = kind.condition
        self.pair, self.growth = condition.conjugate, factor * condition.growth / (2 * np.pi)
        self.shifted = self.pair or self.growth != 0
        if kind.turns:
            self.wide, self.chosen = self.basis, np.arange(self.basis.size)
        else:
            wide = full_support(origin, multiple * factor)
            self.wide = basis_for(wide, harmonics * factor, multiple * factor)
            inside = inherited.rows_mask(harmonics * factor).ravel()
            self.chosen = np.arange(self.wide.size) if self.shifted else np.flatnonzero(~inside)
            if not len(self.chosen):
                raise ContinuationError(
                    f"parameter: with it the orbits have no symmetry that a {kind.code} could break"
                )
        self.to_wide = self._embedding()
        self.balances = _both(origin, change, self.basis)
        self.whole = self
        self._constant: Array | None = None
        same = self.wide is self.basis
        self.operators = self.balances if same else _both(origin, change, self.wide)

    def _embedding(self) -> Numbers:
        """Positions in the flattened wide grid of the orbit's unknowns."""
        if self.wide is self.basis:
            return np.arange(self.basis.size)
        rows = np.where(self.basis.rows == 0, 0, (self.basis.rows - 1) % 2 + 1)
        rows = np.where(self.basis.rows == 0, 0, 2 * self.factor * self.basis.number - 2 + rows)
        grid = rows[:, None] * self.size + self.basis.modes[None, :]
        flat = grid.ravel()
        return flat if self.basis.unknowns is None else flat[self.basis.unknowns]

    def without_small(self, z: Array, part: float) -> CriticalBalance:
        """The same equations without the coefficients of the orbit that are, or would be, smaller
        than a part of the largest; all of them where they are few.
        """
        n = self.basis.size
        if not self.kind.turns or n < MANY_UNKNOWNS:
            return self
        x, rate, level = self.basis.unpack(z[:n]), float(z[n]), float(z[n + 1])
        origin, change = self.balances
        residual = origin.residual(x, rate) + level * change.residual(x, rate)
        taken = self.basis.in_bands(origin.expected(x, rate, residual), part)
        less = copy(self)
        less.balances = less.operators = origin.only(taken), change.only(taken)
        less.basis = less.wide = less.balances[1].basis = less.balances[0].basis
        less.chosen = less.to_wide = np.arange(less.basis.size)
        less.border = less.vectors = less._constant = None
        return less

    def begin_with(self, other: CriticalBalance) -> None:
        """Take the last null vectors of the equations, maybe on another basis, as borders: the
        nearer these are, the straighter is g.
        """
        if not self.kind.turns or other.vectors is None:
            return
        old, new = other.basis, self.basis
        moved = (new.compress(old.expand(old.unpack(v), self.size)) for v in other.vectors)
        left, right = (new.pack(vector) for vector in moved)
        self.border = left / np.linalg.norm(left), right / np.linalg.norm(right)

    def _jacobians(self, x: Array, rate: float) -> list[Array]:
        """Those of the balance and of what the parameter adds to it."""
        origin, change = self.balances
        if self._constant is None or not change.constant:
            self._constant = change.jacobian_t(x, rate).T
        return [origin.jacobian_t(x, rate).T, self._constant]

    def system(self, z: Array) -> tuple[Array, Array]:
        """Residual (n + 1,) or (n + 2,) and Jacobian of balance and criticality."""
        basis, n = self.basis, self.basis.size
        rate, level = float(z[n]), float(z[n + 1])
        x = basis.unpack(z[:n])
        residual, by_level = (basis.pack(b.residual(x, rate)) for b in self.balances)
        jacobian = np.zeros((len(z) - 1, len(z)))
        matrices = self._jacobians(x, rate)
        jacobian[:n, :n] = matrices[0] + level * matrices[1]
        for weight, balance in zip((1.0, level), self.balances):
            jacobian[:n, n] += weight * basis.pack(balance.rate_derivative(x, rate))
        jacobian[:n, n + 1] = by_level
        value, gradient = self._criticality(z, matrices)
        jacobian[n:] = gradient
        return np.concatenate([residual + level * by_level, value]), jacobian

    def residual(self, z: Array) -> Array | None:
        """The residual near where `system` was asked last, without a new matrix: the null vector
        is corrected by the factors that it left. None if these are not of the balance itself.
        """
        if not self.kind.turns or self.border is None:
            return None
        n, basis = self.basis.size, self.basis
        x, rate, level = basis.unpack(z[:n]), float(z[n]), float(z[n + 1])
        (first, by_level), (b, c) = self.balances, self.border
        vector = self.vector
        residual = basis.pack(first.residual(x, rate) + level * by_level.residual(x, rate))
        for _ in range(NULL_CORRECTIONS):
            direction = basis.unpack(vector[:n])
            image = first.along(x, rate, direction) + level * by_level.along(x, rate, direction)
            gap = np.append(basis.pack(image) + vector[n] * b, c @ vector[:n] - 1.0)
            vector = vector - lu_solve(self.factors, gap, check_finite=False)
        self.vector = vector
        return np.append(residual, vector[n])

    def solve(self, matrix: Array, right: Array) -> Array:
        """The solution (n, k) of [Jacobian; border] for right sides (n, k), by the factors that
        `system` left if the operator is the Jacobian of the balance itself.

        A x + b m = f is solved with c' x = t for every t, and t is such that m is 0.
        """
        if not self.kind.turns:
            return np.asarray(np.linalg.solve(matrix, right))
        n = self.basis.size
        some = np.zeros((n + 1, right.shape[1] + 2))
        some[:n] = np.hstack([right[:n], -matrix[:n, n:]])
        found = np.hstack([lu_solve(self.factors, some, check_finite=False), self.null[:, None]])
        below = matrix[n:, :n] @ found[:n]
        below[:, -3:-1] += matrix[n:, n:]
        small = np.vstack([found[n], below])
        right = np.vstack([np.zeros(right.shape[1]), right[n:]])
        change = np.linalg.solve(small[:, -3:], right - small[:, :-3])
        x = found[:n, :-3] + found[:n, -3:] @ change
        return np.vstack([x, change[:2]])

    def _criticality(self, z: Array, matrices: Sequence[Array]) -> tuple[Array, Array]:
        """g (both parts of it for a pair) and its gradient; matrices: Jacobians of the balances."""
        n, wide = self.basis.size, self.wide
        rate, level = float(z[n]) / self.factor, float(z[n + 1])
        shift = complex(self.growth, z[n + 2]) if self.pair else self.growth
        x = self._widened(z[:n])
        if not self.kind.turns:
            matrices = [self._matrix(b, x, rate, shift) for b in self.operators]
        matrix, by_level = matrices
        v, w, g = self._null_vectors(matrix + level * by_level)
        left, right = self._spread(w), self._spread(v)
        gradient = np.zeros(len(z), dtype=complex)
        gradient[n + 1] = -(w @ by_level @ v)
        for weight, operator in zip((1.0, level), self.operators):
            grid = self._second_derivative(operator, x, left, right)
            if operator.has_loss:
                grid = grid + self._loss_derivative(operator, x, rate, shift, left, right)
            packed = wide.pack(grid) if wide is self.basis else grid.ravel()[self.to_wide]
            gradient[:n] -= weight * packed
            by_rate, by_shift = self._slopes(operator, x, rate, shift, left, right)
            gradient[n] -= weight * by_rate / self.factor
            if self.pair:
                gradient[n + 2] -= weight * by_shift
        if not self.pair:
            return np.array([g.real]), gradient.real[None]
        return np.array([g.real, g.imag]), np.stack([gradient.real, gradient.imag])

    def _widened(self, unknowns: Array) -> Array:
        """Coefficients of the orbit on the grid of the operator."""
        if self.wide is self.basis:
            return self.wide.unpack(unknowns)
        flat = np.zeros(self.wide.shape[0] * self.wide.shape[1])
        flat[self.to_wide] = unknowns
        return flat.reshape(self.wide.shape)

    def _slopes(
        self,
        operator: HarmonicBalance,
        x: Array,
        rate: float,
        shift: complex,
        left: Array,
        right: Array,
    ) -> tuple[complex, complex]:
        """w' (d operator / drate) v and w' (d operator / d imaginary part of the shift) v."""
        second, first = operator.second_weight * right, operator.derivative(right)
        # the rate multiplies d/dtheta, which is d/dtheta + shift
        turned = first + shift * right
        inertia = operator.inertia
        slope = 2 * rate * (second + inertia * (2 * shift * first + shift * shift * right))
        by_rate = complex((left * (slope + turned @ operator.damping_t)).sum())
        change = inertia * rate**2 * (2j * first + 2j * shift * right)
        by_shift = complex((left * (change + 1j * rate * (right @ operator.damping_t))).sum())
        if operator.has_loss:
            by_rate += self._loss_term(operator, x, left, right, turned)
            by_shift += 1j * rate * self._loss_term(operator, x, left, 0 * right, right)
        return by_rate, by_shift

    def _matrix(self, operator: HarmonicBalance, x: Array, rate: float, shift: complex) -> Array:
        """The operator that is to be singular, or what the parameter adds to it."""
        matrix = operator.jacobian_t(x, rate).T
        if self.wide.unknowns is None:
            matrix = matrix[np.ix_(self.chosen, self.chosen)]
        return matrix + self._shifted(operator, x, rate, shift) if self.shifted else matrix

    def _null_vectors(self, matrix: Array) -> tuple[Array, Array, complex]:
        """Right and left vectors and g of the bordered operator; the borders follow the vectors."""
        size = len(matrix)
        if self.border is None or len(self.border[0]) != size:
            self.border = _nearly_null(matrix)
        b, c = self.border
        bordered = np.zeros((size + 1, size + 1), dtype=matrix.dtype)
        bordered[:size, :size] = matrix
        bordered[:size, size] = b
        bordered[size, :size] = c.conj()
        unit = np.zeros(size + 1)
        unit[-1] = 1.0
        self.factors = lu_factor(bordered, check_finite=False)
        self.null = self.vector = right = lu_solve(self.factors, unit, check_finite=False)
        left = lu_solve(self.factors, unit, trans=1, check_finite=False)
        self.vectors = left[:size], right[:size]
        return right[:size], left[:size], complex(right[size])

    def _spread(self, vector: Array) -> Array:
        """A vector on the chosen unknowns as a coefficient grid."""
        wide = self.wide
        flat = np.zeros(wide.shape[0] * wide.shape[1], dtype=vector.dtype)
        if wide.unknowns is None:
            flat[self.chosen] = vector
        else:
            flat[wide.unknowns] = vector
        return flat.reshape(wide.shape)

    def _second_derivative(
        self, operator: HarmonicBalance, x: Array, left: Array, right: Array
    ) -> Array:
        """w' (d Jacobian / dX) v as a coefficient grid."""
        basis, size = operator.basis, operator.size
        if not (operator.has_cubic or operator.has_quadratic):
            return np.zeros_like(left)
        q, r = basis.synthesis @ x, basis.synthesis @ right
        weights = basis.analysis.T @ left
        first, second = operator.cubic.first, operator.cubic.second
        pairs = (q[:, first] * r[:, second] + q[:, second] * r[:, first]) / 2
        tensor = 6.0 * operator.cubic(pairs)
        if operator.has_quadratic:
            tensor = tensor + 2.0 * (r @ operator.quadratic)
        samples = np.matmul(tensor.reshape(-1, size, size), weights[:, :, None])[:, :, 0]
        return np.asarray(basis.synthesis.T @ samples)

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
        shift: complex,
        left: Array,
        right: Array,
    ) -> Array:
        """w' (d/dX of the operator's part due to nonlinear damping) v as a coefficient grid."""
        basis, tensor = operator.basis, operator.loss_tensor
        weights = basis.analysis.T @ left
        q, z = basis.synthesis @ x, rate * (basis.synthesis @ operator.derivative(x))
        r = basis.synthesis @ right
        s = rate * (basis.synthesis @ (operator.derivative(right) + shift * right))
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

    def _shifted(self, operator: HarmonicBalance, x: Array, rate: float, shift: complex) -> Array:
        """What a factor exp(shift theta) adds to the operator on the full grid."""
        basis, size = operator.basis, operator.size
        rows = len(basis.rows)
        turn = np.zeros((rows, rows))
        turn[np.arange(rows), basis.derivative_row] = basis.derivative_weight[:, 0]
        inertia = np.diag(operator.inertia)
        added = np.zeros((rows * size,) * 2, dtype=type(shift))
        if operator.inertia.any():
            added += 2 * shift * rate**2 * np.kron(turn, inertia)
            added += (shift * rate) * (shift * rate) * np.kron(np.eye(rows), inertia)
        added += shift * rate * np.kron(np.eye(rows), operator.damping_t.T)
        if not operator.has_loss:
            return added
        friction = operator.friction(x).transpose(1, 3, 0, 2).reshape(rows * size, rows * size)
        return added + shift * rate * friction


def _nearly_null(matrix: Array) -> tuple[Array, Array]:
    """Left and right vectors that a nearly singular matrix makes small: by inverse iteration, which
    costs much less than all singular values, but where the matrix is singular to the last bit.
    """
    if len(matrix) >= MANY_UNKNOWNS:
        factors = lu_factor(matrix, check_finite=False)
        if np.abs(np.diag(factors[0])).min() > 0:
            right = np.ones(len(matrix), dtype=matrix.dtype)
            for _ in range(INVERSE_ITERATIONS):
                left = lu_solve(factors, right / np.linalg.norm(right), trans=2)
                right = lu_solve(factors, left / np.linalg.norm(left))
            return left / np.linalg.norm(left), right / np.linalg.norm(right)
    u, _, vh = np.linalg.svd(matrix)
    return u[:, -1].copy(), vh[-1].conj().copy()


def _both(
    origin: ScaledSystem, change: ScaledSystem, basis: Basis
) -> tuple[HarmonicBalance, HarmonicBalance]:
    """The balance of the system at level 0, and what the parameter adds to it per level."""
    return HarmonicBalance(origin, basis), HarmonicBalance(change, basis, inertia=False)
