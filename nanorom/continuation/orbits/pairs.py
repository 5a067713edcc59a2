"""Matrices linear in the products q_j q_k of modal coordinates: what a cubic force consists of.

The force of a cubic tensor is G(q) q with G_ab = sum_jk B[a, b, j, k] q_j q_k. Two properties of
the tensors of real films save most of the multiplications: mirror symmetry lets a product act on
the entries of its own parity alone, so that the table of products by entries falls into blocks, and
a force with a potential makes G symmetric up to the modal masses, so that half the entries follow
from the other half. Both are found in the numbers themselves, none is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from nanorom.continuation.scaled import ScaledSystem, of_tensors
from nanorom.types import Array

Index = NDArray[np.intp]
WORTHWHILE = 0.75  # of the multiplications: blocks that save less are not worth their calls
SMALLEST_BLOCK = 24  # products; smaller blocks are joined, for a call costs as much
PROPORTIONAL = 1e-13  # of the largest entry: round-off of dividing by the masses


class PairMatrix:
    """G(q), flattened (N, L * L), as a linear function of the products q_j q_k (N, pairs).

    `first` and `second` tell the modes of every product, in the order of the blocks.
    """

    def __init__(self, tensor: Array) -> None:
        """tensor [j, k, a, b], symmetric in j, k."""
        if not tensor.any():  # of many modes its table alone would be large
            tensor = tensor[:1, :1]
        first, second = np.triu_indices(len(tensor))
        size = tensor.shape[2]
        table = by_pair(tensor, first, second)
        kept, self.source, self.factor = _independent(table, size)
        table = np.ascontiguousarray(table[:, kept])
        pairs, entries, cuts = _blocks(table)
        self.first, self.second = first[pairs], second[pairs]
        self.upper = self.first * len(tensor) + self.second
        table = table[np.ix_(pairs, entries)]
        self.blocks = [
            (rows, columns, np.ascontiguousarray(table[rows, columns])) for rows, columns in cuts
        ]
        place = np.empty(len(kept), dtype=np.intp)
        place[entries] = np.arange(len(entries))
        self.source = place[self.source]
        self.count = len(kept)
        self.plain = bool(
            len(self.blocks) == 1
            and self.count == size * size
            and (self.source == np.arange(size * size)).all()
        )

    def products(self, v: Array) -> Array:
        """q_j q_k (N, pairs) of coordinates (N, L)."""
        return np.asarray(v[:, self.first] * v[:, self.second])

    def of(self, v: Array) -> Array:
        """The matrices (N, L * L) at coordinates (N, L)."""
        return self(self.products(v))

    def of_squares(self, squares: Array) -> Array:
        """The matrices (N, L * L) for products (N, L * L) of all modes with all."""
        return self(squares.take(self.upper, axis=1))

    def of_mixed(self, one: Array, two: Array) -> Array:
        """The matrices (N, L * L) for products one_j two_k + two_j one_k of coordinates (N, L)."""
        products = one[:, self.first] * two[:, self.second]
        products += one[:, self.second] * two[:, self.first]
        return self(products)

    def any(self) -> bool:
        return any(bool(block.any()) for _, _, block in self.blocks)

    def __call__(self, products: Array) -> Array:
        """The matrices (N, L * L) of products (N, pairs)."""
        if self.plain:
            return np.asarray(products @ self.blocks[0][2])
        entries = np.empty((len(products), self.count), dtype=products.dtype)
        for rows, columns, block in self.blocks:
            np.matmul(products[:, rows], block, out=entries[:, columns])
        matrices = entries.take(self.source, axis=1)
        if self.factor is not None:
            matrices *= self.factor
        return matrices


@dataclass(frozen=True, eq=False)
class MovingModes:
    """The equations of the modes that move, with their nonlinear terms as matrices [l, r], the
    transposes of G and W.
    """

    system: ScaledSystem
    cubic: PairMatrix
    loss: PairMatrix


def moving_modes(system: ScaledSystem, modes: Index) -> MovingModes:
    """The part of a system that a set of modes makes; its matrices are found once, whatever the
    harmonics and the drive.
    """
    known, sub = of_tensors(system), system.restrict(modes)
    key = "moving", modes.tobytes()
    if key not in known:
        cubic = PairMatrix(sub.cubic.transpose(1, 2, 3, 0))
        known[key] = cubic, PairMatrix(sub.loss.transpose(2, 3, 1, 0))
    return MovingModes(sub, *known[key])


def by_pair(tensor: Array, first: Index, second: Index) -> Array:
    """A tensor [j, k, ...], symmetric in j, k, to multiply products q_j q_k of j <= k."""
    weight = np.where(first == second, 1.0, 2.0)[:, None]
    columns = int(np.prod(tensor.shape[2:]))
    return np.ascontiguousarray(weight * tensor[first, second].reshape(len(first), columns))


def _independent(table: Array, size: int) -> tuple[Index, Index, Array | None]:
    """The columns that are to be computed, which of them each entry follows from and by what
    factor (None: all ones).
    """
    every = np.arange(size * size)
    a, b = np.divmod(every, size)
    above = every[a < b]
    mirrored = b[above] * size + a[above]
    top = np.abs(table).max(initial=0.0)
    one, two = table[:, above], table[:, mirrored]
    squares = (one * one).sum(axis=0)
    factor = np.divide(
        (one * two).sum(axis=0), squares, out=np.zeros(len(above)), where=squares > 0
    )
    if np.abs(two - factor * one).max(initial=0.0) > PROPORTIONAL * top:
        return every, every, None
    kept = every[a <= b]
    position = np.zeros(size * size, dtype=np.intp)
    position[kept] = np.arange(len(kept))
    position[mirrored] = position[above]
    factors = np.ones(size * size)
    factors[mirrored] = factor
    return kept, position, None if (factors == 1.0).all() else factors


def _blocks(table: Array) -> tuple[Index, Index, list[tuple[slice, slice]]]:
    """Orders of the rows and columns that make a table block-diagonal, and the blocks."""
    count, width = table.shape
    rows, columns = np.nonzero(table)
    graph = coo_matrix((np.ones(len(rows)), (rows, columns + count)), shape=(count + width,) * 2)
    number, label = connected_components(graph, directed=False)
    sizes = np.bincount(label[:count], minlength=number)
    # components in order of their size, small ones joined
    order = np.argsort(-sizes, kind="stable")
    groups: list[list[int]] = []
    filled = SMALLEST_BLOCK
    for component in order:
        if filled >= SMALLEST_BLOCK:
            groups.append([])
            filled = 0
        groups[-1].append(int(component))
        filled += int(sizes[component])
    of_group = np.empty(number, dtype=np.intp)
    for place, members in enumerate(groups):
        of_group[members] = place
    group = of_group[label]
    heights = np.bincount(group[:count], minlength=len(groups))
    widths = np.bincount(group[count:], minlength=len(groups))
    if (heights * widths).sum() > WORTHWHILE * count * width:
        return np.arange(count), np.arange(width), [(slice(0, count), slice(0, width))]
    tops, lefts = np.append(0, heights.cumsum()), np.append(0, widths.cumsum())
    cuts = [
        (slice(tops[i], tops[i + 1]), slice(lefts[i], lefts[i + 1])) for i in range(len(groups))
    ]
    return (
        np.argsort(group[:count], kind="stable"),
        np.argsort(group[count:], kind="stable"),
        cuts,
    )
