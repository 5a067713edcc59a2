"""How much of a mode's stiffness is its film's bending, taken from the energy of bending alone."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.models.operators import LinearForce
from nanorom.fem.models.state import State
from nanorom.fem.modes.eigen import Modes
from nanorom.scene.elasticity import Law


def lost(modes: Modes, loss: float) -> np.ndarray:
    """Bending's stiffness (L, L), each place's times its E''/E'. Collective.

    loss : outside regions.
    """
    plate = modes.plate
    patchwork = plate.patchwork
    if patchwork is None:
        return loss * stiffness(modes)
    moments = patchwork.moments * patchwork.loss[:, None, None]
    film = attrs.evolve(plate, patchwork=attrs.evolve(patchwork, moments=moments))
    return stiffness(attrs.evolve(modes, film=film))


def stiffness(modes: Modes, law: Law | None = None) -> np.ndarray:
    """int kappa_r : D : kappa_s (L, L) of the modes, scaled as their stiffness. Collective.

    law : moments by D in the place of the film's.
    """
    plate = modes.plate
    if not plate.bending:
        return np.zeros((modes.shapes.shape[1],) * 2)
    known = plate.stiffness
    loose = {name: (None if k is None else 0.0, 0.0) for name, (k, _) in known.springs.items()}
    alone = attrs.evolve(
        known,
        springs=loose,
        moments=known.moments if law is None else law,
    )
    plate = plate.resisting(alone).about(State((0.0, 0.0)))
    return attrs.evolve(modes, force=LinearForce.of(plate)).modal_stiffness()
