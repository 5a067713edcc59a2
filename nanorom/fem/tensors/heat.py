"""Heat conduction in the film, and what its thermal stress does to modes.

A film of thickness h that loses heat through its edge alone obeys C T' = k lap T + p/h: the modes
of conduction are those of a membrane under unit tension, held (at the frame's temperature) where
the film is.  Expansion alpha T strains the film; the in-plane displacement follows at once, and
what stress is left is in equilibrium (Duhamel and Neumann; Boley and Weiner, Theory of Thermal
Stresses, 1960, chapter 12).  It acts on modes as any membrane force does.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.fields import membrane, quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.modes import eigen
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity, product_parity
from nanorom.fem.tensors.equilibrium import Equilibrium

EQUAL = 1e-6  # relative: largest and smallest value of an odd mode, to rounding


@attrs.frozen(eq=False)
class Conduction:
    """Thermal modes of a film and their couplings, scaled; S thermal modes, L modes.

    modes: as those of a membrane, of largest value 1, eigenvalues mu^2 by the squared length;
    squares (S,): int psi^2; stiffness (L, L, S) and force (L, S): by E h alpha and by that times
    the deflection, a kelvin of each.
    """

    modes: Modes
    squares: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray


def conducting(plate: Plate) -> Plate:
    """The membrane whose modes are those of heat. Raises SceneError for elastic edges."""
    if plate.stiffness.springs:
        raise SceneError("drive.laser: found beside elastic edges, whose contact is not known")
    return attrs.evolve(plate, bending=False, stiffness=Stiffness(), state=State(), masses=())


def conduction(modes: Modes, count: int) -> Conduction:
    """The ``count`` slowest thermal modes of the film, and what they do to modes. Collective."""
    plate = modes.plate
    found = eigen.solve(conducting(plate), count).take(np.arange(count))
    found = attrs.evolve(found, shapes=found.shapes / _extreme(found))
    n = len(modes.parities)
    stiffness, force = np.zeros((n, n, count)), np.zeros((n, count))
    for parity in sorted(set(found.parities)):
        own = np.array([i for i, p in enumerate(found.parities) if p == parity])
        parts = _of_class(modes, found.shapes[:, own], parity)
        stiffness[:, :, own], force[:, own] = parts
    return Conduction(found, found.squares(), stiffness, force)


def _extreme(modes: Modes) -> np.ndarray:
    """Largest value (S,) of each mode by magnitude, the positive one of equals. Collective."""
    own = modes.shapes.max(axis=0, initial=0.0), modes.shapes.min(axis=0, initial=0.0)
    ranks = np.array(modes.plate.domain.comm.allgather(own))
    high, low = ranks[:, 0].max(axis=0), ranks[:, 1].min(axis=0)
    return np.where(high >= -(1 - EQUAL) * low, high, low)


def _of_class(
    modes: Modes, temperature: np.ndarray, parity: Parity
) -> tuple[np.ndarray, np.ndarray]:
    """Couplings (L, L, m) and (L, m) of temperatures (local dofs, m) of one parity. Collective."""
    plate, m, n = modes.plate, temperature.shape[1], len(modes.parities)
    loads = membrane.no_load(plate, m)
    for field in quadrature.fields(plate, columns=9 * m):
        stress = membrane.force(plate, field, _expansion(field, temperature))
        stress *= field.weights[..., None]
        membrane.add_load(plate, field, stress, loads)
    displacement = membrane.summed(plate, loads)
    matrix = algebra.assemble(plate.compiled(plate.in_plane_form))
    equilibrium = Equilibrium(plate, matrix, parity)
    matrix.destroy()
    equilibrium.respond(displacement)
    equilibrium.release()
    compat.free_memory(plate.domain.comm)
    shape = plate.state.shape
    stiffness, force = np.zeros((n, n, m)), np.zeros((n, m))
    for field in quadrature.fields(plate, columns=9 * max(m, n)):
        strain = _expansion(field, temperature) + membrane.strain(plate, field, displacement)
        xx, yy, xy = membrane.force(plate, field, strain) * field.weights[..., None]
        x, y = np.moveaxis(field.gradient(modes.shapes), 2, 0)
        pulled = [
            np.einsum("cqm,cqr->cqrm", *pair) for pair in ((xx, x), (xy, y), (xy, x), (yy, y))
        ]
        along, across = pulled[0] + pulled[1], pulled[2] + pulled[3]
        stiffness += np.einsum("cqr,cqsm->rsm", x, along) + np.einsum("cqr,cqsm->rsm", y, across)
        if shape is not None:
            s, t = np.moveaxis(field.gradient(shape.x.array[:, None]), 2, 0)[..., 0]
            force -= np.einsum("cq,cqrm->rm", s, along) + np.einsum("cq,cqrm->rm", t, across)
    comm, copies = plate.domain.comm, plate.mirrors.copies
    stiffness, force = copies * comm.allreduce(stiffness), copies * comm.allreduce(force)
    pairs = [[product_parity(a, b) != parity for b in modes.parities] for a in modes.parities]
    stiffness[np.array(pairs)] = 0.0
    force[[p != parity for p in modes.parities]] = 0.0
    return stiffness, force


def _expansion(field: quadrature.CellFields, temperature: np.ndarray) -> np.ndarray:
    """Strain (3, c, q, m) that stress is measured from, less by that of a kelvin and alpha = 1."""
    value = -field.value(temperature)
    return np.stack([value, value, np.zeros_like(value)])
