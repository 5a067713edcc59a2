"""The state that a plate's modes are about, on a mesh that is made for it."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.mesh import discretisation
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.models.build import build_plate, relaxes
from nanorom.fem.plan import Plan
from nanorom.fem.solvers.groups import Team
from nanorom.fem.statics import state
from nanorom.fem.stopwatch import Stopwatch
from nanorom.scene.geometry import MeshFile

THINNER = 0.7  # an edge layer that the load made thinner by this is meshed anew


def static_state(
    team: Team, plan: Plan, aim: float | None, units: state.Units, watch: Stopwatch
) -> tuple[state.StaticState, float]:
    """The state that the modes are about, on a mesh for it, and its edge layer's width. Collective.

    A layer that the load makes thinner is meshed anew.
    """
    scene, scales = plan.scene, plan.scales
    with watch.stage("mesh"):
        chosen = discretised(plan, plan.layer, aim)
        plate = build_plate(team.within, scene, scales, chosen, team.across)
    if scene.flat and not relaxes(plate):
        return state.StaticState(plate), plan.layer
    with watch.stage("static state"):
        static = state.solve(scene, units, plate)
        width = float(np.sqrt(scales.bending / max(static.tension or 0.0, scales.bending)))
        if 0 < width < THINNER * plan.layer and not isinstance(scene.geometry, MeshFile):
            finer = discretised(plan, width, aim)
            plate = build_plate(team.within, scene, scales, finer, team.across)
            static = state.solve(scene, units, plate)
    return static, width


def discretised(plan: Plan, width: float, aim: float | None) -> Discretisation:
    """What is meshed for an aimed error, and for a film whose edge layer has a width."""
    scene, layer_width = plan.scene, plan.layer
    if 0 < width < THINNER * layer_width:
        layer_width = width
    chosen = discretisation.choose(scene, plan.scales.length, layer_width, aim)
    # a static load case of STEP mixes modes of every parity: it needs the whole film
    return chosen if scene.flat else attrs.evolve(chosen, whole=not plan.cut.axes)
