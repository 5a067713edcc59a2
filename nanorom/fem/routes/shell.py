"""From a scene to the reduced model of its shell, by STEP.

The scene's film is meshed as a surface in space: flat, raised to its initial shape, or the surface
of a mesh file.  Where it is flat, the plate's model is computed beside it and the difference told.
"""

from __future__ import annotations

from math import comb
from typing import Any

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.fem import plan_text
from nanorom.fem.fields import quadrature
from nanorom.fem.mesh import discretisation
from nanorom.fem.models.build_shell import build_shell, build_surface
from nanorom.fem.models.shell import LOWEST_DEGREE, Shell
from nanorom.fem.modes import names as labels
from nanorom.fem.modes import shell as shells
from nanorom.fem.modes.deflections import Deflections
from nanorom.fem.modes.normal import normalise
from nanorom.fem.modes.shell import ShellModes
from nanorom.fem.output import drawing
from nanorom.fem.output.model import Parts
from nanorom.fem.plan import Plan
from nanorom.fem.plan_text import Item
from nanorom.fem.routes.plate import PlateRoute
from nanorom.fem.routes.route import Route
from nanorom.fem.routes.tolerance import Refinement, solved_to_tolerance
from nanorom.fem.scales import Scales
from nanorom.fem.solvers.groups import Team, check_alike
from nanorom.fem.statics.shell_state import equilibrium
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.symmetry import Mirrors
from nanorom.fem.tensors import amplitude as shellstep
from nanorom.fem.tensors import shell_outside
from nanorom.fem.tensors.shell_cases import ShellCases
from nanorom.fem.tensors.step import EXTRAPOLATED, StepResult, check_potential, step
from nanorom.files.partial import Journal
from nanorom.rom.patterns import DrawnWork, reduced
from nanorom.rom.shapes import Shapes
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit

SHELL_DEGREE = 6  # unless the scene states one: higher ones take long to compile
REFINEMENT = Refinement(3, 0.5, "the estimated error of the frequencies is")


@attrs.frozen(eq=False)
class Solution:
    """Modes about the static state on one mesh, and how much one degree less changes them."""

    modes: ShellModes
    names: list[str]
    error: float
    rounding: float = 0.0
    mixing: float = 0.0


class ShellRoute(Route):
    """Geometrically exact shells, by STEP."""

    in_space = True

    def check(self, scene: Scene) -> None:
        """Raise SceneError for what a shell cannot be asked."""
        super().check(scene)
        check(scene)

    def method(self, scene: Scene) -> str:
        """The force of a shell is no polynomial: only static load cases find its coefficients."""
        return "step"

    def load_cases(self, plan: Plan) -> tuple[int, int]:
        """Cases with their opposites, to tell even from odd, at all amplitudes.

        Opposite cases of a flat shell are images of each other; mirrors of the surface, which its
        nodes and modes tell once they are there, make them fewer still.
        """
        scene, n = plan.scene, len(plan.scene.modes.numbers)
        amplitudes = EXTRAPOLATED if scene.reduction.amplitude is None else 1
        half = amplitudes * (n + 2 * comb(n, 2) + comb(n, 3))
        return half if self._flat(scene) else 2 * half, 2 * half

    @staticmethod
    def _flat(scene: Scene) -> bool:
        """Whether the scene tells that the surface is flat; of a mesh file only the file does."""
        return scene.flat and not isinstance(scene.geometry, MeshFile)

    def items(self, plan: Plan) -> list[Item]:
        """State, bending, modes, tensors; a shell is meshed as a whole."""
        cases, flat = self.load_cases(plan), self._flat(plan.scene)
        return [
            plan_text.state_item(plan),
            plan_text.bending_item(plan),
            plan_text.mirror_item(Mirrors()),
            plan_text.modes_item(plan),
            *plan_text.tensor_items(plan, "step", cases, flat=flat),
        ]

    def cost(self, plan: Plan) -> str:
        """Cells and their degree."""
        scene = plan.scene
        chosen = plan.discretisation(scene.accuracy.tolerance)
        cells = discretisation.cells_of(chosen)
        where = ""
        if cells is None:
            data = discretisation.meshed(chosen, self.in_space)
            cells, sides = len(data.cells), data.sides * plan.scales.length
            box = " by ".join(with_unit(side, "m", 3) for side in sides)
            where = f"{chosen.source.name}, {box}: "
        cells *= chosen.mirrors.copies
        return f"{where}{cells} cells of degree {scene.accuracy.degree or SHELL_DEGREE} or more"

    def parts(self, plan: Plan, team: Team, watch: Stopwatch, journal: Journal) -> Parts:
        """Static state, modes, load cases, patterns; a flat shell is compared with the plate."""
        scene, scales = plan.scene, plan.scales
        solution = solved_to_tolerance(scene, lambda aim: solve(team, plan, aim, watch), REFINEMENT)
        shell = solution.modes.shell
        selected = np.array(scene.modes.numbers) - 1
        modes = solution.modes.like(normalise(solution.modes.modes.take(selected)))
        with watch.stage("tensors"):
            cases = ShellCases(modes)
            result, outside, told = tensors_of(scene, scales, cases, watch, journal)
        with watch.stage("patterns"):
            points, cells, values = drawing.triangulation(with_deflection(modes))
            mass = np.diag(modes.products(shell.kinetic_energy))
            slope = modes.products(shell.unit_tension_energy)
            area = integrals(shell, modes.modes.shapes)
            shapes = Shapes(points * scales.length, cells, values[:-1])
            momentum = scales.mass * modes.momentum()
            work = DrawnWork(shapes, scales.length**2 * area, slope, momentum)
        stiffness = np.diag(mass * modes.eigenvalues)
        # what the modes' tangential inertia does beyond the static condensation of STEP
        told["tangential_inertia"] = float(
            np.abs(np.diag(cases.linear) / np.diag(stiffness) - 1).max()
        )
        parts = Parts(
            frequency=scales.frequency(modes.eigenvalues),
            mass=scales.mass * mass,
            label=[solution.names[i] for i in selected],
            stiffness=scales.tension * stiffness,
            quadratic=scales.tension / scales.length * result.quadratic,
            cubic=scales.tension / scales.length**2 * result.cubic,
            outside_cubic=outside,
            patterns=reduced(work, None),
            shapes=shapes,
            static=static_state(scales.length * values[-1]),
            method=self.method(scene),
            diagnostics=told | {"error_frequency": solution.error} | _size(shell),
        )
        if shell.is_flat:
            with watch.stage("plate"):
                plate = Plan.of(as_plate(scene))
                alone = PlateRoute().parts(plate, team, watch.apart(), Journal())
            parts.diagnostics.update(compared(parts, alone))
        return parts


