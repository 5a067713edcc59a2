"""From a scene to its reduced model: steps I to IV of the paper in order."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from mpi4py import MPI

import nanorom
from nanorom import inertia
from nanorom.beam import reduce_beam
from nanorom.errors import AccuracyWarning, SceneError, SolverError
from nanorom.fem import (
    accuracy,
    buckling,
    compat,
    condensation,
    discretisation,
    drawing,
    film,
    labels,
    layer,
    loaded,
    patterns,
    quadrature,
    selection,
    shapefile,
    shellreduce,
    state,
)
from nanorom.fem import modes as eigen
from nanorom.fem import step as stiffness_evaluation
from nanorom.fem.build import build_plate, pulls_at_free_edge
from nanorom.fem.cases import FlatCases
from nanorom.fem.groups import Team, memory, split
from nanorom.fem.inplane import InPlane
from nanorom.fem.modes import Modes
from nanorom.fem.plan import Plan
from nanorom.fem.scales import Scales
from nanorom.fem.shapes import normalise_film
from nanorom.fem.stopwatch import Progress, Stopwatch
from nanorom.fem.tangent import tangent
from nanorom.journal import Journal
from nanorom.rom import ReducedModel, Shapes
from nanorom.scene import MeshFile, Scene

THINNER = 0.7  # an edge layer that the load made thinner by this is meshed anew
COUPLED = 1e-3  # of the stiffness of two modes; near ones that are told apart have up to 5e-4
MOST_MESHES = 5  # attempts at a tolerance


def reduce_scene(
    scene: Scene,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    output: Path | None = None,
    groups: int | None = None,
) -> ReducedModel:
    """Reduced model of a scene. Collective: every rank gets the same model.

    The ranks share the mesh, or split into ``groups`` which each have the whole mesh and share
    classes of symmetry and load cases; None: as many as `Plan.groups` finds best.  Load cases of
    STEP that an interrupted run left beside the ``output`` are not solved again.
    Raises SceneError, MeshError or SolverError with one line that names the cause.
    """
    if scene.plate.model == "beam":
        return reduce_beam(scene)
    if scene.plate.initial_shape is not None:
        shapefile.read_table(scene.plate.initial_shape)  # before anything expensive
    watch = Stopwatch(progress)
    plan = Plan.of(scene)
    if groups is None:
        groups = plan.groups(comm.size, memory(comm))
    team = split(comm, groups)
    if scene.plate.model == "shell":
        return shellreduce.reduce_shell(
            scene, watch, team, lambda plate: reduce_scene(plate, progress, comm, groups=groups)
        )
    scales = plan.scales
    journal = Journal(output, key_of(scene, comm.size) if output else "", comm)
    solution = solve_to_tolerance(team, plan, watch, journal)
    modes, plate = solution.modes, solution.modes.plate
    frequency = scales.frequency(modes.eigenvalues)
    inertia.check(solution.diagnostics.get("in_plane_frequency", np.inf), frequency[-1])
    selected = np.array(scene.modes.numbers) - 1
    with watch.stage("patterns"):
        products = modal_products(modes)
        aimed = patterns.aimed(modes, scene.drive, scales.length)
        points, cells, values, static = on_triangulation(solution, scales)
    diagnostics = solution.diagnostics | {
        "dofs": int(plate.deflections.dofmap.index_map.size_global),
        "cells": int(plate.domain.mesh.topology.index_map(2).size_global),
        "degree": plate.degree,
        "mirrors": "".join(plate.mirrors.axes),
        "ranks": comm.size,
        "groups": groups,
        **{f"seconds_{stage}": seconds for stage, seconds in watch.seconds.items()},
    }
    names, quadratic, cubic = solution.names, solution.quadratic, solution.cubic
    stiffness = scales.tension * (products.stiffness + solution.stretching)
    check_uncoupled(stiffness, names)
    mass = scales.mass * products.mass
    pressure = scales.length**2 * products.area
    model = ReducedModel(
        frequency=frequency,
        mass=mass,
        label=tuple(names),
        number=selected + 1,
        stiffness=stiffness,
        damping=np.zeros_like(stiffness),
        quadratic=quadratic,
        cubic=cubic,
        drive={"pressure": pressure} | aimed,
        parametric={"tension": -products.slope, "paper": np.diag(pressure)},
        shapes=Shapes(points * scales.length, cells, values),
        static=static,
        diagnostics=diagnostics,
        scene=scene.to_toml(),
        method=scene.reduction.method,
        in_plane=scene.reduction.in_plane,
        versions=compat.versions(),
        **viscous(scene, scales, modes, products),
    )
    mass_matrix = modes.mass  # it keeps the film's communicator
    del solution, modes, plate, products
    compat.free_memory(team.within, mass_matrix.comm.tompi4py())
    mass_matrix.destroy()
    return model if scene.damping is None else model.with_damping(scene.damping)


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

    stretching: what it adds to the modes' stiffness, scaled; static: the state they are about.
    """

    modes: Modes
    names: list[str]
    static: state.StaticState
    stretching: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray
    diagnostics: dict[str, Any]

    @property
    def error(self) -> float:
        """Largest estimated error of a frequency or of the tensor."""
        return max(self.diagnostics["error_frequency"], self.diagnostics["error_tensor"])


