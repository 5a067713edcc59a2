"""Quadratic and cubic tensors about a loaded or curved state, all other displacements condensed."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.tensors import direct
from nanorom.fem.tensors.inplane import InPlane
from nanorom.fem.tensors.outside import Outside, PairForces, response


@attrs.frozen(eq=False)
class Tensors:
    """Modal force of a film: stretching (L, L), quadratic (L, L, L), cubic (L, L, L, L).

    ``stretching`` is the linear force that the modes' stiffness does not contain;
    ``in_plane`` is what is known of the in-plane displacements; ``outside`` is what everything
    outside the modes adds, None where it was not asked for or does nothing.
    """

    stretching: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray
    in_plane: InPlane
    outside: Outside | None = None


def tensors(modes: Modes, in_plane: str = "free", outside: bool = False) -> Tensors:
    """Coefficients by direct condensation, those of the attraction included. Collective.

    outside : also the static response of all that lies outside the modes.
    """
    n = len(modes.parities)
    forces = PairForces(modes) if outside and modes.plate.state.shape is not None else None
    if modes.plate.state.shape is None:
        cubic, known = direct.cubic_tensor(modes, in_plane)
        found = Tensors(np.zeros((n, n)), np.zeros((n, n, n)), cubic, known)
    else:
        found = Tensors(*direct.stretching_tensors(modes, in_plane, forces))
    if forces is not None:
        stiffness = modes.modal_stiffness() + found.stretching
        found = attrs.evolve(found, outside=response(modes, forces, stiffness))
    attraction = modes.plate.state.attraction
    if attraction is None:
        return found
    third, fourth = _attraction_tensors(modes)
    return attrs.evolve(
        found, quadratic=found.quadratic - third / 2, cubic=found.cubic - fourth / 6
    )


def _attraction_tensors(modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """int W''' phi^3 and int W'''' phi^4 of all modes, W the potential of the attraction."""
    plate, n = modes.plate, len(modes.parities)
    attraction = plate.state.attraction
    assert attraction is not None
    j, k = np.triu_indices(n)
    pair = np.empty((n, n), dtype=int)
    pair[j, k] = pair[k, j] = np.arange(len(j))
    by_pair, by_two = np.zeros((len(j), n)), np.zeros((len(j), len(j)))
    shape = np.zeros((len(modes.shapes), 1))
    if plate.state.shape is not None:
        shape[:, 0] = plate.state.shape.x.array
    for field in quadrature.fields(plate, columns=2 * len(j)):
        height = field.value(shape)[..., 0]
        value = field.value(modes.shapes).reshape(-1, n)
        products = value[:, j] * value[:, k]
        of_third, of_fourth = (
            (attraction.derivative(order, height, field.cells) * field.weights).reshape(-1, 1)
            for order in (3, 4)
        )
        by_pair += (products * of_third).T @ value
        by_two += (products * of_fourth).T @ products
    comm, copies = plate.domain.comm, plate.mirrors.copies
    third = copies * comm.allreduce(by_pair)[pair]
    fourth = copies * comm.allreduce(by_two)[pair[:, :, None, None], pair[None, None]]
    for tensor in (third, fourth):
        # what is odd about a mirror vanishes on the whole film
        for odd in np.array(modes.parities, dtype=int).reshape(n, -1).T:
            total = sum(odd.reshape([-1] + [1] * axis) for axis in range(tensor.ndim))
            tensor[total % 2 == 1] = 0.0
    return third, fourth
