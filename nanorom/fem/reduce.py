"""From a scene to its reduced model: steps I to IV of the paper in order."""

from __future__ import annotations

import hashlib
import warnings
from pathlib import Path

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.errors import AccuracyWarning, NanoromError
from nanorom.fem.models import inertia, initial_shape
from nanorom.fem.output import patterns
from nanorom.fem.output.model import modal_products
from nanorom.fem.plan import Plan
from nanorom.fem.routes import shell
from nanorom.fem.routes.beam import reduce_beam
from nanorom.fem.routes.plate import Solution, check_uncoupled, on_triangulation, solve, viscous
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import Team, memory, split
from nanorom.fem.stopwatch import Progress, Stopwatch
from nanorom.files.partial import Journal
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import unaimed
from nanorom.rom.shapes import Shapes
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene
from nanorom.version import version

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
        initial_shape.read_table(scene.plate.initial_shape)  # before anything expensive
    watch = Stopwatch(progress)
    plan = Plan.of(scene)
    if groups is None:
        groups = plan.groups(comm.size, memory(comm))
    team = split(comm, groups)
    if scene.plate.model == "shell":
        return shell.reduce_shell(
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
    direct, parametric = unaimed(scales.length**2 * products.area, products.slope)
    model = ReducedModel(
        frequency=frequency,
        mass=mass,
        label=tuple(names),
        number=selected + 1,
        stiffness=stiffness,
        damping=np.zeros_like(stiffness),
        quadratic=quadratic,
        cubic=cubic,
        outside_cubic=solution.outside,
        drive=direct | aimed,
        parametric=parametric,
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


def key_of(scene: Scene, ranks: int) -> str:
    """What a static load case depends on beside the mesh and the modes, as a digest."""
    digest = hashlib.sha256(repr((version(), compat.versions(), ranks)).encode())
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

    Warns with AccuracyWarning where rounding or cost forbids it, or where a finer mesh fails: the
    best solution so far is kept.  Collective.
    """
    tolerance = plan.scene.accuracy.tolerance
    if tolerance is None:
        return solve(team, plan, None, watch, journal)
    aim, failure = tolerance, ""
    solutions: list[Solution] = []
    for _ in range(MOST_MESHES):
        try:
            solution = solve(team, plan, aim, watch, journal)
        except (NanoromError, PETSc.Error) as error:
            if not solutions:
                raise
            failure = f"; a finer mesh failed: {error}"
            break
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
        f"(of which rounding {best.diagnostics['error_rounding']:.1e}){failure}",
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