def key_of(scene: Scene, ranks: int) -> str:
    """What a static load case depends on beside the mesh and the modes, as a digest."""
    digest = hashlib.sha256(repr((nanorom.__version__, compat.versions(), ranks)).encode())
    digest.update(scene.to_toml().encode())
    if isinstance(scene.geometry, MeshFile):
        digest.update(scene.geometry.file.read_bytes())
    if scene.plate.initial_shape is not None:
        digest.update(scene.plate.initial_shape.read_bytes())
    return digest.hexdigest()


def solve_to_tolerance(
    team: Team, plan: Plan, watch: Stopwatch, journal: Journal | None = None
) -> Solution:
    """Solve on a mesh made for the tolerance, and again on finer ones until it is met.

    Warns with AccuracyWarning where rounding or cost forbids it.  Collective.
    """
    tolerance = plan.scene.accuracy.tolerance
    if tolerance is None:
        return solve(team, plan, None, watch, journal)
    aim, solutions = tolerance, []
    for _ in range(MOST_MESHES):
        solution = solve(team, plan, aim, watch, journal)
        solutions.append(solution)
        if solution.error <= tolerance:
            return solution
        if solution.diagnostics["error_rounding"] > tolerance / 2 or not can_refine(plan.scene):
            break
        aim = power_below(aim * min(0.3, tolerance / solution.error))
        compat.free_memory(team.within, solution.modes.mass.comm.tompi4py())
    best = min(solutions, key=lambda solution: solution.error)
    warnings.warn(
        f"tolerance {tolerance:g} is not met: estimated error {best.error:.1e} "
        f"(of which rounding {best.diagnostics['error_rounding']:.1e})",
        AccuracyWarning,
        stacklevel=2,
    )
    return best


def power_below(value: float) -> float:
    """The next power of two: the same for estimates that differ in rounding, as of other ranks."""
    return float(2.0 ** np.floor(np.log2(value)))


