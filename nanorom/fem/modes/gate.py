"""What a gate does to modes at unit strength: derivatives of its potential, weighed with them."""

from __future__ import annotations

import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.modes.eigen import Modes


def products(modes: Modes, number: int, order: int) -> np.ndarray:
    """int 1/(g - h)^2 phi_r (L,) for order 1, int 2/(g - h)^3 phi_r phi_s (L, L) for 2. Collective.

    Of the gate of a number, over where it lies; negative for one on the other side.  In the film's
    units, about the height h of its state.
    """
    plate, n = modes.plate, len(modes.parities)
    known = plate.state.attraction
    assert known is not None
    gate = known.gates[number]
    shape = np.zeros((len(modes.shapes), 1))
    if plate.state.shape is not None:
        shape[:, 0] = plate.state.shape.x.array
    total = np.zeros((n,) * order)
    for field in quadrature.fields(plate, columns=2 * n):
        potential = gate.derivative(order, field.value(shape)[..., 0], field.cells)
        value = field.value(modes.shapes).reshape(-1, n)
        weight = (2 * gate.side * potential * field.weights).ravel()
        total += weight @ value if order == 1 else (value * weight[:, None]).T @ value
    total = plate.mirrors.copies * plate.domain.comm.allreduce(total)
    parities = modes.parities
    if order == 1:
        total[[parity != plate.mirrors.even for parity in parities]] = 0.0
    else:
        total[[[a != b for b in parities] for a in parities]] = 0.0
    return np.asarray(total)
