"""Directions in which branches leave a bifurcation: null vectors of the harmonic balance.

A direction outside the parent's support breaks a symmetry. Where several multipliers are critical
at once there is a space of them; those that take part in fewest modes, and the diagonals between
them, are the candidates (for pairs of modes: along the axes, and between). Inside the support the
direction is that null vector of the balance and its rate that is normal to the parent. Source:
Golubitsky, Stewart and Schaeffer 1988, doi:10.1007/978-1-4612-4574-2.
"""

from __future__ import annotations

import numpy as np

from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.continuation.orbits.harmonics import Support, basis_for, full_support, stretch
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array

SHIFT = 1e-12  # of the matrix, which is singular at the very point
ITERATIONS = 4  # of the inverse power method: one would do but for an unlucky start
ZERO = 1e-6  # of a direction: entries that are round-off of zero


def stretched(orbit: Orbit, factor: int) -> Orbit:
    """The same orbit described with a period `factor` times as long."""
    coefficients = stretch(orbit.coefficients, factor)
    return Orbit(coefficients, orbit.rate / factor, orbit.period_multiple * factor)


def shortened(orbit: Orbit, factor: int) -> Orbit:
    """An orbit that repeats itself `factor` times, described with its own period."""
    numbers = (np.arange(len(orbit.coefficients)) + 1) // 2
    kept = orbit.coefficients[numbers % factor == 0]
    return Orbit(kept, orbit.rate * factor, orbit.period_multiple // factor)


def fixed_space(system: ScaledSystem, parent: Support, orbit: Orbit, kind: Kind) -> Support:
    """Orbits that keep the symmetry to be broken: of a period doubling, all of half the period."""
    if kind.period_factor > 1:
        return full_support(system, orbit.period_multiple).stretch(kind.period_factor)
    return parent


def breaking(
    system: ScaledSystem, parent: Support, orbit: Orbit, kind: Kind, multiplicity: int
) -> tuple[list[Array], float]:
    """Directions (2H + 1, L) out of the fixed space, and how far from singular the balance is."""
    whole = stretched(orbit, kind.period_factor)
    harmonics = (len(whole.coefficients) - 1) // 2
    basis = basis_for(full_support(system, whole.period_multiple), harmonics, whole.period_multiple)
    fixed = fixed_space(system, parent, orbit, kind).rows_mask(harmonics)
    outside = np.flatnonzero(~fixed.ravel())
    if len(outside) < multiplicity:
        return [], np.inf
    balance = HarmonicBalance(system, basis)
    matrix = balance.jacobian_t(basis.compress(whole.coefficients), whole.rate).T
    vectors, size = _null_space(matrix[np.ix_(outside, outside)], multiplicity)
    grids = np.zeros((multiplicity, matrix.shape[0]))
    grids[:, outside] = vectors.T
    directions = grids.reshape(multiplicity, 2 * harmonics + 1, system.size)
    return _candidates(list(directions)), size


def crossing(
    system: ScaledSystem, parent: Support, orbit: Orbit, tangent: Array
) -> tuple[Array, float, float]:
    """The direction (2H + 1, L) and its rate inside the parent's support, normal to its tangent,
    and how far from singular the balance is.

    tangent (n + 1,) : of the parent, on the unknowns of its support with the orbit's harmonics
    """
    harmonics = (len(orbit.coefficients) - 1) // 2
    basis = basis_for(parent, harmonics, orbit.period_multiple)
    balance = HarmonicBalance(system, basis)
    x = basis.compress(orbit.coefficients)
    n = basis.size
    matrix = np.empty((n + 1, n + 1))
    matrix[:n, :n] = balance.jacobian_t(x, orbit.rate).T
    matrix[:n, n] = basis.pack(balance.rate_derivative(x, orbit.rate))
    matrix[n] = tangent
    vectors, size = _null_space(matrix, 1)
    length = float(np.linalg.norm(vectors[:n, 0]))
    if length < ZERO:  # rest, where only the rate changes
        return np.zeros_like(orbit.coefficients), 0.0, np.inf
    direction = vectors[:, 0] / length
    return basis.expand(basis.unpack(direction[:n]), system.size), float(direction[n]), size


def _null_space(matrix: Array, count: int) -> tuple[Array, float]:
    """Vectors (n, count) that the matrix all but annihilates, and the size of what is left."""
    scale = np.abs(matrix).max()
    shifted = matrix + SHIFT * scale * np.eye(len(matrix))
    # any start that is not orthogonal
    vectors = np.cos(1.0 + np.outer(np.arange(len(matrix)), 1.0 + np.sqrt(np.arange(count))))
    for _ in range(ITERATIONS):
        vectors = np.linalg.qr(np.linalg.solve(shifted, vectors))[0]
    return vectors, float(np.linalg.norm(matrix @ vectors, axis=0).max() / scale)


def _candidates(directions: list[Array]) -> list[Array]:
    """Vectors of the space spanned that leave one mode each, and the diagonals of two of them."""
    count, space = len(directions), np.stack(directions)
    if count == 1:
        return [_cleaned(directions[0])]
    sparse: list[Array] = []
    for mode in np.argsort(-np.linalg.norm(space, axis=(0, 1))):
        combination = np.linalg.svd(space[:, :, mode].T)[2][-1]
        found = _cleaned(np.tensordot(combination, space, axes=1))
        if all(abs(float((found * other).sum())) < 1 - ZERO for other in sparse):
            sparse.append(found)
        if len(sparse) == count:
            break
    if len(sparse) == 2:
        one, two = sparse
        return [one, two, _cleaned(one + two), _cleaned(one - two)]
    return sparse


def _cleaned(direction: Array) -> Array:
    kept = np.where(np.abs(direction) > ZERO * np.abs(direction).max(), direction, 0.0)
    return np.asarray(kept / np.linalg.norm(kept))
