"""Cubic tensor by direct static condensation of the in-plane displacement.

For given deflection w = sum q_j phi_j the in-plane problem of a von Karman film is linear, and
the condensed energy is an exact quartic,

    V4 = 1/8 sum G_(rj)(kl) q_r q_j q_k q_l,
    G_(rj)(kl) = <S_rj, S_kl> - f_rj . A^-1 f_kl,   S_jk = sym(grad phi_j (x) grad phi_k),

with the inner product <.,.> of the membrane stiffness C, A the in-plane stiffness and f_jk the
in-plane load <S_jk, sym grad v>.  One factorisation and L(L + 1)/2 back-substitutions give all
coefficients; with the in-plane displacement held fixed the second term is absent.  Pairs of
different parity about a mirror of the film do not interact: each class of symmetry has its own
pairs, and its own, smaller in-plane problem.
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from scipy.sparse import csr_matrix

from nanorom.fem import accuracy, algebra, compat, quadrature
from nanorom.fem.modes import Modes
from nanorom.fem.plate import Plate
from nanorom.fem.symmetry import AXES, Parity, product_parity


def cubic_tensor(modes: Modes, in_plane: str = "free") -> tuple[np.ndarray, float]:
    """Fully symmetric B (L, L, L, L) with eta_r = B_rjkl q_j q_k q_l. Collective.

    in_plane : ``"free"`` (condensed) or ``"fixed"``.  Also gives the estimated error of the
    in-plane energy relative to the largest pair product.
    """
    products, error = stretching_products(modes.plate, modes.shapes, modes.parities, in_plane)
    return symmetrised(products), error


def stretching_tensors(
    modes: Modes, in_plane: str = "free"
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Linear, quadratic and cubic stretching force of a film that is not flat. Collective.

    (L, L), (L, L, L) and (L, L, L, L), fully symmetric.  The initial shape w0 is one deflection
    more, of constant amplitude: E(w0 + w) - E(w0) is Marguerre's strain.  Also gives the
    estimated error of the in-plane energy.
    """
    plate, n = modes.plate, len(modes.parities)
    shapes = np.column_stack([modes.shapes, plate.shape.x.array])
    parities = [*modes.parities, plate.mirrors.even]
    products, error = stretching_products(plate, shapes, parities, in_plane)
    mixed = products[:n, n, :n, :n]  # <S_r0, S_jk>
    quadratic = 0.5 * (mixed + mixed.transpose(1, 0, 2) + mixed.transpose(2, 1, 0))
    return products[:n, n, :n, n], quadratic, symmetrised(products[:n, :n, :n, :n]), error


def stretching_products(
    plate: Plate, shapes: np.ndarray, parities: list[Parity], in_plane: str
) -> tuple[np.ndarray, float]:
    """G (L, L, L, L) of deflections (local dofs, L), and its estimated error. Collective."""
    n_modes = len(parities)
    pairs = pairs_by_parity(parities)
    energy, loads = _pair_products(plate, shapes, pairs)
    largest = max(np.abs(np.diag(e)).max() for e in energy.values())
    error = 0.0
    if in_plane == "free":
        stiffness = algebra.assemble(compat.form(plate.in_plane_form()))
        for parity in pairs:
            free = in_plane_free(plate, parity)
            factors = algebra.Factorization(
                free.restrict(stiffness), "nanorom_in_plane_", "in-plane stiffness"
            )
            load = assembled(plate, loads[parity])[free.local]
            solution = factors.solve(load)
            energy[parity] -= plate.domain.comm.allreduce(load.T @ solution)
            longer, tail = accuracy.in_plane_tails(plate, free.extended(solution))
            error = max(error, float(accuracy.extrapolated(tail, longer).max() / largest))
    products = np.zeros((n_modes,) * 4)
    for parity, members in pairs.items():
        _unpack(plate.mirrors.copies * energy[parity], members, products)
    return products, error


def pairs_by_parity(parities: list[Parity]) -> dict[Parity, np.ndarray]:
    """Pairs (p, 2) of modes j <= k, by the parity of their product."""
    found: dict[Parity, list[tuple[int, int]]] = {}
    for j, k in zip(*np.triu_indices(len(parities))):
        found.setdefault(product_parity(parities[j], parities[k]), []).append((j, k))
    return {parity: np.array(members) for parity, members in sorted(found.items())}


