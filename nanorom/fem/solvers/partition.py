"""Which rank gets which cell: by place, the same in every run and in every group of ranks.

A graph partitioner that works in parallel cuts a mesh differently from run to run, and with it the
last digits of every sum.  Halving along the longer side is as good for a film, which is no maze.
"""

from __future__ import annotations

import numpy as np


def destinations(corners: np.ndarray, points: np.ndarray, ranks: int) -> list[np.ndarray]:
    """Ranks of every cell, its owner first, then those that own a neighbour across a facet.

    corners : (c, 3 or 4) vertices of triangles or tetrahedra; points : (n, d).
    """
    owner = np.zeros(len(corners), dtype=np.int32)
    if len(corners):
        _halve(points[corners].mean(axis=1), np.arange(len(corners)), 0, ranks, owner)
    first, second = neighbours(corners)
    cut = owner[first] != owner[second]
    first, second = first[cut], second[cut]
    found = [[rank] for rank in owner]
    for cell, other in zip(np.r_[first, second], owner[np.r_[second, first]]):
        if other not in found[cell]:
            found[cell].append(other)
    return [np.array(ranks, dtype=np.int32) for ranks in found]


def neighbours(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (f,), (f,) of triangles (c, 3) or tetrahedra (c, 4) that share a facet."""
    n = corners.shape[1]
    facets = [np.delete(np.arange(n), vertex) for vertex in range(n)]
    sides = np.sort(corners[:, facets].reshape(-1, n - 1), axis=1)
    order = np.lexsort(sides.T)
    same = np.flatnonzero((np.diff(sides[order], axis=0) == 0).all(axis=1))
    return order[same] // n, order[same + 1] // n


def _halve(
    middles: np.ndarray, cells: np.ndarray, first: int, ranks: int, owner: np.ndarray
) -> None:
    """Deal cells out to ``ranks`` ranks from the ``first`` one on."""
    if ranks == 1:
        owner[cells] = first
        return
    # no two cells may swap because of rounding: a lattice far coarser than it
    place = middles[cells]
    place = np.rint((place - place.min(axis=0)) / max(np.ptp(place, axis=0).max(), 1e-300) * 1e6)
    axis = int(np.argmax(np.ptp(place, axis=0)))
    order = np.lexsort((*np.delete(place, axis, axis=1).T, place[:, axis]))
    few = ranks // 2
    cut = len(cells) * few // ranks
    _halve(middles, cells[order[:cut]], first, few, owner)
    _halve(middles, cells[order[cut:]], first + few, ranks - few, owner)
