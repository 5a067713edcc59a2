"""How modes about a state of a film harden: effective cubic coefficients, state by state."""

from __future__ import annotations

from typing import Any

import numpy as np

from nanorom.errors import ModelError, SolverError
from nanorom.fem.modes import accuracy
from nanorom.fem.modes.normal import normalise_film
from nanorom.fem.output.model import modal_products
from nanorom.fem.routes.methods import force_of
from nanorom.fem.scales import Scales
from nanorom.fem.statics import state
from nanorom.fem.stopwatch import Stopwatch
from nanorom.rom.manifold.coefficients import oscillator
from nanorom.rom.model import ReducedModel
from nanorom.scene.scene import Scene


def effective_cubic(
    scene: Scene, scales: Scales, units: state.Units, modes: Any, names: list[str], tension: float
) -> np.ndarray:
    """Cubic coefficients (L,) in N/m^3 that fits of single modes return, by direct condensation.

    modes : named ones about a state of a mean tension, L of them by ``names``.  What quadratic
    forces between these modes and all that lies outside them do is in it; NaN where two of them
    exchange energy.  Collective.
    """
    numbers = np.arange(len(names))
    modes, _ = normalise_film(modes, numbers, accuracy.stiffening_of(modes.plate, tension))
    force = force_of(scene.with_(method="direct"), scales, units, modes, Stopwatch(None))
    products = modal_products(modes)
    model = ReducedModel(
        frequency=scales.frequency(modes.eigenvalues),
        mass=scales.mass * products.mass,
        label=names,
        number=numbers + 1,
        stiffness=scales.tension * (products.stiffness + force.stretching),
        damping=np.zeros_like(force.stretching),
        quadratic=force.quadratic,
        cubic=force.cubic,
        outside_cubic=force.outside,
    )
    found = np.full(len(names), np.nan)
    for i in numbers:
        try:
            found[i] = oscillator(model, int(i)).cubic
        except (ModelError, SolverError):  # an internal resonance
            continue
    return found
