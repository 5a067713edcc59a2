"""Places, areas and displacements on the faces of a solid's tetrahedra."""

from __future__ import annotations

from typing import Any

import attrs
import basix
import numpy as np
from scipy.sparse import csr_matrix

from nanorom.fem.fields import volume
from nanorom.fem.solvers import compat

CORNERS = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])


@attrs.frozen(eq=False)
class Faces:
    """Some outer faces that a rank has, at reference points of a triangle.

    cells: (f,); reference: (f, q, 3) in their cells; places: (f, q, 3); areas: (f, q, 3) along the
    outer normal, per area of the reference triangle.
    """

    space: Any
    cells: np.ndarray
    reference: np.ndarray
    places: np.ndarray
    areas: np.ndarray

    @classmethod
    def of(cls, space: Any, facets: np.ndarray, points: np.ndarray) -> Faces:
        """Of local facets of a solid's mesh, at points (q, 2); those of other ranks' cells not."""
        mesh = space.mesh
        topology = mesh.topology
        topology.create_connectivity(2, 3)
        topology.create_connectivity(3, 2)
        cells = compat.cells_at(mesh, facets)
        own = cells < topology.index_map(3).size_local
        cells, facets = cells[own], facets[own]
        around = topology.connectivity(3, 2).array.reshape(-1, 4)[cells]
        opposite = (around == facets[:, None]).argmax(axis=1)
        reference = np.empty((len(cells), len(points), 3))
        places, areas = np.empty_like(reference), np.empty_like(reference)
        for vertex in range(4):
            first, *others = CORNERS[np.delete(np.arange(4), vertex)]
            sides = np.array(others) - first
            at = first + points @ sides
            here = np.flatnonzero(opposite == vertex)
            x, jacobian = volume.map_cells(mesh, cells[here], at)
            along = jacobian @ sides.T
            normal = np.cross(along[..., 0], along[..., 1])
            inwards = jacobian @ (CORNERS[vertex] - first)
            outwards = -np.sign(np.sum(normal * inwards, axis=-1, keepdims=True))
            reference[here], places[here], areas[here] = at, x, outwards * normal
        return cls(space, cells, reference, places, areas)

    @classmethod
    def integrated(cls, space: Any, facets: np.ndarray, degree: int) -> tuple[Faces, np.ndarray]:
        """At the points of a quadrature of a degree, and its weights (q,)."""
        points, weights = basix.make_quadrature(basix.CellType.triangle, degree)
        return cls.of(space, facets, np.asarray(points)), np.asarray(weights)

    def displacements(self, fields: np.ndarray, degree: int) -> np.ndarray:
        """(f, q, 3, m) of displacements (nodes, 3, m) of a degree."""
        local = fields[compat.cell_dofs(self.space)[self.cells]]
        return np.einsum("fqn,fnim->fqim", self._basis(degree), local, optimize=True)

    def work(self, forces: np.ndarray, nodes: int, degree: int) -> np.ndarray:
        """What forces (f, q, 3) at the points do to the basis of a degree, (nodes, 3)."""
        found = np.zeros((nodes, 3))
        dofs = compat.cell_dofs(self.space)[self.cells]
        local = np.einsum("fqn,fqi->fni", self._basis(degree), forces, optimize=True)
        np.add.at(found, dofs.ravel(), local.reshape(-1, 3))
        return found

    def values(self, nodes: int, degree: int, axis: int) -> csr_matrix:
        """Displacements (f q, 3 nodes) along an axis at all points, of all nodes' components."""
        dofs = compat.cell_dofs(self.space)[self.cells]
        basis = self._basis(degree)
        f, q, n = basis.shape
        columns = np.repeat(3 * dofs[:, None] + axis, q, axis=1).ravel()
        rows = np.repeat(np.arange(f * q), n)
        return csr_matrix((basis.ravel(), (rows, columns)), (f * q, 3 * nodes))

    def _basis(self, degree: int) -> np.ndarray:
        """(f, q, n) at the points."""
        element = compat.reference_element(degree, dimension=3)
        count, q = self.reference.shape[:2]
        basis = np.asarray(element.tabulate(0, self.reference.reshape(-1, 3)))
        return basis.reshape(count, q, -1)
