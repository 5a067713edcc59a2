"""Nearly rigid modes of a film on soft springs: what little bends of them errs alone.

Where a mode is a rigid motion and a bending b far below it, the energy of bending tells the error
e of b by b.  Stretching is by the slopes of all of the mode.  A coefficient is the product of
stresses P that the plane leaves of two slopes each, and what e changes of it

    |<P(e, phi_j), P(phi_k, phi_l)>| <= |grad e| |grad phi_j| sqrt(E h B),

B being the largest one: e counts by the slopes of all shapes, and less where B is small.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.modes import rigid
from nanorom.fem.modes.accuracy import ModeErrors
from nanorom.fem.modes.eigen import Modes


def relieved(modes: Modes, errors: ModeErrors, cubic: np.ndarray) -> ModeErrors:
    """Errors whose averages are by the slopes of shapes that are nearly rigid. Collective.

    cubic: (n, n, n, n), not zero, in the film's units.
    """
    plate = modes.plate
    if not plate.stiffness.springs or not plate.bending:
        return errors
    slopes, area = _slopes(modes)
    energy = errors.strained * np.diag(modes.modal_stiffness())
    bends = rigid.SOFT * rigid.bent(plate) / rigid.wavenumber(plate) ** 2 * slopes
    largest = np.abs(cubic).max() / plate.stiffness.stretching
    stretched = np.sqrt(largest * area / slopes / slopes.max())
    share = np.minimum(np.minimum(energy / bends, 1.0) / stretched, 1.0)
    average = errors.mixing + share * (errors.average - errors.mixing)
    return attrs.evolve(errors, average=average)


def _slopes(modes: Modes) -> tuple[np.ndarray, float]:
    """int |grad phi|^2 (n,) over the whole film, and its area. Collective."""
    plate, n = modes.plate, len(modes.parities)
    total = np.zeros(n + 1)
    for field in quadrature.fields(plate, columns=2 * n):
        squares = np.sum(field.gradient(modes.shapes) ** 2, axis=2)
        total[:n] += np.einsum("cq,cqi->i", field.weights, squares)
        total[n] += field.weights.sum()
    total = plate.mirrors.copies * plate.domain.comm.allreduce(total)
    return total[:n], float(total[n])
