"""How much of a mode's stiffness is its film's bending, taken from the energy of bending alone."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.models.operators import LinearForce
from nanorom.fem.models.state import State
from nanorom.fem.modes.eigen import Modes


def stiffness(modes: Modes, poisson_ratio: float | None = None) -> np.ndarray:
    """int kappa_r : D : kappa_s (L, L) of the modes, scaled as their stiffness. Collective.

    poisson_ratio : in the place of the film's; 1 leaves D int tr kappa_r tr kappa_s.
    """
    plate = modes.plate
    if not plate.bending:
        return np.zeros((modes.shapes.shape[1],) * 2)
    known = plate.stiffness
    loose = {name: (None if k is None else 0.0, 0.0) for name, (k, _) in known.springs.items()}
    alone = attrs.evolve(
        known,
        springs=loose,
        poisson_ratio=known.poisson_ratio if poisson_ratio is None else poisson_ratio,
    )
    plate = plate.resisting(alone).about(State((0.0, 0.0)))
    return attrs.evolve(modes, force=LinearForce.of(plate)).modal_stiffness()
