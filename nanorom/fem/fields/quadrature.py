"""Fields of the film at quadrature points, all modes at once.

What the reduction needs of the modes beyond assembled operators (their gradients, the membrane
forces of every pair, moments, extrema) are dense products over the reference element, the same
for every cell; here they are done as such instead of one assembly per load case.
"""

from __future__ import annotations

from collections.abc import Iterator
from weakref import WeakKeyDictionary

import attrs
import basix
import numpy as np

from nanorom.fem.fields.surface import Surface
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.solvers import compat

CHUNK_ENTRIES = 1_000_000  # numbers that one array of a chunk of cells may have
KEPT_ENTRIES = 16_000_000  # numbers that the gradients of a table that is kept may have


@attrs.frozen(eq=False)
class CellFields:
    """Tabulated basis on some cells.

    cells: (c,) local cells; weights: (c, q) integration weights; points: (c, q, 2) in plan;
    values: (q, n); gradients: (c, q, d, n) of the scalar basis; dofs: (c, n).  d is 2 for a film;
    for a surface in space it is 3, and gradients are tangential.
    """

    cells: np.ndarray
    weights: np.ndarray
    points: np.ndarray
    values: np.ndarray
    gradients: np.ndarray
    dofs: np.ndarray

    def part(self, first: int, last: int) -> CellFields:
        """The same on some of the cells."""
        return attrs.evolve(
            self,
            cells=self.cells[first:last],
            weights=self.weights[first:last],
            points=self.points[first:last],
            gradients=self.gradients[first:last],
            dofs=self.dofs[first:last],
        )

    def gradient(self, coefficients: np.ndarray) -> np.ndarray:
        """Gradients (c, q, d, L) of fields with coefficients (local dofs, L)."""
        return self.cell_gradient(coefficients[self.dofs])

    def cell_gradient(self, local: np.ndarray) -> np.ndarray:
        """Gradients (c, q, d, L) of fields with coefficients (c, n, L) in each cell."""
        c, q, d, n = self.gradients.shape
        return np.matmul(self.gradients.reshape(c, d * q, n), local).reshape(c, q, d, -1)

    def value(self, coefficients: np.ndarray) -> np.ndarray:
        """Values (c, q, L) of fields with coefficients (local dofs, L)."""
        return np.matmul(self.values, coefficients[self.dofs])


def owned_cells(film: Surface) -> int:
    """Number of cells that this rank integrates over."""
    return film.domain.mesh.topology.index_map(2).size_local


def areas(film: Surface) -> np.ndarray:
    """Of this rank's own cells (c,)."""
    order = compat.degree_of(compat.cell_nodes(film.domain.mesh).shape[1])
    points, weights = map(np.asarray, basix.make_quadrature(basix.CellType.triangle, 2 * order))
    _, jacobian = map_cells(film, np.arange(owned_cells(film)), points)
    return np.asarray(np.abs(np.linalg.det(jacobian)) @ weights)


def fields(film: Surface, columns: int = 1) -> Iterator[CellFields]:
    """Tabulate the deflection basis at the plate's quadrature, a chunk of cells at a time.

    ``columns`` is how many numbers per point the caller will hold; it sets the chunk's size.
    The last table on a domain is kept for the next caller unless it is large.
    """
    rule = basix.make_quadrature(basix.CellType.triangle, film.stretching_degree)
    points, weights = np.asarray(rule[0]), np.asarray(rule[1])
    n_cells, n_dofs = owned_cells(film), compat.cell_dofs(film.deflections).shape[1]
    if 2 * n_cells * len(points) * n_dofs > KEPT_ENTRIES:
        yield from fields_at(film, points, weights, columns)
        return
    kind = film.degree, film.stretching_degree
    known, table = _kept.get(film.domain, (None, None))
    if known != kind or table is None:
        table = tabulate(film, np.arange(n_cells), points, weights)
        _kept[film.domain] = kind, table
    step = _cells_per_chunk(film, len(points), columns)
    for first in range(0, n_cells, step):
        yield table.part(first, first + step)


