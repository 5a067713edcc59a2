"""Harmonic balance of the modal equations: residual, Jacobian and Newton corrections.

The force is evaluated at samples of the orbit and projected back (alternating frequency/time;
Cameron and Griffin 1989, doi:10.1115/1.3176036); with the samples of `Basis` that is exact for a
cubic force. The Jacobian is put together from the Fourier coefficients of the tangent stiffness,
block Toeplitz plus Hankel.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from nanorom.continuation.orbits.groups import Group
from nanorom.continuation.orbits.harmonics import Basis, fourier_matrix, resize, stretch
from nanorom.continuation.orbits.pairs import moving_modes
from nanorom.continuation.orbits.parts import by_term
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

TINY = 1e-300  # of a stiffness
MANY_UNKNOWNS = 200  # from which on it pays to leave out those that are next to zero
REST = 1e-9  # size below which an orbit is at rest
SMALL = 1e-3  # size below which an orbit is to be right relative to itself, not to its frequency
ASTRAY, DIVERGING = 1e3, 10.0  # times orbit and change before: corrections that lead nowhere


class HarmonicBalance:
    """The balance equations R(X, rate) = 0 of one system on one basis; rate = omega /
    period_multiple. Without inertia they are the change of R with a parameter of the system.
    """

    def __init__(self, system: ScaledSystem, basis: Basis, inertia: bool = True) -> None:
        self.system = system
        self.basis = basis
        moving = moving_modes(system, basis.modes)
        sub = moving.system
        self.inertia = sub.inertia * float(inertia)
        self.second_weight = basis.second_weight * self.inertia
        size = sub.size
        self.size = size
        self.damping_t = np.ascontiguousarray(sub.damping.T)
        self.stiffness_t = np.ascontiguousarray(sub.stiffness.T)
        # matrices [n, l, r] of the force G(q) q, linear and quadratic in q
        self.quadratic = np.ascontiguousarray(sub.quadratic.transpose(1, 2, 0)).reshape(
            size, size * size
        )
        self.cubic, self.loss = moving.cubic, moving.loss
        self.loss_tensor = sub.loss  # [r, k, j, l], symmetric in j, l
        # samples, and what is known of them: of this and of all that have some of its unknowns
        self._last: list[Array] = []
        self.has_quadratic = bool(self.quadratic.any())
        self.has_cubic = bool(self.cubic.any())
        self.has_loss = bool(self.loss.any())
        drive = fourier_matrix(basis.period_multiple * basis.angles, sub.tones)
        self.parametric = -drive @ by_term(sub.parametric.swapaxes(0, 1))
        self.has_parametric = bool(sub.parametric.any())
        driven = stretch(sub.force.T, basis.period_multiple)
        self.force = resize(driven, basis.harmonics)[basis.rows]

    def derivative(self, coefficients: Array) -> Array:
        return self.basis.derivative_weight * coefficients[self.basis.derivative_row]

    def linear(self, x: Array, rate: float) -> Array:
        return (
            rate**2 * self.second_weight * x
            + rate * (self.derivative(x) @ self.damping_t)
            + x @ self.stiffness_t
        )

    def secant(self, v: Array) -> Array:
        """G(q) with force G(q) q, transposed: (N, L, L) flattened."""
        g = self._cubic_at(v)
        if self.has_quadratic:
            g = g + v @ self.quadratic
        if self.has_parametric:
            g = g + self.parametric
        return g

    def _cubic_at(self, v: Array) -> Array:
        """The cubic part of G(q): residual and Jacobian ask for it at the same samples."""
        if not self.has_cubic:
            return np.zeros((len(v), self.size**2))
        if not self._last or not np.array_equal(self._last[0], v):
            self._last[:] = v, self.cubic.of(v)
        return self._last[1]

    def tangent(self, v: Array) -> Array:
        """d(force)/dq without the linear part, transposed: (N, L, L) flattened."""
        g: Array = 3.0 * self._cubic_at(v)
        if self.has_quadratic:
            g += 2.0 * (v @ self.quadratic)
        if self.has_parametric:
            g += self.parametric
        return g

    def residual(self, x: Array, rate: float) -> Array:
        basis, size = self.basis, self.size
        v = basis.synthesis @ x
        g = self.secant(v).reshape(len(v), size, size)
        force = np.matmul(v[:, None, :], g)[:, 0, :]
        if self.has_loss:
            w = self.loss.of(v).reshape(len(v), size, size)
            z = rate * (basis.synthesis @ self.derivative(x))
            force += np.matmul(z[:, None, :], w)[:, 0, :]
        return self.linear(x, rate) + basis.analysis @ force - self.force

    def along(self, x: Array, rate: float, change: Array) -> Array:
        """The derivative of the residual in a direction (rows, modes) of the coefficients."""
        basis, size = self.basis, self.size
        v, r = basis.synthesis @ x, basis.synthesis @ change
        g = self.tangent(v)
        if self.has_loss:
            g += self._loss_tangent(v, x, rate)
        force = np.matmul(r[:, None, :], g.reshape(len(v), size, size))[:, 0, :]
        if self.has_loss:
            w = self.loss.of(v).reshape(len(v), size, size)
            s = rate * (basis.synthesis @ self.derivative(change))
            force += np.matmul(s[:, None, :], w)[:, 0, :]
        return self.linear(change, rate) + basis.analysis @ force

    def rate_derivative(self, x: Array, rate: float) -> Array:
        basis, size = self.basis, self.size
        result = 2 * rate * self.second_weight * x + self.derivative(x) @ self.damping_t
        if self.has_loss:
            v = basis.synthesis @ x
            w = self.loss.of(v).reshape(len(v), size, size)
            z = basis.synthesis @ self.derivative(x)
            result += basis.analysis @ np.matmul(z[:, None, :], w)[:, 0, :]
        return result

    def _wide(self, samples: Array) -> Array:
        """Fourier coefficients (F, L, L) of a matrix from its samples."""
        coefficients = self.basis.analysis_wide @ samples
        return np.asarray(coefficients.reshape(len(coefficients), self.size, self.size))

    def jacobian_t(self, x: Array, rate: float) -> Array:
        """Transpose of dR/dX on the unknowns, (n, n)."""
        basis = self.basis
        v = basis.synthesis @ x
        samples = self.tangent(v)
        friction = None
        if self.has_loss:
            samples += self._loss_tangent(v, x, rate)
            friction = self._wide(self.loss.of(v))
        stiffness = self._wide(samples)
        matrix = np.empty((basis.size, basis.size))
        for pair in basis.between():
            one, two = pair.one, pair.two
            blocks = pair.of(stiffness)
            # d/dtheta moves the coefficient of row `derivative_row[i]` to row i
            if friction is not None:
                weight = basis.derivative_weight[one.rows][:, :, None, None]
                blocks[one.partners] += rate * weight * pair.of(friction)
            if one is two:
                self._add_linear(blocks, rate, one)
            part = matrix[one.place, two.place]
            shape = len(one.rows), len(one.modes), len(two.rows), len(two.modes)
            part.reshape(shape)[:] = blocks.transpose(0, 2, 1, 3)
        return matrix

    def _add_linear(self, blocks: Array, rate: float, group: Group) -> None:
        """The linear terms of the equations of one group of unknowns."""
        rows, modes = group.rows[:, None], group.modes
        every, each = np.arange(len(rows)), np.arange(len(modes))
        inertia = rate**2 * self.second_weight[rows, modes]
        blocks[every, every] += self.stiffness_t[modes[:, None], modes]
        blocks[every[:, None], every[:, None], each, each] += inertia
        weight = rate * self.basis.derivative_weight[group.rows][:, :, None]
        blocks[group.partners, every] += weight * self.damping_t[modes[:, None], modes]

    @property
    def constant(self) -> bool:
        """Whether the Jacobian is the same at all orbits and rates."""
        nonlinear = self.has_cubic or self.has_quadratic or self.has_loss
        return not (nonlinear or self.damping_t.any() or self.inertia.any())

    def friction(self, x: Array) -> Array:
        """The operator velocity -> projection of W(q, q) velocity, indexed [j, i, l, r]."""
        basis = self.basis
        rows, modes = (np.arange(count) for count in basis.shape)
        whole = Group(rows, modes, slice(0, len(rows) * len(modes)), basis.derivative_row)
        return basis.products.between(whole, whole).of(
            self._wide(self.loss.of(basis.synthesis @ x))
        )

    def only(self, taken: NDArray[np.bool_]) -> HarmonicBalance:
        """The same equations for some coefficients (rows, modes) of the basis, the others 0."""
        less = copy(self)
        less.basis = self.basis.only(taken)
        return less

    def expected(self, x: Array, rate: float, residual: Array) -> Array:
        """Sizes (rows, modes) of all coefficients of an orbit: of those that are zero, about as
        large as they would be, each by itself, to hold its part of the residual.
        """
        elastic = np.abs(rate**2 * self.second_weight + np.diag(self.stiffness_t))
        loss = rate * self.basis.number[:, None] * np.diag(self.damping_t)
        alone = np.abs(residual) / np.maximum(np.hypot(elastic, loss), TINY)
        sizes = np.where(x == 0.0, alone, np.abs(x)) * self.basis.allowed
        return np.maximum(sizes, sizes[self.basis.derivative_row])

    def _loss_tangent(self, v: Array, x: Array, rate: float) -> Array:
        """Derivative of W(q, q) q' with respect to q, transposed and flattened."""
        z = rate * (self.basis.synthesis @ self.derivative(x))
        mixed = np.einsum("nl,nk,rkjl->njr", v, z, self.loss_tensor, optimize=True)
        return np.asarray(2.0 * mixed).reshape(len(v), -1)

    def factorise(self, x: Array, rate: float, border: Array) -> BorderedFactors:
        """LU factors of [[dR/dX, dR/drate], [border]] at (X, rate)."""
        n = self.basis.size
        matrix_t = np.empty((n + 1, n + 1))
        matrix_t[:n, :n] = self.jacobian_t(x, rate)
        matrix_t[n, :n] = self.basis.pack(self.rate_derivative(x, rate))
        matrix_t[:, n] = border
        return BorderedFactors(matrix_t)

    def correct(
        self, x: Array, rate: float, border: Array, tolerance: float, iterations: int = 8
    ) -> tuple[Array, float, BorderedFactors]:
        """Newton's method in the hyperplane orthogonal to `border` through (X, rate).

        Stops when a correction is below `tolerance` relative to the orbit; the factors returned are
        those of the last correction, thus of the solution to that accuracy.
        """
        previous = np.inf
        for _ in range(iterations):
            factors = self.factorise(x, rate, border)
            rhs = np.append(-self.basis.pack(self.residual(x, rate)), 0.0)
            change = factors.solve(rhs)
            size = float(np.abs(change).max())
            if not np.isfinite(size):
                break
            x = x + self.basis.unpack(change[:-1])
            rate = rate + float(change[-1])
            scale = max(float(np.abs(x).max(initial=0.0)), REST)
            if abs(change[-1]) <= tolerance * rate and size <= tolerance * max(
                scale, rate if scale > SMALL else scale
            ):
                return x, rate, factors
            if size > ASTRAY * max(scale, 1.0) or (size > DIVERGING * previous and size > scale):
                break
            previous = size
        raise NewtonFailure("no convergence of the harmonic balance")


class NewtonFailure(ContinuationError):
    """Newton's method did not converge; the caller takes a shorter step."""


class BorderedFactors:
    """LU factors of a bordered Jacobian given by its transpose (row-major transpose = column-major
    matrix).
    """

    def __init__(self, matrix_t: Array) -> None:
        self.lu, self.pivots, info = lapack.dgetrf(matrix_t.T, overwrite_a=True)
        if info < 0:
            raise NewtonFailure("invalid Jacobian")

    def solve(self, rhs: Array) -> Array:
        return np.asarray(lapack.dgetrs(self.lu, self.pivots, rhs)[0])
