"""Products with a periodic matrix function as blocks between groups of Fourier coefficients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nanorom.types import Array

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Group:
    """Rows (n,) of a basis in which the same modes (m,) are unknowns, their n m places among all,
    and which of the rows has the sine of each one's cosine, and the other way round.
    """

    rows: Index
    modes: Index
    place: slice
    partners: Index


@dataclass(frozen=True, eq=False)
class Between:
    """Of two groups: which Fourier coefficients of a matrix function, with which weights, make the
    blocks (rows, rows) between them.
    """

    one: Group
    two: Group
    index_a: Index
    index_b: Index
    weight_a: Array
    weight_b: Array

    def of(self, coefficients: Array) -> Array:
        """The operator phi_j -> projection of g phi_j, indexed [j, i, l, r], for j, l of one group
        and i, r of the other; `coefficients` (F, L, L) are those of g.
        """
        some = coefficients[:, self.one.modes[:, None], self.two.modes]
        blocks = some[self.index_a]
        blocks *= self.weight_a
        other = some[self.index_b]
        other *= self.weight_b
        blocks += other
        return np.asarray(blocks)


class Products:
    """g(theta) phi_j projected on phi_i = weight_a g_hat[index_a] + weight_b g_hat[index_b], arrays
    [j, i] for the rows (n,) of a basis and the numbers (n,) of their harmonics.
    """

    def __init__(self, rows: Index, number: Index) -> None:
        sine = (rows > 0) & (rows % 2 == 0)
        kj, ki = number[:, None], number[None, :]
        sj, si = sine[:, None], sine[None, :]
        total, gap = ki + kj, np.abs(ki - kj)
        odd = sj ^ si
        self.index_a = np.where(odd, 2 * total, np.maximum(2 * total - 1, 0))
        self.index_b = np.where(odd, 2 * gap, np.maximum(2 * gap - 1, 0))
        weight_a = np.where(sj & si, -0.5, 0.5)
        sign = np.where(si, np.sign(ki - kj), np.sign(kj - ki))
        weight_b = np.where(odd, 0.5 * sign, 0.5)
        constant = np.where(ki == 0, 0.5, 1.0)
        self.weight_a = weight_a * constant
        self.weight_b = weight_b * constant

    def between(self, one: Group, two: Group) -> Between:
        """Those of two groups."""
        which = np.ix_(one.rows, two.rows)
        weights = (weight[which][..., None, None] for weight in (self.weight_a, self.weight_b))
        return Between(one, two, self.index_a[which], self.index_b[which], *weights)
