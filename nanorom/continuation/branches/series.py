"""Taylor series of a solution branch: the asymptotic numerical method.

With X(a) = sum X_k a^k and rate(a) = sum rate_k a^k in R(X, rate) = 0, every order is a linear
system with the same matrix, so one LU factorisation gives some twenty derivatives of the branch.
The parameter a is the distance along the previous tangent. Source: Cochelin and Vergez 2009,
doi:10.1016/j.jsv.2009.01.054 (there with a quadratic recast; here the cubic force is expanded
directly).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nanorom.continuation.branches.rational import (
    denominator,
    multiplied,
    reach,
    real_roots,
)
from nanorom.continuation.orbits.balance import BorderedFactors, HarmonicBalance
from nanorom.types import Array, Numbers

ORDER = 24
REST = 1e-6  # size below which an orbit is at rest
WITH_FIRST = 1.5  # weight of products with order 0 in the matrices that multiply orders 1, 2, ...


@dataclass(eq=False)
class Series:
    """One step of a branch: polynomials of the parameter a over a common one, on [start, length].

    The sum of coefficients_k a^k and rates_k a^k is divided by that of denominator_k a^k.
    """

    balance: HarmonicBalance
    coefficients: Array  # (order + 1, n) of the packed unknowns
    rates: Array  # (order + 1,)
    denominator: Array = field(default_factory=lambda: np.ones(1))
    length: float = 0.0
    taylor: float = np.inf  # length at which the Taylor series itself would end
    start: float = 0.0
    powers: Numbers = field(init=False)
    bend: Array = field(init=False)  # derivative of the denominator

    def __post_init__(self) -> None:
        self.powers = np.arange(len(self.rates))
        self.bend = (self.powers[: len(self.denominator)] * self.denominator)[1:]

    @classmethod
    def from_terms(
        cls, balance: HarmonicBalance, packed: Array, rates: Array, tolerance: float
    ) -> Series:
        """The quotient for Taylor series (order + 1, n) and (order + 1,), as long as it is right to
        `tolerance`, relative to the orbit and to the rate.
        """
        scale = max(float(np.abs(packed[0]).max(initial=0.0)), REST)
        terms = np.column_stack([packed / scale, rates / rates[0]])
        below = denominator(terms)
        plain = reach(terms, np.ones(1), tolerance)
        above = multiplied(below, terms)
        length = reach(above, below, tolerance)
        above[:, :-1] *= scale
        above[:, -1] *= rates[0]
        unknowns = np.ascontiguousarray(above[:, :-1])
        # copies: of a view the whole table would stay
        return cls(balance, unknowns, above[:, -1].copy(), below, length, plain)

    def _weights(self, a: float | Array) -> Array:
        """Of the terms in the value at a, (..., order + 1)."""
        powers = np.asarray(a)[..., None] ** self.powers
        return np.asarray(powers / self._below(powers))

    def _slopes(self, a: float | Array) -> Array:
        """Of the terms in the derivative at a, (..., order + 1)."""
        powers = np.asarray(a)[..., None] ** self.powers
        below = self._below(powers)
        slopes = np.zeros_like(powers)
        slopes[..., 1:] = self.powers[1:] * powers[..., :-1]
        if len(self.bend):
            bend = (powers[..., : len(self.bend)] @ self.bend)[..., None]
            slopes = np.subtract(slopes, powers * bend / below)
        return np.asarray(slopes / below)

    def _below(self, powers: Numbers) -> Array:
        return np.asarray(powers[..., : len(self.denominator)] @ self.denominator)[..., None]

    def at(self, a: float) -> tuple[Array, float]:
        """Basis coefficients (rows, modes) and rate at a."""
        weights = self._weights(a)
        return self.balance.basis.unpack(weights @ self.coefficients), float(weights @ self.rates)

    def rate(self, a: float) -> float:
        return float(self._weights(a) @ self.rates)

    def rate_slope(self, a: float) -> float:
        return float(self._slopes(a) @ self.rates)

    def rate_slopes(self, a: Array) -> Array:
        return np.asarray(self._slopes(a) @ self.rates)

    def derivative(self, a: float | Array) -> Array:
        """d(unknowns, rate)/da at the places (...), (..., n + 1)."""
        slopes = self._slopes(a)
        parts = slopes @ self.coefficients, (slopes @ self.rates)[..., None]
        return np.concatenate(parts, axis=-1)

    def tangent(self, a: float) -> Array:
        """Unit tangent (n + 1,) of the branch at a."""
        direction = self.derivative(a)
        return np.asarray(direction / np.linalg.norm(direction))

    def reversed(self) -> Series:
        """The same step the other way round."""
        signs = (-1.0) ** self.powers
        return Series(
            self.balance,
            signs[:, None] * self.coefficients,
            signs * self.rates,
            signs[: len(self.denominator)] * self.denominator,
            length=-self.start,
            taylor=self.taylor,
            start=-self.length,
        )

    def crossings(self, rate: float) -> list[float]:
        """Where the branch passes a rate within the step."""
        return self._passing(self.rates, rate)

    def level_crossings(self, direction: Array, slope: float, value: float) -> list[float]:
        """Where `direction` (n,) times the unknowns plus `slope` times the rate has a value."""
        return self._passing(self.coefficients @ direction + slope * self.rates, value)

    def _passing(self, terms: Array, value: float) -> list[float]:
        """Where a quotient with these terms (order + 1,) above has a value."""
        shifted = terms.copy()
        shifted[: len(self.denominator)] -= value * self.denominator
        return _roots_between(shifted, self.start, self.length)

    def folds(self, low: float, high: float) -> list[float]:
        """Where the rate turns back, in [low, high] with low <= 0 <= high."""
        slope = self.powers[1:] * self.rates[1:]
        if len(self.bend):
            slope = np.convolve(slope, self.denominator) - np.convolve(self.rates, self.bend)
        return _roots_between(slope, low, high)


def _roots_between(polynomial: Array, low: float, high: float) -> list[float]:
    """Real roots in [low, high] with low <= 0 <= high; of 0 itself only an exact one."""
    mirrored = polynomial * (-1.0) ** np.arange(len(polynomial))
    below = [-root for root in real_roots(mirrored, -low)] if low < 0 else []
    above = real_roots(polynomial, high) if high > 0 else []
    return below[::-1] + ([0.0] if polynomial[0] == 0 else []) + above


class SeriesExpansion:
    """Work space for the recursion on one harmonic balance; buffers are reused from step to
    step.
    """

    def __init__(self, balance: HarmonicBalance, order: int = ORDER) -> None:
        self.balance, self.order = balance, order
        n, size = balance.basis.samples, balance.size
        rows = balance.basis.shape[0]
        self.forward = np.zeros((n, order + 1, size))
        self.backward = np.zeros((n, order + 1, size))
        # of orders 1, 2, ...: what `_complete` makes of them
        self.secants = np.zeros((n, order + 1, size * size))
        self.orders = np.zeros((order + 1, rows, size))
        # large temporaries would be returned to the system and faulted in again at every operation
        self._squares = np.empty((n, size, size))
        if balance.has_loss:
            self.losses = np.zeros((n, order + 1, size * size))
            self.velocity = np.zeros((n, order + 1, size))
            self.friction = np.zeros((order + 1, n, size))

    def expand(
        self,
        balance: HarmonicBalance,
        x: Array,
        rate: float,
        factors: BorderedFactors,
        order: int | None = None,
    ) -> tuple[Array, Array]:
        """Coefficients (order + 1, n) and rates (order + 1,) of the branch through (x, rate), to
        that order of the work space or a lower one.

        balance : that of the work space, or for some of its unknowns
        """
        basis = balance.basis
        order = order or self.order
        rates = np.zeros(order + 1)
        squares = np.zeros(order + 1)
        rates[0], squares[0] = rate, rate * rate
        packed = np.zeros((order + 1, basis.size))
        if basis.size == 0:  # rest: only the rate changes
            rates[1] = factors.solve(np.ones(1))[0]
            return packed, rates
        packed[0] = basis.pack(x)
        self._store(0, x)
        if balance.has_loss:
            self.losses[:, 0] = balance.loss.of(self.forward[:, 0])
            self._store_friction(0)
        rhs = np.zeros(basis.size + 1)
        for k in range(1, order + 1):
            rhs[-1] = 1.0 if k == 1 else 0.0
            if k > 1:
                if balance.has_loss:
                    self.losses[:, k] = balance.loss.of_squares(self._squares_of(1, k - 1, 1.0))
                squares[k] = rates[1:k] @ rates[k - 1 : 0 : -1]
                rhs[:-1] = -basis.pack(self._known(k, rates, squares))
            solution = factors.solve(rhs)
            packed[k] = solution[:-1]
            rates[k] = solution[-1]
            squares[k] += 2.0 * rate * rates[k]
            if k < order:
                self._store(k, basis.unpack(packed[k]))
                self._complete(k)
                if balance.has_loss:
                    self._store_friction(k)
        return packed, rates

    def _store(self, k: int, x: Array) -> None:
        self.orders[k] = x
        v = self.balance.basis.synthesis @ x
        self.forward[:, k] = v
        self.backward[:, self.order - k] = v
        if self.balance.has_loss:
            self.velocity[:, self.order - k] = (
                self.balance.basis.synthesis @ self.balance.derivative(x)
            )

    def _squares_of(self, first: int, last: int, weight: float) -> Array:
        """Products q_i q_j (N, L * L) with i + j = first + last and both in this range of orders;
        those of its ends have a weight.
        """
        orders = self.forward[:, first : last + 1].copy()
        orders[:, [0, -1]] *= weight
        others = self.backward[:, self.order - last : self.order - first + 1]
        np.matmul(orders.transpose(0, 2, 1), others, out=self._squares)
        return self._squares.reshape(len(orders), -1)

    def _known(self, k: int, rates: Array, squares: Array) -> Array:
        """Terms of order k that do not contain the unknowns of order k."""
        balance, basis = self.balance, self.balance.basis
        size = balance.size
        n = len(self.forward)
        inner = slice(self.order - k + 1, self.order)
        samples = np.matmul(
            self.backward[:, inner].reshape(n, 1, -1),
            self.secants[:, 1:k].reshape(n, (k - 1) * size, size),
        )[:, 0]
        if balance.has_loss:
            past = slice(self.order - k + 1, self.order + 1)
            y = np.matmul(
                self.velocity[:, past].reshape(n, 1, -1),
                self.losses[:, 1 : k + 1].reshape(n, k * size, size),
            )
            samples += rates[0] * y[:, 0]
            samples += np.tensordot(rates[k - 1 : 0 : -1], self.friction[1:k], axes=1)
        orders = self.orders[1:k].reshape(k - 1, -1)
        inertia = (squares[k - 1 : 0 : -1] @ orders).reshape(-1, size)
        inertia += squares[k] * self.orders[0]
        known = basis.analysis @ samples
        known += balance.second_weight * inertia
        slope = balance.derivative((rates[k - 1 : 0 : -1] @ orders).reshape(-1, size))
        known += slope @ balance.damping_t
        return np.asarray(known)

    def _complete(self, k: int) -> None:
        """Secant matrices (and losses) of order k, now that the unknowns of order k are there.

        Of the products q_i q_j q_l that later orders want, those with one q_0 come in a third of
        the cases with it behind the secant matrix, and are left out there: the tensor is
        symmetric, so that half as much again of them in the matrix is the same.
        """
        balance = self.balance
        v0, v = self.forward[:, 0], self.forward[:, k]
        if balance.has_cubic:
            products = self._squares_of(0, k, WITH_FIRST)
            self.secants[:, k] = balance.cubic.of_squares(products)
        if balance.has_quadratic:
            linear = v @ balance.quadratic
            self.secants[:, k] = self.secants[:, k] + linear if balance.has_cubic else linear
        if balance.has_loss:
            mixed = balance.loss.of_mixed(v0, v)
            self.losses[:, k] = mixed + (self.losses[:, k] if k > 1 else 0.0)

    def _store_friction(self, k: int) -> None:
        """y_k = sum_i W_i z_(k-i), the damping force of order k before the factor rate."""
        size = self.balance.size
        n = len(self.losses)
        z = self.velocity[:, self.order - k :].reshape(n, 1, -1)
        w = self.losses[:, : k + 1].reshape(n, (k + 1) * size, size)
        self.friction[k] = np.matmul(z, w)[:, 0, :]
