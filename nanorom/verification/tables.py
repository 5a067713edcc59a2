"""Basis functions of a plate's mesh as plain arrays, and what is integrated with them."""

from __future__ import annotations

import attrs
import numpy as np
import scipy.sparse as sp

from nanorom.types import Array


@attrs.frozen(eq=False)
class Laws:
    """What a film resists stretching with, per E h: laws (n, 3, 3), and which (c,) of them each
    cell has.
    """

    laws: Array
    which: np.ndarray

    @property
    def by_cell(self) -> Array:
        """(c, 3, 3)."""
        return self.laws[self.which]

    def stress(self, strain: Array) -> Array:
        """C:E (3, ..., c, q, m) of strains alike."""
        engineering = self.laws * [1.0, 1.0, 2.0]
        found = np.tensordot(engineering[0], strain, axes=1)
        for number, law in enumerate(engineering[1:], 1):
            own = self.which == number
            found[..., own, :, :] = np.tensordot(law, strain[..., own, :, :], axes=1)
        return found


@attrs.frozen(eq=False)
class Tables:
    """Basis functions at the quadrature points of all cells, and what they belong to.

    gradients (c, 2 q, n): d/dx at all points, then d/dy; values (q, n); weights (c, q); dofs,
    in_plane (c, n): nodes of the deflection and of the in-plane displacement; nodes: their number.
    """

    gradients: Array
    values: Array
    weights: Array
    dofs: np.ndarray
    in_plane: np.ndarray
    nodes: int
    transposed: Array = attrs.field(init=False)
    gather: sp.csr_matrix = attrs.field(init=False)
    gather_in_plane: sp.csr_matrix = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        swapped = np.ascontiguousarray(self.gradients.transpose(0, 2, 1))
        object.__setattr__(self, "transposed", swapped)
        object.__setattr__(self, "gather", _gathering(self.dofs, self.nodes))
        object.__setattr__(self, "gather_in_plane", _gathering(self.in_plane, self.nodes))

    def gradient(self, local: Array) -> Array:
        """Gradients (2, c, q, m) of fields with coefficients (c, n, m) in each cell."""
        c, q = self.weights.shape
        found = np.matmul(self.gradients, local).reshape(c, 2, q, -1)
        return np.moveaxis(found, 1, 0)

    def slope(self, nodal: Array) -> Array:
        """Gradients (2, c, q, m) of deflections (nodes, m)."""
        return self.gradient(nodal[self.dofs])

    def work(self, x: Array, y: Array, gather: sp.csr_matrix) -> Array:
        """int (x, y) . grad v (nodes, m) of weighted vector fields (c, q, m) each."""
        c, q, m = x.shape
        both = np.concatenate([x, y], axis=1)
        return np.asarray(gather @ np.matmul(self.transposed, both).reshape(-1, m))

    def value(self, nodal: Array) -> Array:
        """Values (c, q, m) of deflections (nodes, m)."""
        return np.matmul(self.values, nodal[self.dofs])

    def push(self, pressure: Array) -> Array:
        """int p v (nodes, m) of weighted pressures (c, q, m)."""
        local = np.matmul(self.values.T, pressure)
        return np.asarray(self.gather @ local.reshape(-1, pressure.shape[-1]))


def _gathering(dofs: np.ndarray, nodes: int) -> sp.csr_matrix:
    """Sums entries of cells (c n,) to nodes."""
    entries = dofs.size
    return sp.csr_matrix((np.ones(entries), (dofs.ravel(), np.arange(entries))), (nodes, entries))


def stretching(
    tables: Tables, shape: Array, laws: Laws, free: np.ndarray, in_plane: np.ndarray, held: bool
) -> sp.csc_matrix:
    """Linear stretching of a film that is not flat: (w, u) on free unknowns, u unrolled.

    1/2 int E:C:E of E = sym grad u + sym(grad w0 (x) grad w); the prestress is in the stiffness.
    held : the in-plane displacement is zero, and has no unknowns.
    """
    c, q = tables.weights.shape
    n = tables.dofs.shape[1]
    gradients = tables.gradients.reshape(c, 2, q, n).transpose(0, 2, 1, 3)
    slope = tables.slope(shape[:, None])[..., 0].transpose(1, 2, 0)
    strain = np.zeros((c, q, 3, 3 * n))  # xx, yy, 2 xy of (w, u_x, u_y)
    x, y = gradients[:, :, 0], gradients[:, :, 1]
    s, t = slope[..., 0, None], slope[..., 1, None]
    strain[:, :, 0, :n], strain[:, :, 1, :n], strain[:, :, 2, :n] = s * x, t * y, s * y + t * x
    strain[:, :, 0, n : 2 * n], strain[:, :, 2, n : 2 * n] = x, y
    strain[:, :, 1, 2 * n :], strain[:, :, 2, 2 * n :] = y, x
    weighted = np.einsum("cq,cab,cqbn->cqan", tables.weights, laws.by_cell, strain, optimize=True)
    rows = strain.reshape(c, 3 * q, 3 * n).transpose(0, 2, 1)
    local = np.matmul(rows, weighted.reshape(c, 3 * q, 3 * n))
    place = np.concatenate(
        [tables.dofs, tables.nodes + 2 * tables.in_plane, tables.nodes + 2 * tables.in_plane + 1],
        axis=1,
    )
    row = np.repeat(place, 3 * n, axis=1).ravel()
    column = np.tile(place, (1, 3 * n)).ravel()
    size = 3 * tables.nodes
    whole = sp.csc_matrix((local.ravel(), (row, column)), (size, size))
    kept = free if held else np.concatenate([free, tables.nodes + in_plane])
    return whole[kept][:, kept]


def geometric(tables: Tables, force: Array, free: np.ndarray) -> sp.csr_matrix:
    """int N : grad w (x) grad v on free unknowns, of a membrane force N (3, c, q)."""
    c, q = tables.weights.shape
    n = tables.dofs.shape[1]
    gradients = tables.gradients.reshape(c, 2, q, n)
    xx, yy, xy = force * tables.weights
    pulled = np.empty_like(gradients)
    pulled[:, 0] = xx[..., None] * gradients[:, 0] + xy[..., None] * gradients[:, 1]
    pulled[:, 1] = xy[..., None] * gradients[:, 0] + yy[..., None] * gradients[:, 1]
    local = np.matmul(tables.transposed, pulled.reshape(c, 2 * q, n))
    row = np.repeat(tables.dofs, n, axis=1).ravel()
    column = np.tile(tables.dofs, (1, n)).ravel()
    size = (tables.nodes, tables.nodes)
    return sp.csr_matrix((local.ravel(), (row, column)), size)[free][:, free]
