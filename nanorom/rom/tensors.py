"""Coefficient tensors: their symmetry, and the paper's alpha_jk and b_jkl."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement, permutations
from math import factorial

import numpy as np

from nanorom.types import Array


def symmetrise(tensor: Array) -> Array:
    """Average T[r, j, k, ...] over the orders of all indices but r: the force stays the same.

    The result is symmetric to the last bit, and a symmetric tensor is returned as it is.
    """
    if all(_is_symmetric(part) for part in tensor):
        return tensor
    return np.array([_symmetrise_all(part) for part in tensor])


def _orders(part: Array) -> list[Array]:
    return [part.transpose(order) for order in permutations(range(part.ndim))]


def _is_symmetric(part: Array) -> bool:
    return all(np.array_equal(part, other) for other in _orders(part))


def _symmetrise_all(part: Array) -> Array:
    orders = _orders(part)
    # sums in different order differ in the last bit: let the sorted index stand for its kin
    indices = np.sort(np.indices(part.shape), axis=0)
    return np.asarray(np.mean(orders, axis=0)[tuple(indices)])


def asymmetry(tensor: Array) -> float:
    """Largest deviation from full symmetry relative to the largest entry; 0 for a potential.

    The tensor is symmetric in all indices but the first, or a matrix.
    """
    largest = max(float(tensor.max(initial=0.0)), -float(tensor.min(initial=0.0)))
    # mode by mode: of many modes, a copy of the whole tensor would be large
    deviation = max(
        (float(np.abs(tensor[r] - tensor[:, r]).max(initial=0.0)) for r in range(len(tensor))),
        default=0.0,
    )
    return deviation / largest if largest else 0.0


def condensed(pull: Array, compliance: Array) -> Array:
    """Cubic tensor (L, L, L, L) of what follows the modes statically.

    pull : (L, L, S), the force pull[j, k, s] q_j q_k on its coordinates; compliance : (S, S).  It
    takes 1/2 f G f of the energy away: -2 f_rj G f_kl, averaged over the ways to pair four modes.
    """
    return paired(np.einsum("rjs,st,klt->rjkl", pull, compliance, pull, optimize=True))


def paired(products: Array) -> Array:
    """-2 F averaged over the three ways to pair four modes, of products F (L, L, L, L) of pairs."""
    return -4 * symmetrised(products)


def symmetrised(products: Array) -> Array:
    """B = 1/2 G averaged over the three ways to pair four modes."""
    ways = products + products.transpose(0, 2, 1, 3) + products.transpose(0, 3, 2, 1)
    return np.asarray(ways / 6.0)


def unpacked(energy: np.ndarray, pairs: np.ndarray, products: np.ndarray) -> None:
    """Write products of pairs (p, p) to G[r, j, k, l], in both orders of every pair."""
    j, k = pairs.T
    for r, s in ((j, k), (k, j)):
        for t, u in ((j, k), (k, j)):
            products[r[:, None], s[:, None], t, u] = energy


def monomials(modes: int, degree: int) -> Iterator[tuple[tuple[int, ...], int]]:
    """0-based indices j <= k <= ... of each monomial, and in how many orders they occur."""
    for indices in combinations_with_replacement(range(modes), degree):
        orders = factorial(degree)
        for index in set(indices):
            orders //= factorial(indices.count(index))
        yield indices, orders


def monomial_coefficients(tensor: Array) -> list[tuple[tuple[int, ...], Array]]:
    """Indices j <= k (<= l) and coefficient of every mode (L,) for a quadratic or cubic force
    tensor.

    The coefficient of q_j q_k q_l collects all orders of the indices; monomials that vanish for all
    modes are left out.
    """
    size, order = tensor.shape[0], tensor.ndim - 1
    result = []
    for indices in combinations_with_replacement(range(size), order):
        total = np.zeros(size)
        for each in set(permutations(indices)):
            total += np.moveaxis(tensor, 0, -1)[each]
        if np.any(total):
            result.append((indices, total))
    return result