def _size(shell: Shell) -> dict[str, Any]:
    return {
        "dofs": int(shell.space.dofmap.index_map.size_global) * 6,
        "cells": int(shell.mesh.topology.index_map(2).size_global),
        "degree": shell.degree,
    }


def tensors_of(
    scene: Scene, scales: Scales, cases: ShellCases, watch: Stopwatch, journal: Journal
) -> tuple[StepResult, np.ndarray | None, dict[str, Any]]:
    """Tensors by STEP in the shell's units, what the outside adds (SI), and what is known of them.

    Collective.
    """
    h, stated = scene.plate.thickness / scales.length, scene.reduction.amplitude
    if stated is None:
        amplitude, change = shellstep.plateau(cases, h)
    else:
        amplitude = stated / scales.length
        change = shellstep.change(cases, amplitude, h)
    result = step(
        cases,
        amplitude,
        cases.permitted(4),
        extrapolate=stated is None,
        progress=lambda i, n: watch.tell("load cases", i, n),
        journal=journal,
    )
    check_potential(result)
    result = attrs.evolve(
        result,
        quadratic=result.quadratic * cases.permitted(3),
        cubic=result.cubic * cases.permitted(4),
    )
    told: dict[str, Any] = {
        "asymmetry": result.asymmetry,
        "load_cases": result.n_cases,
        "amplitude": amplitude * scales.length,
        "plateau": change,
        "truncation": shellstep.truncation(cases, result, h),
    }
    outside = None
    if scene.reduction.outside == "static":
        outside = shell_outside.response(cases, amplitude)
    if outside is None:
        return result, None, told
    told["outside_frequency"] = float(scales.frequency(np.array(outside.eigenvalue)))
    return result, scales.tension / scales.length**2 * outside.cubic, told


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


def compared(shell: Parts, plate: Parts) -> dict[str, float]:
    """Largest relative difference to the plate, of frequencies and of the cubic tensor."""
    cubic = np.abs(shell.cubic - plate.cubic).max() / np.abs(plate.cubic).max()
    return {
        "plate_frequency_difference": float(np.abs(shell.frequency / plate.frequency - 1).max()),
        "plate_cubic_difference": float(cubic),
    }


# -- static state and modes -----------------------------------------------------------------------


def solve(team: Team, plan: Plan, aim: float | None, watch: Stopwatch) -> Solution:
    """Static state and modes on one mesh, of two degrees. Collective."""
    scene, scales, chosen = plan.scene, plan.scales, plan.discretisation(aim)
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
    error = team.across.bcast(float(error))  # all groups decide alike
    # of the difference of two squared frequencies
    deflections, names = labels.name(scene, modes.modes, 4 * error)
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
