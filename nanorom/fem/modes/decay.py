"""Polynomials of a cell, sorted by degree and orthonormal in energy: squares tell its decay."""

from __future__ import annotations

from functools import lru_cache

import attrs
import basix
import numpy as np

from nanorom.fem.solvers import compat

SLOWEST = 0.6  # ratio of tails of the strongest singularity, a crack's is 0.5; beyond is noise
DEPENDENT = 1e-12  # of a polynomial's energy: what the others may leave of it
INEXACT = 1e-13  # of the energy that a polynomial has where all directions count: how it is known


@attrs.frozen(eq=False)
class Polynomials:
    """Orthonormal polynomials of the reference triangle up to a degree, sorted by degree.

    coefficients: (n, n) from nodal values to theirs; slopes: (2, 2, n, n) and curvatures:
    (3, 3, n, n) integrals of products of their first and second derivatives.
    """

    coefficients: np.ndarray
    slopes: np.ndarray
    curvatures: np.ndarray

    @classmethod
    @lru_cache(maxsize=8)
    def of(cls, degree: int) -> Polynomials:
        element = compat.reference_element(degree)
        rule = basix.make_quadrature(basix.CellType.triangle, 2 * degree)
        points, weights = np.asarray(rule[0]), np.asarray(rule[1])
        at_nodes = compat.orthonormal_polynomials(degree, np.asarray(element.points))
        nodal = np.asarray(element.tabulate(2, points)).reshape(6, len(points), -1)
        derivatives = nodal @ at_nodes.T
        products = [
            np.einsum("q,aqm,bqn->abmn", weights, part, part, optimize=True)
            for part in (derivatives[1:3], derivatives[3:])
        ]
        return cls(np.linalg.inv(at_nodes.T), *products)


def orthonormal(
    degree: int, slopes: np.ndarray, curvatures: np.ndarray | None = None
) -> np.ndarray:
    """Matrices (c, n, n) from nodal values in cells to polynomials orthonormal in their energy.

    slopes: (c, 2, 2) and curvatures: (c, 3, 3) weigh the products of first and second derivatives
    in the reference cell.  Of Cholesky's factor: sorted by degree, each of the polynomials is
    orthogonal to all before it.  Where one direction alone counts, in a sliver or under tension
    along it, rounding of the others is added lest the matrix be indefinite.
    """
    known = Polynomials.of(degree)
    n = len(known.coefficients)
    energy, inexact = np.zeros((len(slopes), n * n)), np.zeros((len(slopes), n))
    for weights, products in ((slopes, known.slopes), (curvatures, known.curvatures)):
        if weights is not None:
            energy += weights.reshape(len(weights), -1) @ products.reshape(-1, n * n)
            largest = np.abs(weights).max(axis=(1, 2))
            inexact += INEXACT * largest[:, None] * np.einsum("aann->n", products)
    energy = energy.reshape(-1, n, n)
    square = np.einsum("cnn->cn", energy)  # a view
    square += inexact
    # rigid motions have none
    size = np.sqrt(np.maximum(square, DEPENDENT * square.max(axis=1, keepdims=True)))
    scaled = energy / (size[:, :, None] * size[:, None, :])
    factor = np.swapaxes(_cholesky(scaled), 1, 2)
    return np.asarray(factor * size[:, None, :] @ known.coefficients)


def _cholesky(energy: np.ndarray) -> np.ndarray:
    """Factors (c, n, n) of energies, semidefinite to round-off: more so in long, thin cells."""
    more = DEPENDENT
    while True:
        try:
            return np.linalg.cholesky(energy + more * np.eye(energy.shape[1]))
        except np.linalg.LinAlgError:
            more *= 10


def tails(degree: int, factor: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Energies (3, m) of nodal values (c, n, m): beyond the degree k, beyond k - 1, and all of it.

    Extrapolated cell by cell: in a corner, where the solution is singular, it decays slowly.
    """
    squares = np.matmul(factor, local) ** 2
    found = np.array([squares[:, first:].sum(axis=1) for first in beyond(degree)])
    return np.array([extrapolated(found).sum(axis=0), found[0].sum(axis=0), squares.sum((0, 1))])


def beyond(degree: int) -> list[int]:
    """First polynomials beyond degree k - 1, k - 2 and k - 3."""
    kept = [max(degree - back, 0) for back in (1, 2, 3)]
    return [(k + 1) * (k + 2) // 2 for k in kept]


def extrapolated(tails: np.ndarray) -> np.ndarray:
    """What is beyond degree k, from what is beyond k - 1, k - 2 and k - 3, (3, ...).

    Even and odd degrees do not shrink the tail alike: the next shrinks it as the last but one.
    Tails end at degree k: where they decay as slowly as at a corner, as a power of the degree, most
    of the energy is beyond it.
    """
    last, longer, longest = tails
    ratio = np.divide(longer, longest, out=np.ones_like(last), where=longest > 0)
    return last * ratio / (1 - np.minimum(ratio, SLOWEST)) ** 3
