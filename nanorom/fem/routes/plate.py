"""Membranes and plates, flat, loaded or curved: modes, tensors and errors on one mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from nanorom.errors import SceneError, SolverError
from nanorom.fem.fields import places
from nanorom.fem.mesh import discretisation
from nanorom.fem.models import layer
from nanorom.fem.models.build import build_plate, pulls_at_free_edge
from nanorom.fem.modes import accuracy, buckling, coupled, eigen
from nanorom.fem.modes import names as labels
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.modes.normal import normalise_film
from nanorom.fem.output import drawing
from nanorom.fem.output.model import ModalProducts
from nanorom.fem.plan import Plan
from nanorom.fem.scales import Scales
from nanorom.fem.solvers.groups import Team
from nanorom.fem.statics import state
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.tensors import direct as condensation
from nanorom.fem.tensors import loaded, selection
from nanorom.fem.tensors import step as stiffness_evaluation
from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.inplane import InPlane
from nanorom.fem.tensors.loaded_cases import static_cases
from nanorom.fem.tensors.tangent import tangent
from nanorom.files.partial import Journal
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene

THINNER = 0.7  # an edge layer that the load made thinner by this is meshed anew
COUPLED = 1e-3  # of the stiffness of two modes; near ones that are told apart have up to 5e-4


def viscous(
    scene: Scene, scales: Scales, modes: Modes, products: ModalProducts
) -> dict[str, np.ndarray]:
    """Parts of the force that a viscoelastic material damps, if the scene has one. Collective.

    bending: (L, L) in N/m; stretching: (L, L, L, L) in N/m^3, force on mode r from the slope of
    mode l and the stress of the pair jk.
    """
    if scene.damping is None or scene.damping.material_time == 0:
        return {}
    plate = modes.plate
    if plate.shape is not None or plate.attraction is not None:
        raise SceneError("damping.material_time: only for a film that its load leaves flat")
    if plate.springs:
        raise SceneError("damping.material_time: only for rigid supports; found springs")
    tension = float(plate.tension_x.value), float(plate.tension_y.value)
    bending = products.stiffness - np.einsum("d,drs->rs", tension, products.slopes)
    in_plane, unit = scene.reduction.in_plane, float(plate.membrane_stiffness.value)
    pairs, _ = condensation.stretching_products(plate, modes.shapes, modes.parities, in_plane)
    return {
        "bending": scales.tension * bending * (scales.bending > 0),
        "stretching": 0.5 * scales.cubic / unit * pairs.transpose(0, 2, 3, 1),
    }


def check_uncoupled(stiffness: np.ndarray, names: Sequence[str]) -> None:
    """Raise SolverError if modes are coupled by their stiffness (L, L): they are no eigenmodes."""
    size = np.sqrt(np.abs(stiffness.diagonal()))
    coupling = np.abs(stiffness) / np.outer(size, size)
    np.fill_diagonal(coupling, 0.0)
    first, second = np.unravel_index(coupling.argmax(), coupling.shape)
    if not coupling[first, second] <= COUPLED:
        raise SolverError(
            f"modes {first + 1} ({names[first]}) and {second + 1} ({names[second]}) are coupled by "
            f"{coupling[first, second]:.1e} of their stiffness, more than {COUPLED:g}: they are no "
            "eigenmodes; refine the mesh or ask for a smaller tolerance"
        )


@attrs.frozen(eq=False)
class Solution:
    """Modes that take part, their names, tensors in SI units, and what is known of the errors.

    stretching: what it adds to the modes' stiffness, scaled; static: the state they are about;
    outside: what everything outside the modes adds to the cubic tensor, if anything.
    """

    modes: Modes
    names: list[str]
    static: state.StaticState
    stretching: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray
    diagnostics: dict[str, Any]
    outside: np.ndarray | None = None

    @property
    def error(self) -> float:
        """Largest estimated error of a frequency or of the tensor."""
        return max(self.diagnostics["error_frequency"], self.diagnostics["error_tensor"])


def solve(
    team: Team,
    plan: Plan,
    aim: float | None,
    watch: Stopwatch,
    journal: Journal | None = None,
) -> Solution:
    """Modes and tensors on one mesh, with estimates of their errors. Collective."""
    scene, scales, chosen = plan.scene, plan.scales, plan.discretisation(aim)
    if not scene.flat:
        # a static load case of STEP mixes modes of every parity: it needs the whole film
        chosen = attrs.evolve(chosen, whole=not plan.cut.axes)
    with watch.stage("mesh"):
        plate = build_plate(team.within, scene, scales, chosen, team.across)
    units = state.Units.of(scene, scales.length, scales.tension)
    static, width = state.StaticState(plate), plan.layer
    if not scene.flat or pulls_at_free_edge(plate):
        with watch.stage("static state"):
            static = state.solve(scene, units, plate)
            width = float(np.sqrt(scales.bending / max(static.tension or 0.0, scales.bending)))
            if 0 < width < THINNER * plan.layer and not isinstance(scene.geometry, MeshFile):
                finer = discretisation.choose(scene, scales.length, width, aim)
                finer = attrs.evolve(finer, whole=chosen.whole)
                plate = build_plate(team.within, scene, scales, finer, team.across)
                static = state.solve(scene, units, plate)
    plate = static.plate
    unseen = layer.unseen(plate, width, scales.length, scene.accuracy.tolerance)
    with watch.stage("modes"):
        try:
            modes = coupled.solve(plate, scene.modes.highest)
        except eigen.UnstableError as error:
            raise SolverError(buckling.told(plate, scene.tension, not scene.flat)) from error
        modes, names = labels.name(scene, modes)
        selected = np.array(scene.modes.numbers) - 1
        stiffening = accuracy.stiffening_of(plate, static.tension)
        modes, errors = normalise_film(modes.take(selected), stiffening)
    with watch.stage("tensors"):
        outside = None
        stretching = np.zeros((len(selected),) * 2)
        if plate.shape is None and plate.attraction is None:
            quadratic, cubic, in_plane, diagnostics = tensors(scene, scales, modes, watch, journal)
        else:
            found = loaded.tensors(modes, outside=scene.reduction.outside == "static")
            quadratic, cubic, diagnostics = loaded_tensors(
                scene, scales, units, modes, found, watch, journal
            )
            stretching, in_plane = found.stretching, found.in_plane
            if found.outside is not None:
                outside = scales.cubic * found.outside.cubic * selection.permitted(modes, 4)
                slowest = scales.frequency(np.array(found.outside.eigenvalue))
                diagnostics["outside_frequency"] = float(slowest)
        quadratic *= selection.permitted(modes, 3)
        cubic *= selection.permitted(modes, 4)
    with watch.stage("errors"):
        if static.deflection is not None:
            diagnostics["error_state"] = accuracy.of_state(
                plate, static.deflection, stiffening, in_plane.error
            )
        frequency = errors.frequency
        if static.relaxed is not None:
            frequency = frequency + accuracy.of_relaxation(
                modes, static.relaxed, in_plane.energies
            )
        diagnostics |= {
            "error_frequency": float(frequency.max())
            + diagnostics.get("error_state", 0.0)
            + unseen,
            "error_frequencies": frequency,
            # what changes stiffness changes shapes too
            "error_tensor": accuracy.of_tensor(cubic, errors, in_plane.error)
            + float((frequency - errors.frequency).max())
            + diagnostics.get("error_state", 0.0)
            + unseen,
            "error_rounding": float(errors.rounding.max()),
        }
        if np.isfinite(in_plane.eigenvalue):
            diagnostics["in_plane_frequency"] = scales.in_plane_frequency(in_plane.eigenvalue)
        diagnostics |= plate.solvers.told(team.across)
        diagnostics = team.across.bcast(diagnostics)  # all groups decide alike
    named = [names[i] for i in selected]
    return Solution(modes, named, static, stretching, quadratic, cubic, diagnostics, outside)


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
    plate, count = modes.plate, modes.shapes.shape[1]
    in_plane = scene.reduction.in_plane
    if scene.reduction.method == "direct":
        cubic, known = condensation.cubic_tensor(modes, in_plane)
        return np.zeros((count,) * 3), scales.cubic * cubic, known, {"asymmetry": 0.0}
    amplitude = scene.reduction.amplitude or scene.plate.thickness
    # with deflections in units of the amplitude, stretching is measured against the tension
    strength = scales.cubic * amplitude**2 / scales.tension
    plate.membrane_stiffness.value = strength
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


def on_triangulation(
    solution: Solution, scales: Scales
) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Points, cells, shapes and, in SI, the static state on a triangulation. Collective."""
    static, modes = solution.static, solution.modes
    if static.tension is None:
        return *drawing.triangulation(modes), {}
    plate = static.plate
    unit = scales.length * np.sqrt(scales.tension / (scales.cubic * scales.length**2))
    w = static.deflection
    if w is None:
        w = np.zeros(len(plate.w.x.array))
    extended = attrs.evolve(
        modes,
        shapes=np.column_stack([modes.shapes, w]),
        parities=[*modes.parities, plate.mirrors.even],
    )
    points, cells, values = drawing.triangulation(extended)
    deflection = unit * values[-1]
    found = {
        "deflection": deflection,
        "largest_deflection": deflection[np.abs(deflection).argmax()],
        "mean_tension": np.array(scales.tension * static.tension),
    }
    centre = places.centre_value(plate, w)
    if centre is not None:
        found["centre_deflection"] = np.array(unit * centre)
    return points, cells, values[:-1], found
