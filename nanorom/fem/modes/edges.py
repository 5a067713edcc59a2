"""How much room there is about a point of the film for waves that solve its equation.

Beyond the held edge of a convex film a mode can be continued some way.  Not past an edge that is
hollow, of a hole or a corner that reaches in: behind it the mode is singular.  And at a free edge,
where its peak may lie, one side alone says too little: there the shape's own value counts.
"""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.fem.fields import quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import line

CONVEX = 1e-9  # of the area: what the convex hull of a convex film may have beyond it


@attrs.frozen(eq=False)
class Room:
    """Distances (n,) of points from the film's edge, and how wide a disc about each may be."""

    inside: np.ndarray
    widest: np.ndarray


def room(plate: Plate, places: np.ndarray) -> Room:
    """Room about points (n, 2). Collective."""
    surface = plate.domain.mesh
    mirrors = plate.domain.facets_of([line(axis) for axis in plate.mirrors.axes])
    edge = np.setdiff1d(compat.exterior_facets(surface), mirrors)
    inside = _away(plate, edge, places)
    vertices = compat.cell_nodes(surface)[: quadrature.owned_cells(plate), :3]
    corners = surface.geometry.x[vertices, :2]
    area = 0.5 * np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum()
    area = plate.mirrors.copies * plate.domain.comm.allreduce(area, op=MPI.SUM)
    if _hull(_points(plate, edge)) > (1 + CONVEX) * area:
        return Room(inside, inside)
    return Room(inside, _away(plate, np.setdiff1d(edge, plate.held), places))


def _hull(points: np.ndarray) -> float:
    """Area of the convex hull of points (n, 2), by Andrew's two chains (Qhull writes files)."""
    ordered = np.unique(points, axis=0).tolist()
    x, y = np.array(_chain(ordered)[:-1] + _chain(ordered[::-1])[:-1]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _chain(ordered: list[list[float]]) -> list[list[float]]:
    """Those of points, ordered along x, between which the chain turns left alone."""
    chain: list[list[float]] = []
    for x, y in ordered:
        while len(chain) > 1:
            (x0, y0), (x1, y1) = chain[-2:]
            if (x1 - x0) * (y - y0) > (y1 - y0) * (x - x0):
                break
            chain.pop()
        chain.append([x, y])
    return chain


def _away(plate: Plate, facets: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, 2) from facets, infinite where there are none. Collective."""
    nodes = _points(plate, facets)
    if not len(nodes):
        return np.full(len(places), np.inf)
    return np.asarray(np.linalg.norm(places[:, None] - nodes, axis=2).min(axis=1))


def _points(plate: Plate, facets: np.ndarray) -> np.ndarray:
    """Ends (m, 2) of facets, of all ranks and of the whole film. Collective."""
    surface = plate.domain.mesh
    ends = compat.facet_vertices(surface, facets) if len(facets) else np.empty(0, dtype=int)
    nodes = surface.geometry.x[np.unique(ends), :2]
    nodes, _ = plate.mirrors.unfold(nodes, np.empty((0, len(nodes))), [])
    return np.concatenate(plate.domain.comm.allgather(nodes))
