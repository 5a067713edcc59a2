"""Cubic tensor by direct static condensation of the in-plane displacement.

For given deflection w = sum q_j phi_j the in-plane problem of a von Karman film is linear, and
the condensed energy is an exact quartic,

    V4 = 1/8 sum G_(rj)(kl) q_r q_j q_k q_l,
    G_(rj)(kl) = <S_rj, S_kl> - f_rj . A^-1 f_kl,   S_jk = sym(grad phi_j (x) grad phi_k),

with the inner product <.,.> of the membrane stiffness C, A the in-plane stiffness and f_jk the
in-plane load <S_jk, sym grad v>.  One factorisation and L(L + 1)/2 back-substitutions give all
coefficients; with the in-plane displacement held fixed the second term is absent.
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from nanorom.fem import algebra, compat, quadrature
from nanorom.fem.plate import Plate


def pair_list(n_modes: int) -> np.ndarray:
    """Pairs (p, 2) of modes j <= k."""
    return np.column_stack(np.triu_indices(n_modes))


def cubic_tensor(plate: Plate, shapes: np.ndarray, in_plane: str = "free") -> np.ndarray:
    """Fully symmetric B (L, L, L, L) with eta_r = B_rjkl q_j q_k q_l. Collective.

    shapes : (local dofs, L) of the scaled modes; in_plane : ``"free"`` (condensed) or ``"fixed"``.
    """
    energy, loads = _pair_products(plate, shapes)
    if in_plane == "free":
        free = in_plane_free(plate)
        stiffness = free.restrict(algebra.assemble(compat.form(plate.in_plane_form())))
        factors = algebra.Factorization(stiffness, "nanorom_in_plane_", "in-plane stiffness")
        loads = assembled(plate, loads)[free.local]
        energy -= plate.domain.comm.allreduce(loads.T @ factors.solve(loads))
    return symmetrised(unpacked(energy, shapes.shape[1]))


def in_plane_free(plate: Plate) -> algebra.FreeDofs:
    """In-plane degrees of freedom off the supports."""
    blocks = fem.locate_dofs_topological(plate.in_plane, 1, plate.supported)
    return algebra.FreeDofs(plate.in_plane, np.concatenate([2 * blocks, 2 * blocks + 1]))


def _pair_products(plate: Plate, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """<S_jk, S_lm> (p, p) of all pairs, and this rank's in-plane loads f_jk (local dofs, p)."""
    pairs = pair_list(shapes.shape[1])
    energy = np.zeros((len(pairs), len(pairs)))
    loads = np.zeros((_n_in_plane(plate), len(pairs)))
    for field in quadrature.fields(plate, plate.stretching_degree, columns=6 * len(pairs)):
        slope = field.gradient(shapes)
        first, second = slope[..., pairs[:, 0]], slope[..., pairs[:, 1]]
        xx, yy = first[:, :, 0] * second[:, :, 0], first[:, :, 1] * second[:, :, 1]
        xy = 0.5 * (first[:, :, 0] * second[:, :, 1] + first[:, :, 1] * second[:, :, 0])
        force = membrane_force(plate, xx, yy, xy) * field.weights[..., None]
        rows = (-1, len(pairs))
        energy += xx.reshape(rows).T @ force[0].reshape(rows)
        energy += yy.reshape(rows).T @ force[1].reshape(rows)
        energy += 2 * xy.reshape(rows).T @ force[2].reshape(rows)
        add_in_plane_load(plate, field, force, loads)
    return plate.domain.comm.allreduce(energy), loads


def membrane_force(plate: Plate, xx: np.ndarray, yy: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Components (3, ...) of C:E from those of the strain, each (...)."""
    nu = float(plate.nu.value)
    scale = float(plate.membrane_stiffness.value) / (1 - nu**2)
    return scale * np.stack([xx + nu * yy, yy + nu * xx, (1 - nu) * xy])


def _n_in_plane(plate: Plate) -> int:
    index_map = plate.in_plane.dofmap.index_map
    return 2 * (index_map.size_local + index_map.num_ghosts)


def add_in_plane_load(
    plate: Plate, field: quadrature.CellFields, force: np.ndarray, loads: np.ndarray
) -> None:
    """Add int N:sym grad v of weighted membrane forces (3, c, q, m) to loads (local dofs, m)."""
    c, q, _, n = field.gradients.shape
    gradients = field.gradients.reshape(c, 2 * q, n).transpose(0, 2, 1)
    xx, yy, xy = force
    dofs = compat.cell_dofs(plate.in_plane)[field.cells]
    for component, (x, y) in enumerate(((xx, xy), (xy, yy))):
        traction = np.stack([x, y], axis=2).reshape(c, 2 * q, -1)
        np.add.at(loads, 2 * dofs + component, np.matmul(gradients, traction))


def assembled(plate: Plate, loads: np.ndarray) -> np.ndarray:
    """Sum loads (local dofs, m) over the ranks that share a degree of freedom. Collective."""
    if plate.domain.comm.size == 1:
        return loads
    function = fem.Function(plate.in_plane)
    total = np.empty_like(loads)
    for i in range(loads.shape[1]):
        function.x.array[:] = loads[:, i]
        compat.scatter_reverse_add(function)
        total[:, i] = function.x.array
    return total


def unpacked(energy: np.ndarray, n_modes: int) -> np.ndarray:
    """Pair products (p, p) as G[r, j, k, l]."""
    index = np.empty((n_modes, n_modes), dtype=int)
    pairs = pair_list(n_modes)
    index[pairs[:, 0], pairs[:, 1]] = index[pairs[:, 1], pairs[:, 0]] = np.arange(len(pairs))
    return energy[index[:, :, None, None], index[None, None]]


def symmetrised(products: np.ndarray) -> np.ndarray:
    """B = 1/2 G averaged over the three ways to pair four modes."""
    return (
        products + products.transpose(0, 2, 1, 3) + products.transpose(0, 3, 2, 1)
    ) / 6.0
