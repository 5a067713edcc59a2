"""Harmonic balance of the modal equations: residual, Jacobian and Newton corrections.

The force is evaluated at samples of the orbit and projected back (alternating frequency/time;
Cameron and Griffin 1989, doi:10.1115/1.3176036); with the samples of `Basis` that is exact for a
cubic force. The Jacobian is put together from the Fourier coefficients of the tangent stiffness,
block Toeplitz plus Hankel.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from nanorom.continuation.orbits.harmonics import Basis, fourier_matrix, resize, stretch
from nanorom.continuation.orbits.pairs import moving_modes
from nanorom.continuation.orbits.parts import by_term
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

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
        g = self.cubic.of(v)
        if self.has_quadratic:
            g += v @ self.quadratic
        if self.has_parametric:
            g += self.parametric
        return g

    def tangent(self, v: Array) -> Array:
        """d(force)/dq without the linear part, transposed: (N, L, L) flattened."""
        g: Array = self.cubic.of(v)
        g *= 3.0
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

    def rate_derivative(self, x: Array, rate: float) -> Array:
        basis, size = self.basis, self.size
        result = 2 * rate * self.second_weight * x + self.derivative(x) @ self.damping_t
        if self.has_loss:
            v = basis.synthesis @ x
            w = self.loss.of(v).reshape(len(v), size, size)
            z = basis.synthesis @ self.derivative(x)
            result += basis.analysis @ np.matmul(z[:, None, :], w)[:, 0, :]
        return result

    def _convolution(self, samples: Array) -> Array:
        """The operator phi_j -> projection of g phi_j, indexed [j, i, l, r]."""
        basis = self.basis
        g = basis.analysis_wide @ samples
        blocks = g[basis.index_a]
        blocks *= basis.weight_a
        other = g[basis.index_b]
        other *= basis.weight_b
        blocks += other
        return blocks.reshape(basis.shape[0], basis.shape[0], self.size, self.size)

    def jacobian_t(self, x: Array, rate: float) -> Array:
        """Transpose of dR/dX on the unknowns, (n, n)."""
        basis, size = self.basis, self.size
        v = basis.synthesis @ x
        samples = self.tangent(v)
        if self.has_loss:
            samples += self._loss_tangent(v, x, rate)
        blocks = self._convolution(samples)
        harmonics = np.arange(basis.shape[0])
        diagonal = self.stiffness_t[None] + (rate**2 * self.second_weight)[:, :, None] * np.eye(
            size
        )
        blocks[harmonics, harmonics] += diagonal
        # d/dtheta moves the coefficient of row `derivative_row[i]` to row i
        coupling = rate * basis.derivative_weight[:, :, None] * self.damping_t
        blocks[basis.derivative_row, harmonics] += coupling
        if self.has_loss:
            w = rate * self.friction(x)
            blocks[basis.derivative_row] += basis.derivative_weight[:, :, None, None] * w
        full = basis.shape[0] * size
        matrix = blocks.transpose(0, 2, 1, 3).reshape(full, full)
        if basis.unknowns is not None:
            matrix = matrix[np.ix_(basis.unknowns, basis.unknowns)]
        return matrix

    def friction(self, x: Array) -> Array:
        """The operator velocity -> projection of W(q, q) velocity, indexed [j, i, l, r]."""
        return self._convolution(self.loss.of(self.basis.synthesis @ x))

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
