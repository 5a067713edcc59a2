"""Nonlinear forces of modes that move as polynomials of a few coordinates, degree by degree."""

from __future__ import annotations

import numpy as np

from nanorom.rom.manifold.monomials import Monomials, splits
from nanorom.types import Array, Numbers


class PolynomialForces:
    """N = A qq + B qqq + D q d(qq)/dt where q and q' are polynomials (P, L) without a constant.

    Tensors as of `ModalSystem`, B symmetric in its last three indices.  `of` is called for degrees
    2, 3, ... in order; the products that it makes are kept.
    """

    def __init__(self, monomials: Monomials, quadratic: Array, cubic: Array, loss: Array) -> None:
        self.monomials, self.size = monomials, len(quadratic)
        size = self.size
        self._first, self._second = np.triu_indices(size)
        # of B and D, matrices [(r, l), pair jk]
        self._quadratic = self._of_pairs(quadratic)
        self._cubic = self._of_pairs(cubic.transpose(0, 3, 1, 2).reshape(-1, size, size))
        self._loss = self._of_pairs(loss.transpose(0, 3, 1, 2).reshape(-1, size, size))
        shape = (len(monomials), size, size)
        self.has_quadratic, self.has_loss = bool(quadratic.any()), bool(loss.any())
        self._secant = np.zeros(shape, dtype=complex)  # B qq
        self._friction = np.zeros(shape if self.has_loss else 0, dtype=complex)  # D d(qq)/dt

    def of(self, degree: int, q: Numbers, speed: Numbers) -> Numbers:
        """The force (n, L) of one degree; q and q' (P, L) need to be known below it."""
        pairs = self._pairs(degree, q, q, 1, 1)
        force = _times(self._quadratic, pairs)
        for a, b in splits(degree, 2, 1):
            force = force + self._moved(a, self._secant, b, q)
            if self.has_loss:
                force = force + self._moved(a, self._friction, b, q)
        here = self.monomials.of(degree)
        self._secant[here] = self._matrices(self._cubic, pairs)
        if self.has_loss:
            rates = 2 * self._pairs(degree, q, speed, 1, 1)
            self._friction[here] = self._matrices(self._loss, rates)
        return force

    def change(
        self, degree: int, q: Numbers, speed: Numbers, s: Numbers, s_speed: Numbers
    ) -> Numbers:
        """The change (n, L) of the force of one degree with s, s' (P, L), known below it from
        degree 0; after `of` for all degrees up to this one.
        """
        here = self.monomials.of(degree)
        force = np.zeros((here.stop - here.start, self.size), dtype=complex)
        if self.has_quadratic:
            force += 2 * _times(self._quadratic, self._pairs(degree, q, s, 1, 0))
        for a, b in splits(degree, 2, 0):
            force = force + 3 * self._moved(a, self._secant, b, s)
        if self.has_loss:
            for a, b in splits(degree, 2, 0):
                force = force + self._moved(a, self._friction, b, s)
            for a, b in splits(degree, 1, 1):  # products with s of degree a, times q
                rates = self._pairs(a, q, s_speed, 1, 0) + self._pairs(a, speed, s, 1, 0)
                mixed = np.zeros((len(self.monomials), self.size, self.size), dtype=complex)
                mixed[self.monomials.of(a)] = self._matrices(self._loss, 2 * rates)
                force = force + self._moved(a, mixed, b, q)
        return force

    def _pairs(
        self, degree: int, left: Numbers, right: Numbers, first: int, second: int
    ) -> Numbers:
        """(left_j right_k + left_k right_j) / 2 of one degree, by pairs, twice for j < k."""
        here = self.monomials.of(degree)
        result = np.zeros((here.stop - here.start, len(self._first)), dtype=complex)
        for a, b in splits(degree, first, second):
            outer = self.monomials.product(a, left, b, right, "pj,pk->pjk")
            outer = (outer + outer.transpose(0, 2, 1)).reshape(len(outer), -1)
            result += outer[:, self._first * self.size + self._second]
        result[:, self._first == self._second] /= 2
        return result

    def _moved(self, a: int, matrix: Numbers, b: int, q: Numbers) -> Numbers:
        return self.monomials.product(a, matrix, b, q, "prl,pl->pr")

    def _matrices(self, tensor: Array, pairs: Numbers) -> Numbers:
        return _times(tensor, pairs).reshape(-1, self.size, self.size)

    def _of_pairs(self, tensor: Array) -> Array:
        """A tensor (n, L, L) by pairs j <= k: (n, pairs)."""
        symmetric = (tensor + tensor.transpose(0, 2, 1)) / 2
        return np.ascontiguousarray(symmetric[:, self._first, self._second])


def _times(matrix: Array, columns: Numbers) -> Numbers:
    """columns (n, k) complex by a real matrix (m, k): (n, m)."""
    return np.asarray(columns.real @ matrix.T + 1j * (columns.imag @ matrix.T))
