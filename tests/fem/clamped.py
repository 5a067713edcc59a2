"""Clamped rectangles by Ritz's method in products of (1 - x^2)^2 P_k(x): no mesh, no elements."""

import itertools

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

ORDER = 26  # functions along each side: frequencies of the lowest ten to 1e-11


class ClampedRectangle:
    """Of sides about the origin; integrals of products of derivatives of its functions.

    power : of 1 - x^2 in them, 2 for deflections and 1 for displacements in the plane.
    """

    def __init__(self, length, width, order=ORDER, power=2):
        factor = legendre.poly2leg([1.0, 0.0, -1.0])
        factor = legendre.legpow(factor, power)
        basis = np.zeros((order, order + 2 * power))
        for k in range(order):
            product = legendre.legmul(factor, np.eye(order)[k])
            basis[k, : len(product)] = product
        x, self.weights = legendre.leggauss(order + 6)
        values = [legendre.legval(x, legendre.legder(basis, m, axis=1).T) for m in range(3)]
        values = [each / np.abs(values[0]).max(axis=1, keepdims=True) for each in values]
        self.along = [each / (length / 2) ** m for m, each in enumerate(values)]
        self.across = [each / (width / 2) ** m for m, each in enumerate(values)]
        self.area = length * width / 4 * np.outer(self.weights, self.weights)

    def product(self, first, second, other=None):
        """int d_first f d_second g, derivatives (m, n); g of the other rectangle's functions."""
        other = other or self
        scale = np.sqrt(self.area.sum()) / 2
        along = (self.along[first[0]] * self.weights * scale) @ other.along[second[0]].T
        across = (self.across[first[1]] * self.weights * scale) @ other.across[second[1]].T
        return np.kron(along, across)

    def bending(self, law):
        """int kappa:law:kappa, law (3, 3) on (xx, yy, 2 xy)."""
        kinds, factor = [(2, 0), (0, 2), (1, 1)], [1.0, 1.0, 2.0]
        return sum(
            law[i][j] * factor[i] * factor[j] * self.product(kinds[i], kinds[j])
            for i, j in itertools.product(range(3), repeat=2)
            if law[i][j]
        )

    def tension(self, x, y):
        """int x w_x^2 + y w_y^2."""
        return x * self.product((1, 0), (1, 0)) + y * self.product((0, 1), (0, 1))

    def mass(self):
        """int w^2."""
        return self.product((0, 0), (0, 0))


def lowest(stiffness, mass, count):
    """The lowest squared frequencies (count,) and their vectors (n, count), of unit mass."""
    scale = 1 / np.sqrt(np.diag(stiffness))
    stiffness, mass = (a * np.outer(scale, scale) for a in (stiffness, mass))
    n = len(scale)
    inverse, vectors = eigh(mass, stiffness, subset_by_index=(n - count, n - 1))
    values = 1 / inverse[::-1]
    return values, scale[:, None] * vectors[:, ::-1] * np.sqrt(values)
