"""Clamped rectangles by Ritz's method in products of (1 - x^2)^2 P_k(x): no mesh, no elements."""

import itertools

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

ORDER = 26  # functions along each side: frequencies of the lowest ten to 1e-11


class ClampedRectangle:
    """Of sides about the origin; integrals of products of derivatives of its functions."""

    def __init__(self, length, width, order=ORDER):
        factor = legendre.poly2leg([1.0, 0.0, -2.0, 0.0, 1.0])
        basis = np.zeros((order, order + 4))
        for k in range(order):
            product = legendre.legmul(factor, np.eye(order)[k])
            basis[k, : len(product)] = product
        x, self.weights = legendre.leggauss(order + 6)
        values = [legendre.legval(x, legendre.legder(basis, m, axis=1).T) for m in range(3)]
        values = [each / np.abs(values[0]).max(axis=1, keepdims=True) for each in values]
        self.x, self.y = length / 2 * x, width / 2 * x
        self.along = [each / (length / 2) ** m for m, each in enumerate(values)]
        self.across = [each / (width / 2) ** m for m, each in enumerate(values)]
        self.area = length * width / 4 * np.outer(self.weights, self.weights)

    def product(self, first, second, weight=1.0):
        """int c d_first f d_second g over all functions, derivatives (m, n); c on (x, y) points."""
        if np.ndim(weight) == 0:
            halves = []
            for side, i, j in ((self.along, 0, 0), (self.across, 1, 1)):
                scale = self.area.sum() ** 0.5 / 2
                halves.append((side[first[i]] * self.weights * scale) @ side[second[j]].T)
            return weight * np.kron(*halves)
        left = [np.einsum("ax,bx->abx", self.along[first[0]], self.along[second[0]])]
        right = np.einsum("cy,dy->cdy", self.across[first[1]], self.across[second[1]])
        found = np.einsum("abx,xy,cdy->acbd", left[0], weight * self.area, right, optimize=True)
        n = found.shape[0] * found.shape[1]
        return found.reshape(n, n)

    def bending(self, law, weight=1.0):
        """int kappa:law:kappa, law (3, 3) on (xx, yy, 2 xy)."""
        kinds, factor = [(2, 0), (0, 2), (1, 1)], [1.0, 1.0, 2.0]
        return sum(
            law[i][j] * factor[i] * factor[j] * self.product(kinds[i], kinds[j], weight)
            for i, j in itertools.product(range(3), repeat=2)
            if law[i][j]
        )

    def tension(self, x, y, weight=1.0):
        """int x w_x^2 + y w_y^2."""
        return x * self.product((1, 0), (1, 0), weight) + y * self.product((0, 1), (0, 1), weight)

    def mass(self, weight=1.0):
        """int w^2."""
        return self.product((0, 0), (0, 0), weight)


def lowest(stiffness, mass, count):
    """The lowest squared frequencies (count,) and their vectors (n, count), of unit mass."""
    scale = 1 / np.sqrt(np.diag(stiffness))
    stiffness, mass = (a * np.outer(scale, scale) for a in (stiffness, mass))
    n = len(scale)
    inverse, vectors = eigh(mass, stiffness, subset_by_index=(n - count, n - 1))
    values = 1 / inverse[::-1]
    return values, scale[:, None] * vectors[:, ::-1] * np.sqrt(values)
