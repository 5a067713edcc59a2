"""Tensors of a plate or membrane by the method that its scene asks for, in SI units."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.modes import bending, reaction
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.output import losses
from nanorom.fem.output.model import ModalProducts
from nanorom.fem.scales import Scales
from nanorom.fem.statics import state
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.tensors import direct as condensation
from nanorom.fem.tensors import loaded, selection
from nanorom.fem.tensors import step as stiffness_evaluation
from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.inplane import InPlane
from nanorom.fem.tensors.loaded_cases import static_cases
from nanorom.fem.tensors.squeeze import Squeezed
from nanorom.fem.tensors.tangent import tangent
from nanorom.files.partial import Journal
from nanorom.scene.scene import Scene

FLAT_ALONE = "only for a film that neither its load nor its shape bends; leave it out, or both"


@attrs.frozen(eq=False)
class Force:
    """What the modes' force is beyond tension and bending, and what is known of it.

    stretching: (L, L), what it adds to the modes' stiffness, scaled; quadratic (L, L, L) N/m^2,
    cubic (L, L, L, L) N/m^3; outside: what everything outside the modes adds to it, if anything;
    in_plane: what is known of the in-plane displacements.
    """

    stretching: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray
    outside: np.ndarray | None
    in_plane: InPlane
    diagnostics: dict[str, Any]


def force_of(
    scene: Scene,
    scales: Scales,
    units: state.Units,
    modes: Modes,
    watch: Stopwatch,
    journal: Journal | None = None,
) -> Force:
    """The force of all modes, entries that symmetry makes zero left out. Collective."""
    outside, count = None, len(modes.parities)
    if modes.plate.state.odd:
        quadratic, cubic, in_plane, told = tensors(scene, scales, modes, watch, journal)
        stretching = np.zeros((count, count))
    else:
        found = loaded.tensors(modes, outside=scene.reduction.outside == "static")
        quadratic, cubic, told = loaded_tensors(scene, scales, units, modes, found, watch, journal)
        stretching, in_plane = found.stretching, found.in_plane
        if found.outside is not None:
            outside = scales.cubic * found.outside.cubic * selection.permitted(modes, 4)
            slowest = scales.frequency(np.array(found.outside.eigenvalue))
            told["outside_frequency"] = float(slowest)
            told["outside_own_frequencies"] = scales.frequency(found.outside.own)
    quadratic *= selection.permitted(modes, 3)
    cubic *= selection.permitted(modes, 4)
    return Force(stretching, quadratic, cubic, outside, in_plane, told)


def tensors(
    scene: Scene,
    scales: Scales,
    modes: Modes,
    watch: Stopwatch,
    journal: Journal | None = None,
) -> tuple[np.ndarray, np.ndarray, InPlane, dict[str, Any]]:
    """Quadratic (N/m^2) and cubic (N/m^3) tensors by the route that the scene asks for.

    Also what is known of the in-plane displacements and what the route tells of itself. Collective.
    """
    count, in_plane = modes.shapes.shape[1], scene.reduction.in_plane
    if scene.reduction.method == "direct":
        cubic, known = condensation.cubic_tensor(modes, in_plane)
        return np.zeros((count,) * 3), scales.cubic * cubic, known, {"asymmetry": 0.0}
    amplitude = scene.reduction.amplitude or scene.plate.thickness
    # with deflections in units of the amplitude, stretching is measured against the tension
    strength = scales.cubic * amplitude**2 / scales.tension
    plate = modes.plate.resisting(attrs.evolve(modes.plate.stiffness, stretching=strength))
    modes = attrs.evolve(modes, film=plate)
    if scene.reduction.method == "tangent":
        result = tangent(FlatCases(modes, in_plane), 1.0)
    else:
        result = stiffness_evaluation.step(
            static_cases(modes, in_plane),
            1.0,
            selection.permitted(modes, 4),
            progress=lambda i, n: watch.tell("load cases", i, n),
            journal=journal,
        )
    stiffness_evaluation.check_potential(result)
    quadratic = scales.tension / amplitude * result.quadratic
    cubic = scales.cubic / strength * result.cubic
    found = {"asymmetry": result.asymmetry, "load_cases": result.n_cases, "amplitude": amplitude}
    return quadratic, cubic, result.in_plane, found


def loaded_tensors(
    scene: Scene,
    scales: Scales,
    units: state.Units,
    modes: Modes,
    direct: loaded.Tensors,
    watch: Stopwatch,
    journal: Journal | None = None,
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """The same tensors about a static state, and what the route tells of itself. Collective."""
    method = scene.reduction.method
    found: dict[str, Any] = {"asymmetry": 0.0}
    quadratic, cubic = direct.quadratic, direct.cubic
    if method == "step":
        amplitude = scene.reduction.amplitude or scene.plate.thickness
        result = stiffness_evaluation.step(
            static_cases(modes),
            amplitude / units.deflection,
            selection.permitted(modes, 4),
            progress=lambda i, n: watch.tell("load cases", i, n),
            journal=journal,
        )
        stiffness_evaluation.check_potential(result)
        quadratic, cubic = result.quadratic, result.cubic
        found = {"asymmetry": result.asymmetry, "load_cases": result.n_cases}
        found["amplitude"] = amplitude
    quadratic = scales.tension / units.deflection * quadratic
    return quadratic, scales.cubic * cubic, found


def motion_of(
    scene: Scene,
    scales: Scales,
    modes: Modes,
    products: ModalProducts,
    stretching: np.ndarray,
    gas: Squeezed | None = None,
) -> losses.Motion | None:
    """What losses of modes follow from, None if the scene has none. Collective.

    stretching: (L, L) that the film's state adds to the modes' stiffness, scaled; gas: in a gap.
    """
    if not scene.lossy:
        return None
    strained, lossy = bending.stiffness(modes) + stretching, None
    if scene.regions:
        lossy = bending.lost(modes) + scene.material.loss * stretching
        lossy = scales.tension * np.diag(lossy)
    dilated = bending.stiffness(modes, losses.dilated(scene))
    pulling = None
    if scene.support.impedance is not None:
        pulling = scales.tension**2 / scales.length * reaction.squares(modes)
    return losses.Motion(
        frequency=scales.frequency(modes.eigenvalues) if gas is None else gas.frequency,
        stiffness=scales.tension * np.diag(products.stiffness + stretching),
        strained=scales.tension * strained,
        dilated=scales.tension * np.diag(dilated),
        mass=scales.mass * products.mass,
        square=scales.length**2 * modes.squares(),
        lossy=lossy,
        squeezed=None if gas is None else gas.stiffness,
        pulling=pulling,
    )


def check_viscous(scene: Scene) -> None:
    """Raise SceneError for a viscoelastic material in a film that is bent, or on springs."""
    if scene.damping is None or scene.damping.material_time == 0:
        return
    if scene.support.springs:
        raise SceneError("damping.material_time: only for rigid supports; found springs")
    load = scene.load
    bends = load is not None and load.deflects and load.gates is None
    if bends or scene.plate.initial_shape is not None:
        raise SceneError(f"damping.material_time: {FLAT_ALONE}")


def viscous(scene: Scene, scales: Scales, modes: Modes) -> dict[str, np.ndarray]:
    """Parts of the force that a viscoelastic material damps, if the scene has one. Collective.

    bending: (L, L) in N/m, what the modes' stiffness is without any membrane force, constant or
    relaxed; stretching: (L, L, L, L) in N/m^3, force on mode r from the slope of
    mode l and the stress of the pair jk.
    """
    if scene.damping is None or scene.damping.material_time == 0:
        return {}
    plate = modes.plate
    if not plate.state.odd:  # gates on both sides may leave it flat, which they alone know
        raise SceneError(f"damping.material_time: {FLAT_ALONE}")
    in_plane = scene.reduction.in_plane
    pairs, _ = condensation.stretching_products(plate, modes.shapes, modes.parities, in_plane)
    return {
        "bending": scales.tension * bending.stiffness(modes),
        "stretching": 0.5 * scales.cubic * pairs.transpose(0, 2, 3, 1),
    }
