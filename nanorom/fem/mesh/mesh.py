"""Meshes: a shape or a gmsh file in, a distributed DOLFINx mesh with tagged boundary out.

Straight triangles are made on rank 0 only; the nodes of higher order are placed by
`nanorom.fem.mesh.curved` on the true curves of the geometry, whatever the order.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, TypeVar

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import NanoromError
from nanorom.fem.mesh import kept
from nanorom.fem.mesh.arrays import MeshData, Placement, Source
from nanorom.fem.mesh.corners import Corners
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Mirrors

Made = TypeVar("Made")


@attrs.frozen(eq=False)
class Domain:
    """A distributed mesh and its boundary: physical curve (of solids: surface) -> local facets.

    surfaces: physical surface -> which local cells (c,) are of it; across: the ranks that hold the
    same part of it in other groups of ranks; made: what was made on it for every film to come, by
    what it is, None where no other film comes.
    """

    mesh: Any
    facets: Mapping[str, np.ndarray]
    across: MPI.Comm = MPI.COMM_SELF
    surfaces: Mapping[str, np.ndarray] = attrs.field(factory=dict)
    made: kept.Made | None = None

    @property
    def comm(self) -> MPI.Comm:
        return self.mesh.comm

    def once(self, what: Hashable, make: Callable[[], Made]) -> Made:
        """What no number of a film changes, made for the first one alone if others come."""
        if self.made is None:
            return make()
        if what not in self.made:
            self.made[what] = make()
        found: Made = self.made[what]
        return found

    def facets_of(self, names: list[str]) -> np.ndarray:
        """Local facets that carry any of the names, sorted."""
        found = [self.facets[name] for name in names]
        return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=np.int32)


def build(
    comm: MPI.Comm,
    source: Source,
    order: int = 1,
    unfold: Mirrors | None = None,
    corners: Corners | None = None,
    place: Placement | None = None,
) -> Domain:
    """Mesh a shape or read a file, and distribute it. Collective.

    ``order`` is that of the cells' map (a ``.msh`` keeps its own); ``unfold`` names the mirrors by
    which the part that is meshed makes the whole film; ``corners`` grades cells where the support
    changes; ``place`` puts the points (n, 2) of a flat mesh on a surface in space (n, 3).  Raises
    MeshError on every rank alike.
    """
    unfold = unfold or Mirrors()
    what = source, order, unfold, corners
    large = source.cells is None or source.cells > kept.MOST_CELLS  # or of a file, which may change
    if large or corners is not None or place is not None or comm.size > 1:
        return _built(comm, *what, place)
    return kept.found(what, lambda made: attrs.evolve(_built(comm, *what, None), made=made))


def _built(
    comm: MPI.Comm,
    source: Source,
    order: int,
    unfold: Mirrors,
    corners: Corners | None,
    place: Placement | None,
) -> Domain:
    """The same, made anew. Collective."""
    data: MeshData | NanoromError | None = None
    if comm.rank == 0:
        try:
            data = source.mesh(order, corners).unfolded(unfold)
            if place is not None:
                data = data.placed(place)
        except NanoromError as error:
            data = error
    data = comm.bcast(data if isinstance(data, NanoromError) else None) or data
    if isinstance(data, NanoromError):
        raise data
    return distribute(comm, data)


def distribute(comm: MPI.Comm, data: MeshData | None) -> Domain:
    """Spread the mesh of rank 0 over the ranks and find its tagged facets. Collective."""
    order = comm.bcast(data.order if data else None)
    facets = comm.bcast(dict(data.facets) if data else None)
    surfaces = comm.bcast(dict(data.surfaces) if data else None)
    components, n_nodes, dimension = comm.bcast(
        (data.points.shape[1], data.cells.shape[1], data.dimension) if data else None
    )
    cells = data.cells if data else np.empty((0, n_nodes), dtype=np.int64)
    points = data.points if data else np.empty((0, components))
    mesh = compat.create_mesh(comm, cells, points, order, dimension)
    cell = compat.input_cells(mesh)
    tagged = {name: inside[cell] for name, inside in surfaces.items()}
    return Domain(mesh, local_facets(mesh, facets), surfaces=tagged)


def local_facets(mesh: Any, tagged: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Local facets of each name, found by the input numbers of their vertices."""
    topology, dimension = mesh.topology, mesh.topology.dim
    topology.create_connectivity(dimension, dimension - 1)
    topology.create_connectivity(dimension - 1, dimension)
    n = dimension + 1  # facets of a cell, each opposite to a vertex
    index_map = topology.index_map(dimension)
    n_cells = index_map.size_local + index_map.num_ghosts
    facets = topology.connectivity(dimension, dimension - 1).array[: n * n_cells]
    corners = compat.input_nodes(mesh)[compat.cell_nodes(mesh)[:, :n]]
    opposite = [np.delete(np.arange(n), vertex) for vertex in range(n)]
    ends = np.sort(corners[:, opposite], axis=2).reshape(-1, dimension)
    lookup = dict(zip(map(tuple, ends.tolist()), facets.tolist()))
    found = {}
    for name, sides in tagged.items():
        hits = [lookup.get(tuple(side)) for side in np.sort(sides, axis=1).tolist()]
        found[name] = np.unique(np.array([h for h in hits if h is not None], dtype=np.int32))
    return found
