"""Where the tetrahedra of a solid come from: a flat shape made thick, or a file with volumes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.errors import MeshError
from nanorom.fem.mesh import gmsh as gmshs
from nanorom.fem.mesh import tetrahedra
from nanorom.fem.mesh.arrays import MeshData, Source
from nanorom.fem.mesh.corners import Corners

HIGHEST_ORDER = 4  # of curved tetrahedra


@attrs.frozen
class Thick:
    """A flat shape made thick, in layers of cells; lengths in one unit."""

    film: Source
    thickness: float
    layers: int

    @property
    def name(self) -> str:
        return f"thick {self.film.name}"

    @property
    def cells(self) -> int | None:
        flat = self.film.cells
        return None if flat is None else 3 * self.layers * flat

    def mesh(self, order: int, corners: Corners | None = None) -> MeshData:
        """Its tetrahedra of an order; raises MeshError."""
        return tetrahedra.thickened(self.film.mesh(order), self.thickness, self.layers)


@attrs.frozen
class SolidFile:
    """A ``.geo`` with its parameters or a ``.msh`` of volumes; of a flat one, made thick.

    size_factor: of the cells that the file asks for; thickness, in its unit, and layers: of a flat
    one alone.
    """

    path: Path
    parameters: Mapping[str, float] = attrs.field(factory=dict)
    size_factor: float = 1.0
    thickness: float = 1.0
    layers: int = 1

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def cells(self) -> None:
        return None

    def mesh(self, order: int, corners: Corners | None = None) -> MeshData:
        """Run gmsh on the file; one process only. Raises MeshError with gmsh's last message."""
        with gmshs.opened(self.path, self.parameters, self.size_factor) as gmsh:
            if len(gmsh.model.mesh.getNodes()[0]) == 0 and gmsh.model.getEntities(3):
                gmsh.model.mesh.generate(3)
                gmsh.model.mesh.setOrder(min(order, HIGHEST_ORDER))
            if len(gmsh.model.mesh.getElements(3)[0]):
                return _read(gmsh, self.path)
        flat = gmshs.GmshFile(self.path, self.parameters, self.size_factor)
        return Thick(flat, self.thickness, self.layers).mesh(order)


def _read(gmsh: Any, file: Path) -> MeshData:
    """Tetrahedra of any order as they stand in gmsh's model."""
    types, _, node_lists = gmsh.model.mesh.getElements(3)
    if len(types) > 1:
        names = ", ".join(gmsh.model.mesh.getElementProperties(t)[0] for t in types)
        raise MeshError(f"{file}: elements of several kinds ({names}); give tetrahedra alone")
    name, _, order, n_nodes, local, _ = gmsh.model.mesh.getElementProperties(types[0])
    if not name.startswith("Tetrahedron") or order > HIGHEST_ORDER:
        raise MeshError(
            f"{file}: elements are {name}; give tetrahedra of order 1 to {HIGHEST_ORDER}"
        )
    tags, places, _ = gmsh.model.mesh.getNodes()
    used = np.unique(node_lists[0])
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[used.astype(np.int64)] = np.arange(len(used))
    own = number[tags.astype(np.int64)]
    points = np.empty((len(used), 3))
    points[own[own >= 0]] = np.reshape(places, (-1, 3))[own >= 0]
    if not np.isfinite(points).all():
        raise MeshError(f"{file}: a node's coordinates are not finite; mend the mesh")
    ours = tetrahedra.barycentric(order)[:, 1:]
    theirs = np.reshape(local, (n_nodes, 3))
    order_of = np.linalg.norm(ours[:, None] - theirs[None], axis=2).argmin(axis=1)
    cells = number[np.reshape(node_lists[0], (-1, n_nodes)).astype(np.int64)][:, order_of]
    data = MeshData(points, cells, int(order), _faces(gmsh, number), dimension=3)
    return tetrahedra.oriented(data, str(file))


def _faces(gmsh: Any, number: np.ndarray) -> dict[str, np.ndarray]:
    """Vertex triples (m, 3) of every physical surface, by its name."""
    found: dict[str, np.ndarray] = {}
    for dimension, group in gmsh.model.getPhysicalGroups(2):
        corners = []
        for tag in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            for kind, _, nodes in zip(*gmsh.model.mesh.getElements(2, tag)):
                n_nodes = gmsh.model.mesh.getElementProperties(kind)[3]
                corners.append(np.reshape(nodes, (-1, n_nodes))[:, :3].astype(np.int64))
        name = gmsh.model.getPhysicalName(dimension, group) or str(group)
        found[name] = number[np.concatenate(corners)] if corners else np.empty((0, 3), np.int64)
    return found
