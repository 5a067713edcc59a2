"""Fields of the film at quadrature points, all modes at once.

What the reduction needs of the modes beyond assembled operators (their gradients, the membrane
forces of every pair, moments, extrema) are dense products over the reference element, the same
for every cell; here they are done as such instead of one assembly per load case.
"""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import basix
import numpy as np

from nanorom.fem import compat
from nanorom.fem.plate import Plate

CHUNK_ENTRIES = 4_000_000  # floating-point numbers that one array of a chunk of cells may have


@attrs.frozen(eq=False)
class CellFields:
    """Tabulated basis on some cells.

    cells: (c,) local cells; weights: (c, q) integration weights; points: (c, q, 2);
    values: (q, n); gradients: (c, q, 2, n) of the scalar basis; dofs: (c, n).
    """

    cells: np.ndarray
    weights: np.ndarray
    points: np.ndarray
    values: np.ndarray
    gradients: np.ndarray
    dofs: np.ndarray

    def gradient(self, coefficients: np.ndarray) -> np.ndarray:
        """Gradients (c, q, 2, L) of fields with coefficients (local dofs, L)."""
        c, q, _, n = self.gradients.shape
        local = coefficients[self.dofs]  # (c, n, L)
        return np.matmul(self.gradients.reshape(c, 2 * q, n), local).reshape(c, q, 2, -1)

    def value(self, coefficients: np.ndarray) -> np.ndarray:
        """Values (c, q, L) of fields with coefficients (local dofs, L)."""
        return np.matmul(self.values, coefficients[self.dofs])


def owned_cells(plate: Plate) -> int:
    """Number of cells that this rank integrates over."""
    return plate.domain.mesh.topology.index_map(2).size_local


def fields(plate: Plate, degree: int, columns: int = 1) -> Iterator[CellFields]:
    """Tabulate the deflection basis at a quadrature of a degree, a chunk of cells at a time.

    ``columns`` is how many numbers per point the caller will hold; it sets the chunk's size.
    """
    points, weights = basix.make_quadrature(basix.CellType.triangle, degree)
    yield from fields_at(plate, np.asarray(points), np.asarray(weights), columns)


def fields_at(
    plate: Plate, points: np.ndarray, weights: np.ndarray, columns: int = 1
) -> Iterator[CellFields]:
    """The same at given reference points (q, 2) and weights (q,)."""
    n_dofs = compat.cell_dofs(plate.deflections).shape[1]
    step = max(1, CHUNK_ENTRIES // (len(weights) * max(2 * n_dofs, columns)))
    n_cells = owned_cells(plate)
    for first in range(0, n_cells, step):
        cells = np.arange(first, min(first + step, n_cells))
        yield tabulate(plate, cells, points, weights)


def tabulate(
    plate: Plate, cells: np.ndarray, points: np.ndarray, weights: np.ndarray
) -> CellFields:
    """Basis of the deflections at reference points (q, 2) of some cells."""
    basis = compat.reference_element(plate.degree).tabulate(1, points)
    basis = np.asarray(basis).reshape(3, len(points), -1)
    x, jacobian = map_cells(plate, cells, points)
    determinant = np.linalg.det(jacobian)
    inverse = np.linalg.inv(jacobian)  # dX/dx
    gradients = np.einsum("kqn,cqkd->cqdn", basis[1:], inverse, optimize=True)
    return CellFields(
        cells=cells,
        weights=np.abs(determinant) * weights,
        points=x,
        values=basis[0],
        gradients=np.ascontiguousarray(gradients),
        dofs=compat.cell_dofs(plate.deflections)[cells],
    )


def map_cells(
    plate: Plate, cells: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (c, q, 2) and Jacobians dx/dX (c, q, 2, 2) of the cells' maps."""
    mesh = plate.domain.mesh
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)[cells], :2]
    order = coordinate_order(nodes.shape[1])
    basis = compat.reference_element(order, equispaced=True).tabulate(1, points)
    basis = np.asarray(basis).reshape(3, len(points), -1)
    x = np.einsum("qn,cnd->cqd", basis[0], nodes, optimize=True)
    return x, np.einsum("kqn,cnd->cqdk", basis[1:], nodes, optimize=True)


def coordinate_order(n_nodes: int) -> int:
    """Order of a triangle's map with n nodes."""
    return int(round((np.sqrt(8 * n_nodes + 1) - 3) / 2))
