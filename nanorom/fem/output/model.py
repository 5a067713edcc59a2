"""From the modes and tensors of a route to the reduced model in SI units."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.modes.eigen import Modes


@attrs.frozen
class ModalProducts:
    """Scaled integrals: Phi^T K Phi, int phi^2, int phi, int d_i phi d_i phi (2, L, L)."""

    stiffness: np.ndarray
    mass: np.ndarray
    area: np.ndarray
    slopes: np.ndarray

    @property
    def slope(self) -> np.ndarray:
        """int grad phi . grad phi."""
        return np.asarray(self.slopes.sum(axis=0))


def modal_products(modes: Modes) -> ModalProducts:
    """Modal matrices from the assembled operators, patterns by quadrature. Collective."""
    plate, shapes = modes.plate, modes.shapes
    n_modes = shapes.shape[1]
    comm, copies = plate.domain.comm, plate.mirrors.copies
    area, slope = np.zeros(n_modes), np.zeros((2, n_modes, n_modes))
    for field in quadrature.fields(plate, columns=2 * n_modes):
        area += np.einsum("cq,cqn->n", field.weights, field.value(shapes))
        gradient = field.gradient(shapes)
        weighted = gradient * field.weights[..., None, None]
        slope += np.einsum("cqdr,cqds->drs", gradient, weighted, optimize=True)
    slope, area = copies * comm.allreduce(slope), copies * comm.allreduce(area)
    parities = modes.parities
    slope[:, [[a != b for b in parities] for a in parities]] = 0.0
    area[[parity != plate.mirrors.even for parity in parities]] = 0.0
    mass = modes.modal(dict.fromkeys(parities, modes.mass))
    return ModalProducts(modes.modal_stiffness(), np.diag(mass).copy(), area, slope)
