"""The moving film rebuilt from a reduced model and an orbit: energies, deflections, instants."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from nanorom.errors import ModelError
from nanorom.rom.model import ReducedModel
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.continuation import PeriodicOrbit

INSTANTS = 256  # per period: enough for the harmonics of any orbit that is drawn


def energy_shares(model: ReducedModel, orbit: PeriodicOrbit) -> Array:
    """Share of each mode (L,) in the kinetic energy, of 1, mean over a period."""
    _, _, velocity = orbit.time_series(INSTANTS, 1)
    energy = model.mass * np.mean(velocity**2, axis=0)
    return np.asarray(energy / energy.sum())


def deflection(model: ReducedModel, orbit: PeriodicOrbit, t: ArrayLike) -> Array:
    """Deflection w (..., P) in m on the points of the shapes at times in s; raises ModelError."""
    if model.shapes is None:
        raise ModelError("shapes: the model has none, so the motion cannot be rebuilt")
    return orbit.shape(model.shapes.values, np.asarray(t, dtype=float))


def time_of_largest(model: ReducedModel, orbit: PeriodicOrbit) -> float:
    """The time within a period, in s, at which some point of the film deflects most.

    Raises ModelError without shapes.
    """
    t = np.arange(INSTANTS) * orbit.period / INSTANTS
    return float(t[np.abs(deflection(model, orbit, t)).max(axis=1).argmax()])
