"""The film in its plane, at quadrature points: strains, membrane forces, and the loads they make.

Components are (xx, yy, xy) with xy the tensor's shear; displacements and loads have one column per
load case.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import fem
from scipy.sparse import csr_matrix

from nanorom.fem.fields import holding, quadrature
from nanorom.fem.fields.holding import Constraints
from nanorom.fem.fields.surface import Membrane
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import AXES, Parity


def slope_product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """sym(grad w1 (x) grad w2), components (3, ...), of slopes (2, ...)."""
    (x1, y1), (x2, y2) = first, second
    return np.stack([x1 * x2, y1 * y2, 0.5 * (x1 * y2 + y1 * x2)])


def strain(plate: Membrane, field: quadrature.CellFields, displacement: np.ndarray) -> np.ndarray:
    """sym grad u, components (3, c, q, m), of displacements (local dofs, m)."""
    dofs = compat.cell_dofs(plate.in_plane)[field.cells]
    return strain_of_cells(field, displacement[2 * dofs], displacement[2 * dofs + 1])


def strain_of_cells(field: quadrature.CellFields, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """sym grad u, components (3, c, q, m), of cell coefficients (c, n, m) along x and y."""
    (u_x, u_y), (v_x, v_y) = (np.moveaxis(field.cell_gradient(a), 2, 0) for a in (u, v))
    return np.stack([u_x, v_y, 0.5 * (u_y + v_x)])


def force(plate: Membrane, field: quadrature.CellFields, strain: np.ndarray) -> np.ndarray:
    """C:E, components (3, c, q, m), of strains (3, c, q, m)."""
    law = plate.law_in(field.cells) * [1.0, 1.0, 2.0]
    if law.ndim == 2:
        return np.tensordot(law, strain, axes=1)
    by_cell = strain.reshape(*strain.shape[:2], -1).swapaxes(0, 1)
    return np.matmul(law, by_cell).swapaxes(0, 1).reshape(strain.shape)


def product(force: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """sum_q N:E (m, n) of weighted forces (3, c, q, m) and strains (3, c, q, n)."""
    rows = [component.reshape(-1, component.shape[-1]) for component in (*force, *strain)]
    f_xx, f_yy, f_xy, xx, yy, xy = rows
    return f_xx.T @ xx + f_yy.T @ yy + 2 * (f_xy.T @ xy)


def no_load(plate: Membrane, columns: int) -> np.ndarray:
    """Zero loads (local dofs, m), ghosts included."""
    index_map = plate.in_plane.dofmap.index_map
    return np.zeros((2 * (index_map.size_local + index_map.num_ghosts), columns))


def add_load(
    plate: Membrane, field: quadrature.CellFields, force: np.ndarray, loads: np.ndarray
) -> None:
    """Add int N:sym grad v of weighted forces (3, c, q, m) to loads (local dofs, m)."""
    c, q, _, n = field.gradients.shape
    gradients = field.gradients.reshape(c, 2 * q, n).transpose(0, 2, 1)
    xx, yy, xy = force
    dofs = compat.cell_dofs(plate.in_plane)[field.cells].ravel()
    rows, place = np.unique(dofs, return_inverse=True)  # no others are touched
    spread = csr_matrix((np.ones(c * n), (place, np.arange(c * n))), (len(rows), c * n))
    for component, (x, y) in enumerate(((xx, xy), (xy, yy))):
        traction = np.stack([x, y], axis=2).reshape(c, 2 * q, -1)
        loads[2 * rows + component] += spread @ np.matmul(gradients, traction).reshape(c * n, -1)


def summed(plate: Membrane, loads: np.ndarray) -> np.ndarray:
    """Loads (local dofs, m) summed over the ranks that share a degree of freedom. Collective."""
    return summed_over_ranks(plate.in_plane, loads)


def summed_over_ranks(space: Any, loads: np.ndarray) -> np.ndarray:
    """Loads (local dofs, m) of a space, each summed where ranks share it. Collective."""
    if space.mesh.comm.size == 1:
        return loads
    function = fem.Function(space)
    total = np.empty_like(loads)
    for i in range(loads.shape[1]):
        function.x.array[:] = loads[:, i]
        compat.scatter_reverse_add(function)
        function.x.scatter_forward()
        total[:, i] = function.x.array
    return total


def free_dofs(plate: Membrane, parity: Parity = ()) -> algebra.FreeDofs:
    """In-plane degrees of freedom off the supports, for strains of a parity.

    On a mirror the displacement across it vanishes where strains are even, the one along it
    where they are odd.
    """

    def made() -> algebra.FreeDofs:
        held = constraints(plate, parity)
        fixed = np.concatenate([2 * nodes + axis for axis, nodes in enumerate(held.fixed)])
        return algebra.FreeDofs(plate.in_plane, fixed, held.turned)

    return plate.domain.once(("free in the plane", plate.holding, parity), made)


def constraints(plate: Membrane, parity: Parity = ()) -> Constraints:
    """What supports and mirrors hold of displacements whose strains have a parity. Collective."""
    if parity in plate.holding.known:
        return plate.holding.known[parity]
    tensor = plate.holding.rigid.copy()
    for axis, odd in zip(plate.mirrors.axes, parity):
        nodes = fem.locate_dofs_topological(plate.in_plane, 1, plate.on_mirror(axis))
        across = AXES.index(axis)
        tensor[nodes, 1 - across if odd else across] += 1.0
    found = holding.constraints(plate.in_plane, tensor, plate.holding.elastic)
    return plate.holding.known.setdefault(parity, found)


def spring_work(plate: Membrane, displacements: np.ndarray) -> np.ndarray:
    """This rank's part of u.K u (m, m) of elastic edges at displacements (local dofs, m).

    Collective.
    """
    force = spring_force(plate, displacements)
    return displacements[: len(force)].T @ force


def spring_force(plate: Membrane, displacements: np.ndarray) -> np.ndarray:
    """Forces (owned dofs, m) of elastic edges at displacements (local dofs, m). Collective."""
    stiffness = algebra.assemble(plate.compiled(plate.plane_spring_form))
    index_map = plate.in_plane.dofmap.index_map
    force = algebra.multiply(stiffness, displacements[: 2 * index_map.size_local])
    stiffness.destroy()
    return force
