"""A fine triangulation of the film with the mode shapes on it, to draw and to animate."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.fields.places import lattice
from nanorom.fem.modes.deflections import Deflections

FEWEST_POINTS = 5_000  # high-order cells are large: linear triangles between them must not be
MOST_POINTS = 20_000  # beyond it the cells are drawn with fewer points each
MERGE = 1e-9  # of the film's size: nearer points are one


def triangulation(modes: Deflections) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (P, 3), triangles (C, 3) and shapes (L, P), the same on every rank. Collective."""
    film, comm = modes.film, modes.film.domain.comm
    n_cells = film.domain.mesh.topology.index_map(2).size_global
    cells = n_cells * film.mirrors.copies
    fineness = fineness_of(cells, film.degree)
    reference = lattice(fineness)
    dimension = film.domain.mesh.geometry.dim
    points, values = [np.empty((0, dimension))], [np.empty((0, modes.shapes.shape[1]))]
    for own, value in quadrature.values_at(film, reference, modes.shapes):
        places = quadrature.map_cells(film, own, reference)[0]
        points.append(places.reshape(-1, dimension))
        values.append(value.reshape(-1, modes.shapes.shape[1]))
    points_all = np.concatenate(comm.allgather(np.concatenate(points)))
    values_all = np.concatenate(comm.allgather(np.concatenate(values)))
    points_all, copied = film.mirrors.unfold(points_all, values_all.T, modes.parities)
    return joined(points_all, copied, fineness)


def fineness_of(cells: int, degree: int) -> int:
    """Parts of each side of so many triangles of a degree that are drawn."""
    fineness = max(degree, int(np.ceil(np.sqrt(2 * FEWEST_POINTS / cells))))
    while fineness > 1 and cells * fineness**2 / 2 > MOST_POINTS:
        fineness -= 1
    return fineness


def joined(
    points: np.ndarray, values: np.ndarray, fineness: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (P, 3), triangles (C, 3) and values (L, P) of lattices in triangles that meet.

    points (t * lattice, 2 or 3) and values (L, t * lattice), triangle after triangle.
    """
    low, size = points.min(axis=0), np.ptp(points, axis=0).max()
    grid = np.rint((points - low) / (MERGE * size)).astype(np.int64)
    first, number = _distinct(grid)
    small, in_lattice = _lattice_triangles(fineness), (fineness + 1) * (fineness + 2) // 2
    start = np.arange(len(points) // in_lattice)[:, None, None] * in_lattice
    triangles = np.sort(number[(start + small).reshape(-1, 3)], axis=1)
    triangles = triangles[_distinct(triangles)[0]]  # the same whatever the partition
    in_space = np.zeros((len(first), 3))
    in_space[:, : points.shape[1]] = points[first]
    return in_space, triangles.astype(np.int32), np.ascontiguousarray(values[:, first])


def _distinct(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First place of each distinct row of integers (n, d), in order, and each row's number."""
    order = np.lexsort(rows.T[::-1])
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (np.diff(rows[order], axis=0) != 0).any(axis=1)
    number = np.empty(len(rows), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return order[new], number


@lru_cache(maxsize=4)
def _lattice_triangles(n: int) -> np.ndarray:
    """Triangles (n^2, 3) between the points of `lattice`."""
    row = np.cumsum([0, *range(n + 1, 0, -1)])  # first point of row i
    triangles = []
    for i in range(n):
        for j in range(n - i):
            triangles.append((row[i] + j, row[i + 1] + j, row[i] + j + 1))
            if j < n - i - 1:
                triangles.append((row[i + 1] + j, row[i + 1] + j + 1, row[i] + j + 1))
    return np.array(triangles)
