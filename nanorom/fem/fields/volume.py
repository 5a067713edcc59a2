"""Displacement gradients of a solid at quadrature points, many fields at once, and their work."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import basix
import numpy as np
from scipy.sparse import csr_matrix

from nanorom.fem.solvers import compat

CHUNK_ENTRIES = 2_000_000  # numbers that one array of a chunk of cells may have


@attrs.frozen(eq=False)
class CellGradients:
    """The reference basis on some cells of a solid.

    slopes: (3 q, n) of the scalar basis in the reference cell; inverse: (c, q, 3, 3) dX/dx;
    weights: (c, q); dofs: (c, n) nodes of each cell.
    """

    slopes: np.ndarray
    inverse: np.ndarray
    weights: np.ndarray
    dofs: np.ndarray

    def gradient(self, fields: np.ndarray) -> np.ndarray:
        """H[i, d] = du_i/dx_d (c, q, 3, 3, m) of displacements (nodes, 3, m), also complex."""
        c, q = self.weights.shape
        local = fields[self.dofs].reshape(c, self.dofs.shape[1], -1)
        found = np.matmul(self.slopes, local).reshape(c, 3, q, -1)
        found = np.matmul(self.inverse.swapaxes(2, 3), found.transpose(0, 2, 1, 3))
        return found.reshape(c, q, 3, *fields.shape[1:]).swapaxes(2, 3)

    def add_work(self, stress: np.ndarray, forces: np.ndarray) -> None:
        """Add int P : grad v of stresses P (c, q, 3, 3, m) to forces (nodes, 3, m)."""
        c, q = self.weights.shape
        n = self.dofs.shape[1]
        weighted = (self.weights[..., None, None] * self.inverse) @ stress.swapaxes(2, 3).reshape(
            c, q, 3, -1
        )
        columns = weighted.transpose(0, 2, 1, 3).reshape(c, 3 * q, -1)
        local = np.matmul(self.slopes.T, columns).reshape(c * n, -1)
        rows, place = np.unique(self.dofs.ravel(), return_inverse=True)
        gather = csr_matrix((np.ones(c * n), (place, np.arange(c * n))), (len(rows), c * n))
        forces[rows] += (gather @ local).reshape(len(rows), *forces.shape[1:])


@attrs.frozen(eq=False)
class Volume:
    """Quadrature of one degree on all cells that a rank owns.

    It keeps nothing but a table of the reference cell and the cells' maps.
    """

    whole: CellGradients

    @classmethod
    def of(cls, space: Any, degree: int, quadrature: int) -> Volume:
        """Of a space of displacements of a degree."""
        points, weights = map(np.asarray, basix.make_quadrature(TETRAHEDRON, quadrature))
        basis = np.asarray(compat.reference_element(degree, dimension=3).tabulate(1, points))
        basis = basis.reshape(4, len(points), -1)
        mesh = space.mesh
        cells = np.arange(mesh.topology.index_map(3).size_local)
        jacobian = map_cells(mesh, cells, points)[1]
        return cls(
            CellGradients(
                np.ascontiguousarray(basis[1:].reshape(3 * len(points), -1)),
                np.linalg.inv(jacobian),
                np.abs(np.linalg.det(jacobian)) * weights,
                compat.cell_dofs(space)[cells],
            )
        )

    def chunks(self, columns: int) -> Iterator[CellGradients]:
        """Some cells at a time, for that many numbers at every point."""
        whole = self.whole
        step = max(1, CHUNK_ENTRIES // (whole.weights.shape[1] * columns))
        for first in range(0, len(whole.weights), step):
            own = slice(first, first + step)
            yield attrs.evolve(
                whole,
                inverse=whole.inverse[own],
                weights=whole.weights[own],
                dofs=whole.dofs[own],
            )


TETRAHEDRON = basix.CellType.tetrahedron


def map_cells(mesh: Any, cells: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (c, q, 3) of reference points (q, 3) in cells, and Jacobians dx/dX (c, q, 3, 3)."""
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)[cells]]
    order = compat.degree_of(nodes.shape[1], 3)
    basis = np.asarray(compat.reference_element(order, True, 3).tabulate(1, points))
    basis = basis.reshape(4, len(points), -1)
    x = np.einsum("qn,cnd->cqd", basis[0], nodes, optimize=True)
    return x, np.einsum("kqn,cnd->cqdk", basis[1:], nodes, optimize=True)