def in_plane_free(plate: Plate, parity: Parity = ()) -> algebra.FreeDofs:
    """In-plane degrees of freedom off the supports, for strains of a parity.

    On a mirror the displacement across it vanishes where strains are even, the one along it
    where they are odd.
    """
    blocks = fem.locate_dofs_topological(plate.in_plane, 1, plate.supported)
    fixed = [2 * blocks, 2 * blocks + 1]
    for axis, odd in zip(plate.mirrors.axes, parity):
        blocks = fem.locate_dofs_topological(plate.in_plane, 1, plate.on_mirror(axis))
        across = AXES.index(axis)
        fixed.append(2 * blocks + (1 - across if odd else across))
    return algebra.FreeDofs(plate.in_plane, np.concatenate(fixed))


def _pair_products(
    plate: Plate, shapes: np.ndarray, pairs: dict[Parity, np.ndarray]
) -> tuple[dict[Parity, np.ndarray], dict[Parity, np.ndarray]]:
    """By parity: <S_jk, S_lm> (p, p), and this rank's in-plane loads f_jk (local dofs, p)."""
    energy = {parity: np.zeros((len(p), len(p))) for parity, p in pairs.items()}
    loads = {parity: np.zeros((n_in_plane(plate), len(p))) for parity, p in pairs.items()}
    most = max(len(members) for members in pairs.values())
    for field in quadrature.fields(plate, columns=6 * most):
        slope = np.moveaxis(field.gradient(shapes), 2, 0).copy()
        for parity, (j, k) in ((p, members.T) for p, members in pairs.items()):
            (x_j, y_j), (x_k, y_k) = slope[..., j], slope[..., k]
            strain = np.stack([x_j * x_k, y_j * y_k, 0.5 * (x_j * y_k + y_j * x_k)])
            force = membrane_force(plate, *strain) * field.weights[..., None]
            add_in_plane_load(plate, field, force, loads[parity])
            force[2] *= 2  # xy and yx
            rows = (-1, len(j))
            energy[parity] += strain.reshape(rows).T @ force.reshape(rows)
    return {parity: plate.domain.comm.allreduce(e) for parity, e in energy.items()}, loads


def membrane_force(plate: Plate, xx: np.ndarray, yy: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Components (3, ...) of C:E from those of the strain, each (...)."""
    nu = float(plate.nu.value)
    scale = float(plate.membrane_stiffness.value) / (1 - nu**2)
    return scale * np.stack([xx + nu * yy, yy + nu * xx, (1 - nu) * xy])


def n_in_plane(plate: Plate) -> int:
    """Local in-plane degrees of freedom, ghosts included."""
    index_map = plate.in_plane.dofmap.index_map
    return 2 * (index_map.size_local + index_map.num_ghosts)


def add_in_plane_load(
    plate: Plate, field: quadrature.CellFields, force: np.ndarray, loads: np.ndarray
) -> None:
    """Add int N:sym grad v of weighted membrane forces (3, c, q, m) to loads (local dofs, m)."""
    c, q, _, n = field.gradients.shape
    gradients = field.gradients.reshape(c, 2 * q, n).transpose(0, 2, 1)
    xx, yy, xy = force
    dofs = compat.cell_dofs(plate.in_plane)[field.cells].ravel()
    spread = csr_matrix((np.ones(c * n), (dofs, np.arange(c * n))), (len(loads) // 2, c * n))
    for component, (x, y) in enumerate(((xx, xy), (xy, yy))):
        traction = np.stack([x, y], axis=2).reshape(c, 2 * q, -1)
        loads[component::2] += spread @ np.matmul(gradients, traction).reshape(c * n, -1)


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


def _unpack(energy: np.ndarray, pairs: np.ndarray, products: np.ndarray) -> None:
    """Write products of pairs (p, p) to G[r, j, k, l], in both orders of every pair."""
    j, k = pairs.T
    for r, s in ((j, k), (k, j)):
        for t, u in ((j, k), (k, j)):
            products[r[:, None], s[:, None], t, u] = energy


def symmetrised(products: np.ndarray) -> np.ndarray:
    """B = 1/2 G averaged over the three ways to pair four modes."""
    return (
        products + products.transpose(0, 2, 1, 3) + products.transpose(0, 3, 2, 1)
    ) / 6.0