def can_refine(scene: Scene) -> bool:
    """Whether a finer mesh can be made: not from a mesh that is given as such."""
    geometry = scene.geometry
    return not (isinstance(geometry, MeshFile) and geometry.file.suffix == ".msh")


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
            modes = loaded.solve(plate, scene.modes.highest)
        except eigen.UnstableError as error:
            raise SolverError(buckling.told(plate, scene.tension)) from error
        modes, names = labels.name(scene, modes)
        selected = np.array(scene.modes.numbers) - 1
        stiffening = accuracy.stiffening_of(plate, static.tension)
        modes, errors = normalise_film(modes.take(selected), stiffening)
    with watch.stage("tensors"):
        stretching = np.zeros((len(selected),) * 2)
        if plate.shape is None and plate.attraction is None:
            quadratic, cubic, in_plane, diagnostics = tensors(scene, scales, modes, watch, journal)
        else:
            stretching, quadratic, cubic, in_plane, diagnostics = loaded_tensors(
                scene, scales, units, modes, watch, journal
            )
        quadratic *= selection.permitted(modes, 3)
        cubic *= selection.permitted(modes, 4)
    with watch.stage("errors"):
        if static.deflection is not None:
            diagnostics["error_state"] = accuracy.of_state(
                plate, static.deflection, stiffening, in_plane.error
            )
        diagnostics |= {
            "error_frequency": float(errors.frequency.max())
            + diagnostics.get("error_state", 0.0)
            + unseen,
            "error_frequencies": errors.frequency,
            "error_tensor": accuracy.of_tensor(cubic, errors, in_plane.error) + unseen,
            "error_rounding": float(errors.rounding.max()),
        }
        if np.isfinite(in_plane.eigenvalue):
            diagnostics["in_plane_frequency"] = scales.in_plane_frequency(in_plane.eigenvalue)
        diagnostics |= plate.solvers.told(team.across)
        diagnostics = team.across.bcast(diagnostics)  # all groups decide alike
    named = [names[i] for i in selected]
    return Solution(modes, named, static, stretching, quadratic, cubic, diagnostics)


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
            modes, count, 1.0, in_plane, lambda i, n: watch.tell("load cases", i, n), journal
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
    watch: Stopwatch,
    journal: Journal | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, InPlane, dict[str, Any]]:
    """The same about a static state, after the scaled linear stretching. Collective."""
    method, count = scene.reduction.method, len(modes.parities)
    found: dict[str, Any] = {"asymmetry": 0.0}
    direct = loaded.tensors(modes)
    quadratic, cubic = direct.quadratic, direct.cubic
    if method == "step":
        amplitude = scene.reduction.amplitude or scene.plate.thickness
        result = stiffness_evaluation.step(
            modes,
            count,
            amplitude / units.deflection,
            progress=lambda i, n: watch.tell("load cases", i, n),
            journal=journal,
        )
        stiffness_evaluation.check_potential(result)
        quadratic, cubic = result.quadratic, result.cubic
        found = {"asymmetry": result.asymmetry, "load_cases": result.n_cases}
        found["amplitude"] = amplitude
    quadratic = scales.tension / units.deflection * quadratic
    return direct.stretching, quadratic, scales.cubic * cubic, direct.in_plane, found


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
    centre = film.centre_value(plate, w)
    if centre is not None:
        found["centre_deflection"] = np.array(unit * centre)
    return points, cells, values[:-1], found


@attrs.frozen
class ModalProducts:
    """Scaled integrals: Phi^T K Phi, int phi^2, int phi, int d_i phi d_i phi (2, L, L)."""

    stiffness: np.ndarray
    mass: np.ndarray
    area: np.ndarray
    slopes: np.ndarray

    @property
    def slope(self) -> np.ndarray:
        """int grad phi . grad phi."""
        return np.asarray(self.slopes.sum(axis=0))


def modal_products(modes: Modes) -> ModalProducts:
    """Modal matrices from the assembled operators, patterns by quadrature. Collective."""
    plate, shapes = modes.plate, modes.shapes
    n_modes = shapes.shape[1]
    comm, copies = plate.domain.comm, plate.mirrors.copies
    area, slope = np.zeros(n_modes), np.zeros((2, n_modes, n_modes))
    for field in quadrature.fields(plate, columns=2 * n_modes):
        area += np.einsum("cq,cqn->n", field.weights, field.value(shapes))
        gradient = field.gradient(shapes)
        weighted = gradient * field.weights[..., None, None]
        slope += np.einsum("cqdr,cqds->drs", gradient, weighted, optimize=True)
    slope, area = copies * comm.allreduce(slope), copies * comm.allreduce(area)
    parities = modes.parities
    slope[:, [[a != b for b in parities] for a in parities]] = 0.0
    area[[parity != plate.mirrors.even for parity in parities]] = 0.0
    mass = modes.modal(dict.fromkeys(parities, modes.mass))
    return ModalProducts(modes.modal_stiffness(), np.diag(mass).copy(), area, slope)
