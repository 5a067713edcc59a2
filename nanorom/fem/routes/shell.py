"""From a scene to the reduced model of its shell, by STEP.

The scene's film is meshed as a surface in space: flat, raised to its initial shape, or the surface
of a mesh file.  Where it is flat, the plate's model is computed beside it and the difference told.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from nanorom.errors import AccuracyWarning, SceneError
from nanorom.fem.fields import quadrature
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.models.build_shell import build_shell, build_surface
from nanorom.fem.models.shell import LOWEST_DEGREE, Shell
from nanorom.fem.modes import names as labels
from nanorom.fem.modes import shell as shells
from nanorom.fem.modes.deflections import Deflections
from nanorom.fem.modes.normal import normalise
from nanorom.fem.modes.shell import ShellModes
from nanorom.fem.output import drawing
from nanorom.fem.plan import SHELL_DEGREE, Plan
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import Team, check_alike
from nanorom.fem.statics.shell_state import equilibrium
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.tensors import amplitude as shellstep
from nanorom.fem.tensors import shell_outside
from nanorom.fem.tensors.shell_cases import ShellCases
from nanorom.fem.tensors.step import check_potential, step
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import unaimed
from nanorom.rom.shapes import Shapes
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene

MOST_MESHES = 3  # attempts at a tolerance
COARSER = 0.5  # aims of successive meshes, at most


@attrs.frozen(eq=False)
class Solution:
    """Modes about the static state on one mesh, and how much one degree less changes them."""

    modes: ShellModes
    names: list[str]
    error: float


def reduce_shell(
    scene: Scene,
    watch: Stopwatch,
    team: Team,
    reduce_plate: Callable[[Scene], ReducedModel],
) -> ReducedModel:
    """Reduced model of a scene whose plate.model is shell. Collective.

    ``reduce_plate`` gives the model of the same film as a plate.  Warns with AccuracyWarning where
    the tolerance is not met.
    """
    check(scene)
    scales = Scales.of(scene)
    solution = solve_to_tolerance(team, scene, scales, watch)
    shell, h = solution.modes.shell, scene.plate.thickness / scales.length
    selected = np.array(scene.modes.numbers) - 1
    modes = solution.modes.like(normalise(solution.modes.modes.take(selected)))
    with watch.stage("tensors"):
        cases = ShellCases(modes)
        stated = scene.reduction.amplitude
        if stated is None:
            amplitude, change = shellstep.plateau(cases, h)
        else:
            amplitude = stated / scales.length
            change = shellstep.change(cases, amplitude, h)
        result = step(
            cases,
            amplitude,
            extrapolate=stated is None,
            progress=lambda i, n: watch.tell("load cases", i, n),
        )
        check_potential(result)
        missed = shellstep.truncation(cases, result, h)
        outside = None
        if scene.reduction.outside == "static":
            outside = shell_outside.response(cases, amplitude)
    with watch.stage("patterns"):
        points, cells, values = drawing.triangulation(with_deflection(modes))
        mass = np.diag(modes.products(shell.kinetic_energy))
        slope = modes.products(shell.unit_tension_energy)
        area = integrals(shell, modes.modes.shapes)
    stiffness = np.diag(mass * modes.eigenvalues)
    # what the modes' tangential inertia does beyond the static condensation of STEP
    inertia = np.abs(np.diag(cases.linear) / np.diag(stiffness) - 1).max()
    quadratic = scales.tension / scales.length * result.quadratic
    cubic = scales.tension / scales.length**2 * result.cubic
    direct, parametric = unaimed(scales.length**2 * area, slope)
    diagnostics: dict[str, Any] = {
        "asymmetry": result.asymmetry,
        "load_cases": result.n_cases,
        "amplitude": amplitude * scales.length,
        "plateau": change,
        "truncation": missed,
        "tangential_inertia": float(inertia),
        "error_frequency": solution.error,
        "dofs": int(shell.space.dofmap.index_map.size_global) * 6,
        "cells": int(shell.mesh.topology.index_map(2).size_global),
        "degree": shell.degree,
        "ranks": team.within.size * team.across.size,
        "groups": team.across.size,
    }
    model = ReducedModel(
        frequency=scales.frequency(modes.eigenvalues),
        mass=scales.mass * mass,
        label=tuple(solution.names[i] for i in selected),
        number=selected + 1,
        stiffness=scales.tension * stiffness,
        damping=np.zeros_like(stiffness),
        quadratic=quadratic,
        cubic=cubic,
        outside_cubic=None
        if outside is None
        else scales.tension / scales.length**2 * outside.cubic,
        drive=direct,
        parametric=parametric,
        shapes=Shapes(points * scales.length, cells, values[:-1]),
        static=static_state(scales.length * values[-1]),
        diagnostics=diagnostics,
        scene=scene.to_toml(),
        method="step",
        in_plane="free",
        versions=compat.versions(),
    )
    if outside is not None:
        slowest = scales.frequency(np.array(outside.eigenvalue))
        model.diagnostics["outside_frequency"] = float(slowest)
    if shell.is_flat:
        with watch.stage("plate"):
            plate = reduce_plate(as_plate(scene))
        model = attrs.evolve(model, diagnostics=model.diagnostics | compared(model, plate))
    model.diagnostics.update({f"seconds_{k}": seconds for k, seconds in watch.seconds.items()})
    return model if scene.damping is None else model.with_damping(scene.damping)


def check(scene: Scene) -> None:
    """Raise SceneError for what a shell cannot be asked."""
    if scene.reduction.method == "tangent":
        raise SceneError(
            "reduction.method: found tangent; allowed: step, the way in which shells are reduced"
        )
    if scene.reduction.in_plane == "fixed":
        raise SceneError("reduction.in_plane: found fixed; allowed for a shell: free")
    if scene.damping is not None and scene.damping.material_time > 0:
        raise SceneError("damping.material_time: only for plates and membranes")
    degree = scene.accuracy.degree
    if degree is not None and degree < LOWEST_DEGREE:
        raise SceneError(
            f"accuracy.degree: found {degree}; allowed: {LOWEST_DEGREE} to 8 for a shell, which "
            "locks at lower ones"
        )
    load = scene.load
    if load is None:
        return
    for key in ("voltage", "force"):
        if getattr(load, key) is not None:
            raise SceneError(
                f"load.{key}: found beside plate.model = shell; allowed: pressure, stress"
            )
    if load.pressure is not None and "free" in scene.supports.values():
        raise SceneError(
            "load.pressure: it follows a shell, and has no potential where an edge is free; hold "
            "every edge, or take plate.model = plate"
        )


def as_plate(scene: Scene) -> Scene:
    """The same film as a plate, reduced directly."""
    reduction = attrs.evolve(scene.reduction, method="direct", amplitude=None)
    return attrs.evolve(
        scene,
        plate=attrs.evolve(scene.plate, model="plate"),
        reduction=reduction,
        damping=None,
        drive=None,
        sweep=None,
    )


def compared(shell: ReducedModel, plate: ReducedModel) -> dict[str, float]:
    """Largest relative difference to the plate, of frequencies and of the cubic tensor."""
    cubic = np.abs(shell.cubic - plate.cubic).max() / np.abs(plate.cubic).max()
    return {
        "plate_frequency_difference": float(np.abs(shell.frequency / plate.frequency - 1).max()),
        "plate_cubic_difference": float(cubic),
    }


# -- static state and modes -----------------------------------------------------------------------


def solve_to_tolerance(team: Team, scene: Scene, scales: Scales, watch: Stopwatch) -> Solution:
    """Static state and modes on a mesh made for the tolerance, and on finer ones until it is met.

    Warns with AccuracyWarning where none of `MOST_MESHES` meshes meets it.  Collective.
    """
    plan = Plan.of(scene)
    tolerance = aim = scene.accuracy.tolerance
    for _ in range(MOST_MESHES):
        solution = solve(team, scene, scales, plan.discretisation(aim), watch)
        if tolerance is None or aim is None or solution.error <= tolerance:
            return solution
        aim *= min(COARSER, tolerance / solution.error)
        if isinstance(scene.geometry, MeshFile) and scene.geometry.file.suffix == ".msh":
            break
    warnings.warn(
        f"tolerance {tolerance:g} is not met: the estimated error of the frequencies is "
        f"{solution.error:.1e}",
        AccuracyWarning,
        stacklevel=2,
    )
    return solution


def solve(
    team: Team, scene: Scene, scales: Scales, chosen: Discretisation, watch: Stopwatch
) -> Solution:
    """Static state and modes on one mesh, of two degrees. Collective."""
    degree = scene.accuracy.degree or SHELL_DEGREE
    with watch.stage("mesh"):
        domain = build_surface(team.within, scene, scales, attrs.evolve(chosen, degree=degree))
        check_alike(team.across, domain.mesh.geometry.x)
        domain = attrs.evolve(domain, across=team.across)
    found = []
    for each in (degree - 1, degree):
        shell = build_shell(scene, scales, domain, each)
        with watch.stage("static state"):
            problem = equilibrium(scene, scales, shell)
        with watch.stage("modes"):
            found.append(shells.solve(shell, problem, scene.modes.highest))
    coarse, modes = found
    n = scene.modes.highest
    error = np.abs(coarse.eigenvalues[:n] / modes.eigenvalues[:n] - 1).max() / 2
    deflections, names = labels.name(scene, modes.modes)
    error = team.across.bcast(float(error))  # all groups decide alike
    return Solution(modes.like(deflections), names, error)


# -- results --------------------------------------------------------------------------------------


def integrals(shell: Shell, shapes: np.ndarray) -> np.ndarray:
    """int phi (L,) over the mid-surface. Collective."""
    area = np.zeros(shapes.shape[1])
    for field in quadrature.fields(shell, columns=2 * shapes.shape[1]):
        area += np.einsum("cq,cqn->n", field.weights, field.value(shapes))
    return shell.domain.comm.allreduce(area)


def with_deflection(modes: ShellModes) -> Deflections:
    """The modes and, as one more, the deflection of the static state. Collective."""
    shell = modes.shell
    static = shell.normal_displacement(shell.state.x.array[:, None])
    shapes = np.column_stack([modes.modes.shapes, static])
    return attrs.evolve(modes.modes, shapes=shapes, parities=[()] * shapes.shape[1])


def static_state(deflection: np.ndarray) -> dict[str, np.ndarray]:
    """What is stored of a static deflection in m, nothing if there is none."""
    if not deflection.any():
        return {}
    largest = deflection[np.abs(deflection).argmax()]
    return {"deflection": deflection, "largest_deflection": np.array(largest)}