_kept: WeakKeyDictionary[Domain, tuple[tuple[int, int], CellFields]] = WeakKeyDictionary()


def _cells_per_chunk(film: Surface, n_points: int, columns: int) -> int:
    n_dofs = compat.cell_dofs(film.deflections).shape[1]
    return max(1, CHUNK_ENTRIES // (n_points * max(2 * n_dofs, columns)))


def fields_at(
    film: Surface,
    points: np.ndarray,
    weights: np.ndarray,
    columns: int = 1,
    cells: np.ndarray | None = None,
) -> Iterator[CellFields]:
    """The same at given reference points (q, 2) and weights (q,), of all cells or of some."""
    step = _cells_per_chunk(film, len(weights), columns)
    cells = np.arange(owned_cells(film)) if cells is None else cells
    for first in range(0, len(cells), step):
        yield tabulate(film, cells[first : first + step], points, weights)


def values_at(
    film: Surface, points: np.ndarray, shapes: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Cells (c,) and values (c, q, L) in them of shapes (local dofs, L) at reference points (q, 2).

    Of all owned cells, a chunk at a time.
    """
    basis = compat.reference_element(film.degree).tabulate(0, points)
    basis = np.asarray(basis).reshape(len(points), -1)
    dofs = compat.cell_dofs(film.deflections)[: owned_cells(film)]
    step = _cells_per_chunk(film, len(points), shapes.shape[1])
    for first in range(0, len(dofs), step):
        own = dofs[first : first + step]
        yield np.arange(first, first + len(own)), np.matmul(basis, shapes[own])


def tabulate(
    film: Surface, cells: np.ndarray, points: np.ndarray, weights: np.ndarray
) -> CellFields:
    """Basis of the deflections at reference points (q, 2) of some cells."""
    basis = compat.reference_element(film.degree).tabulate(1, points)
    basis = np.asarray(basis).reshape(3, len(points), -1)
    x, jacobian = map_cells(film, cells, points)
    if jacobian.shape[2] == 2:
        determinant = np.abs(np.linalg.det(jacobian))
        inverse = np.linalg.inv(jacobian)  # dX/dx
    else:
        metric = np.swapaxes(jacobian, 2, 3) @ jacobian
        determinant = np.sqrt(np.linalg.det(metric))
        inverse = np.linalg.solve(metric, np.swapaxes(jacobian, 2, 3))
    gradients = np.einsum("kqn,cqkd->cqdn", basis[1:], inverse, optimize=True)
    return CellFields(
        cells=cells,
        weights=determinant * weights,
        points=x[..., :2],
        values=basis[0],
        gradients=np.ascontiguousarray(gradients),
        dofs=compat.cell_dofs(film.deflections)[cells],
    )


def map_cells(
    film: Surface, cells: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (c, q, d) and Jacobians dx/dX (c, q, d, 2) of the cells' maps."""
    mesh = film.domain.mesh
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)[cells], : mesh.geometry.dim]
    order = compat.degree_of(nodes.shape[1])
    basis = compat.reference_element(order, equispaced=True).tabulate(1, points)
    basis = np.asarray(basis).reshape(3, len(points), -1)
    x = np.einsum("qn,cnd->cqd", basis[0], nodes, optimize=True)
    return x, np.einsum("kqn,cnd->cqdk", basis[1:], nodes, optimize=True)


def map_points(
    film: Surface, cells: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places (m, 2) and Jacobians (m, 2, 2) of a reference point (m, 2) in each of m cells."""
    mesh = film.domain.mesh
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)[cells], :2]
    order = compat.degree_of(nodes.shape[1])
    basis = compat.reference_element(order, equispaced=True).tabulate(1, points)
    basis = np.asarray(basis).reshape(3, *nodes.shape[:2])
    return np.einsum("mn,mnd->md", basis[0], nodes), np.einsum("kmn,mnd->mdk", basis[1:], nodes)
