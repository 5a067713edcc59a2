"""How much room there is about a point of the film for waves that solve its equation.

Beyond the edge of a convex film a mode can be continued some way.  Not past an edge that is hollow,
of a hole or a corner that reaches in: what it does there is singular behind the edge.
"""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI
from scipy.spatial import ConvexHull

from nanorom.fem.fields import quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import line

CONVEX = 1e-9  # of the area: what the convex hull of a convex film may have beyond it


@attrs.frozen(eq=False)
class Room:
    """Distances (n,) of points from the film's edge; whether the film is convex."""

    inside: np.ndarray
    convex: bool


def room(plate: Plate, places: np.ndarray) -> Room:
    """Room about points (n, 2). Collective."""
    surface = plate.domain.mesh
    mirrors = plate.domain.facets_of([line(axis) for axis in plate.mirrors.axes])
    edge = np.setdiff1d(compat.exterior_facets(surface), mirrors)
    nodes = surface.geometry.x[np.unique(compat.facet_vertices(surface, edge)), :2]
    nodes, _ = plate.mirrors.unfold(nodes, np.empty((0, len(nodes))), [])
    nodes = np.concatenate(plate.domain.comm.allgather(nodes))
    inside = np.linalg.norm(places[:, None] - nodes, axis=2).min(axis=1)
    vertices = compat.cell_nodes(surface)[: quadrature.owned_cells(plate), :3]
    corners = surface.geometry.x[vertices, :2]
    area = 0.5 * np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum()
    area = plate.mirrors.copies * plate.domain.comm.allreduce(area, op=MPI.SUM)
    return Room(inside, bool(ConvexHull(nodes).volume <= (1 + CONVEX) * area))
