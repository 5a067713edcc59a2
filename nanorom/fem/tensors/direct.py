"""Cubic tensor by direct static condensation of the in-plane displacement.

For given deflection w = sum q_j phi_j the in-plane problem of a von Karman film is linear, and
the condensed energy is an exact quartic,

    V4 = 1/8 sum G_(rj)(kl) q_r q_j q_k q_l,
    G_(rj)(kl) = <E_rj, E_kl>,   E_jk = sym(grad phi_j (x) grad phi_k) + sym grad u_jk,

with the inner product <.,.> of the membrane stiffness C and the in-plane displacement u_jk in
equilibrium with its pair.  One factorisation and L(L + 1)/2 back-substitutions give all
coefficients; with the in-plane displacement held fixed u_jk is zero.  Pairs of
different parity about a mirror of the film do not interact: each class of symmetry has its own
pairs, and its own, smaller in-plane problem.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import attrs
import numpy as np

from nanorom.fem.fields import membrane, quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import compat, groups
from nanorom.fem.symmetry import Parity, product_parity
from nanorom.fem.tensors import inplane, lateral
from nanorom.fem.tensors.equilibrium import of_classes
from nanorom.fem.tensors.inplane import InPlane
from nanorom.rom import tensors

SOLVED = 1e-6  # error of displacements in the norm of their energy: it enters products squared
FEW = 100_000  # unknowns in the plane up to which pairs of all classes are held together
FACTORS_COST = 6.0  # of factors, in pairs whose products take as long (measured on fine meshes)

# cells, slopes (2, c, q, L) of all shapes, pairs (p, 2), their weighted forces (3, c, q, p)
Told = Callable[[quadrature.CellFields, np.ndarray, np.ndarray, np.ndarray], None]


def cubic_tensor(modes: Modes, in_plane: str = "free") -> tuple[np.ndarray, InPlane]:
    """Fully symmetric B (L, L, L, L) with eta_r = B_rjkl q_j q_k q_l. Collective.

    in_plane : ``"free"`` (condensed) or ``"fixed"``.  Also gives what is known of the in-plane
    displacements, errors relative to the largest pair product.
    """
    products, known = stretching_products(modes.plate, modes.shapes, modes.parities, in_plane)
    return tensors.symmetrised(products), known


def stretching_tensors(
    modes: Modes, in_plane: str = "free", told: Told | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, InPlane]:
    """Linear, quadratic and cubic stretching force of a film that is not flat. Collective.

    (L, L), (L, L, L) and (L, L, L, L), fully symmetric.  The initial shape w0 is one deflection
    more, of constant amplitude: E(w0 + w) - E(w0) is Marguerre's strain.  Also gives
    what is known of the in-plane displacements; ``told`` is as for `stretching_products`.
    """
    plate, n = modes.plate, len(modes.parities)
    shapes = np.column_stack([modes.shapes, plate.state.shape.x.array])
    parities = [*modes.parities, plate.mirrors.even]
    products, known = stretching_products(plate, shapes, parities, in_plane, told)
    mixed = products[:n, n, :n, :n]  # <S_r0, S_jk>
    quadratic = 0.5 * (mixed + mixed.transpose(1, 0, 2) + mixed.transpose(2, 1, 0))
    return products[:n, n, :n, n], quadratic, tensors.symmetrised(products[:n, :n, :n, :n]), known


def stretching_products(
    plate: Plate,
    shapes: np.ndarray,
    parities: list[Parity],
    in_plane: str,
    told: Told | None = None,
) -> tuple[np.ndarray, InPlane]:
    """G (L, L, L, L) of deflections (local dofs, L), and what is known of it. Collective.

    ``told`` of the membrane forces of all pairs, cell by cell.
    """
    n_modes = len(parities)
    pairs = pairs_by_parity(parities)

    def work(own: Sequence[Parity]) -> dict[Parity, ClassProducts]:
        found: dict[Parity, ClassProducts] = {}
        for some in at_once(plate, own):
            found |= _class_products(plate, shapes, {p: pairs[p] for p in some}, in_plane, told)
        return found

    found = groups.shared(
        plate.domain.across, list(pairs), work, lambda parity: FACTORS_COST + len(pairs[parity])
    )
    products = np.zeros((n_modes,) * 4)
    for parity, members in pairs.items():
        tensors.unpacked(plate.mirrors.copies * found[parity].energy, members, products)
    # of what is left: where free edges let the film follow, it is far below <S_jk, S_jk>
    largest = max(float(part.energy.diagonal().max()) for part in found.values())
    known = InPlane.of_parts((part.known for part in found.values()), largest)
    if in_plane == "free":
        members, even = pairs[plate.mirrors.even], found[plate.mirrors.even].known.energies
        known = attrs.evolve(known, energies=even[members[:, 0] == members[:, 1]])
    return products, known


def pairs_by_parity(parities: list[Parity]) -> dict[Parity, np.ndarray]:
    """Pairs (p, 2) of modes j <= k, by the parity of their product."""
    found: dict[Parity, list[tuple[int, int]]] = {}
    for j, k in zip(*np.triu_indices(len(parities))):
        found.setdefault(product_parity(parities[j], parities[k]), []).append((j, k))
    return {parity: np.array(members) for parity, members in sorted(found.items())}


def at_once(plate: Plate, parities: Sequence[Parity]) -> list[Sequence[Parity]]:
    """Classes whose pairs are worked on together: one by one where all of them fill the memory."""
    free = membrane.free_dofs(plate)
    return [[p] for p in parities] if free.size > FEW else [parities]


@attrs.frozen(eq=False)
class ClassProducts:
    """Products of the pairs of one parity.

    energy: <E_jk, E_lm> (p, p); known: of the displacements.
    """

    energy: np.ndarray
    known: InPlane


def _class_products(
    plate: Plate,
    shapes: np.ndarray,
    pairs: dict[Parity, np.ndarray],
    in_plane: str,
    told: Told | None,
) -> dict[Parity, ClassProducts]:
    """Products of the pairs of some parities. Collective."""
    displacements: dict[Parity, np.ndarray] = {}
    known = dict.fromkeys(pairs, InPlane())
    if in_plane == "free":
        displacements, known = _displacements(plate, shapes, pairs)
    energy = _pair_products(plate, shapes, pairs, displacements, told)
    return {p: ClassProducts(energy[p], known[p]) for p in pairs}


def _displacements(
    plate: Plate, shapes: np.ndarray, pairs: dict[Parity, np.ndarray]
) -> tuple[dict[Parity, np.ndarray], dict[Parity, InPlane]]:
    """In-plane displacements (local dofs, p) in equilibrium with each pair, and what they tell.

    Collective.
    """
    known, slender = {}, lateral.is_slender(plate)
    loads = {parity: membrane.no_load(plate, len(p)) for parity, p in pairs.items()}
    for field, _, parity, strain in _pair_strains(plate, shapes, pairs):
        force = membrane.force(plate, field, strain) * field.weights[..., None]
        membrane.add_load(plate, field, force, loads[parity])
    for equilibrium, parity in zip(of_classes(plate, list(loads)), list(loads)):
        loads[parity] = membrane.summed(plate, loads[parity])
        equilibrium.respond(loads[parity], SOLVED)
        own = equilibrium if slender else None
        known[parity] = inplane.known(plate, loads[parity], parity, own)
    compat.free_memory(plate.domain.comm)
    return loads, known


def _pair_products(
    plate: Plate,
    shapes: np.ndarray,
    pairs: dict[Parity, np.ndarray],
    displacements: dict[Parity, np.ndarray],
    told: Told | None,
) -> dict[Parity, np.ndarray]:
    """By parity: <E_jk, E_lm> (p, p) of the pairs' strains.

    E = S + sym grad u; in equilibrium the product is stationary in u, so that an error of the
    in-plane solution enters squared.
    """
    energy = {parity: np.zeros((len(p), len(p))) for parity, p in pairs.items()}
    for field, slope, parity, strain in _pair_strains(plate, shapes, pairs):
        weights = field.weights[..., None]
        if displacements:
            strain = strain + membrane.strain(plate, field, displacements[parity])
        force = membrane.force(plate, field, strain) * weights
        energy[parity] += membrane.product(force, strain)
        if told is not None:
            told(field, slope, pairs[parity], force)
    if plate.stiffness.in_plane:
        for parity, moved in displacements.items():
            energy[parity] += membrane.spring_work(plate, moved)
    return {parity: plate.domain.comm.allreduce(e) for parity, e in energy.items()}


def _pair_strains(
    plate: Plate, shapes: np.ndarray, pairs: dict[Parity, np.ndarray]
) -> Iterator[tuple[quadrature.CellFields, np.ndarray, Parity, np.ndarray]]:
    """Slopes (2, c, q, L) and S_jk (3, c, q, p) of each parity's pairs, in chunks of cells."""
    most = max(len(members) for members in pairs.values())
    for field in quadrature.fields(plate, columns=9 * most):
        slope = np.moveaxis(field.gradient(shapes), 2, 0).copy()
        for parity, (j, k) in ((p, members.T) for p, members in pairs.items()):
            yield field, slope, parity, membrane.slope_product(slope[..., j], slope[..., k])
