"""Membranes and plates, flat, loaded or curved: modes, tensors and errors on one mesh."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import comb
from typing import Any

import attrs
import numpy as np

from nanorom.errors import SolverError
from nanorom.fem import plan_text
from nanorom.fem.fields import places
from nanorom.fem.mesh import discretisation
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.models import following, inertia, layer
from nanorom.fem.models.build import check_springs
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes import accuracy, buckling, coupled, eigen, tilted
from nanorom.fem.modes import names as labels
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.modes.normal import normalise_film
from nanorom.fem.output import drawing, heat, losses, patterns
from nanorom.fem.output.model import Parts, modal_products
from nanorom.fem.plan import Plan
from nanorom.fem.plan_text import Item
from nanorom.fem.routes.about import discretised, static_state
from nanorom.fem.routes.methods import Force, check_viscous, force_of, motion_of, viscous
from nanorom.fem.routes.route import Route, step_cases
from nanorom.fem.routes.tolerance import Refinement, solved_to_tolerance
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import Team
from nanorom.fem.statics import state
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.symmetry import is_of_revolution
from nanorom.fem.tensors import inextensional, lateral, squeeze
from nanorom.files.partial import Journal
from nanorom.rom.patterns import reduced
from nanorom.rom.shapes import Shapes
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit

REFINEMENT = Refinement(most=5, finer=0.3, told="estimated error")
# measured, one core of 2020: s, and s per degree of freedom, also per pair of modes and load case
SECONDS_FIXED, SECONDS_PER_DOF = 0.1, 2.5e-4  # drums and rectangles that mirrors cut
SECONDS_WHOLE = 5e-4  # perforated drums of 2.6e4 to 5e4, whose factors fill more
SECONDS_PER_PAIR, SECONDS_PER_CASE = 7e-7, 1.8e-6
SECONDS_RELAXED, SECONDS_LOADED = 2.5e-4, 3e-3  # more where a static state is found first
BYTES_PER_DOF = 3e3  # per degree of the deflection: peak of a group with factors, rounded up
SHARE = 0.5  # of the free memory that a default may fill


@attrs.frozen(eq=False)
class Solution:
    """Modes that take part, their names, their force, and what is known of the errors.

    static: the state they are about; mesh: what is meshed for an aimed error, aim: that of its own.
    """

    modes: Modes
    names: list[str]
    static: state.StaticState
    force: Force
    diagnostics: dict[str, Any]
    mesh: Callable[[float | None], Discretisation]
    aim: float | None

    def has_mesh_of(self, aim: float) -> bool:
        """Whether its mesh is that for another aimed error."""
        return self.mesh(aim) == self.mesh(self.aim)

    @property
    def error(self) -> float:
        """Largest estimated error of a frequency or of the tensor."""
        return max(self.diagnostics["error_frequency"], self.diagnostics["error_tensor"])

    @property
    def rounding(self) -> float:
        """The part of it that no mesh makes smaller."""
        return float(self.diagnostics["error_rounding"])

    @property
    def mixing(self) -> float:
        """The part of it that modes of nearly one frequency cause, see `accuracy.ModeErrors`."""
        return float(self.diagnostics["error_mixing"])

    def discard(self, team: Team) -> None:
        """Free what is not referred to any more of the films before this one. Collective."""
        compat.free_memory(team.within, self.modes.mass.comm.tompi4py())


def solve(
    team: Team,
    plan: Plan,
    aim: float | None,
    watch: Stopwatch,
    journal: Journal | None = None,
) -> Solution:
    """Modes and tensors on one mesh, with estimates of their errors. Collective."""
    scene, scales = plan.scene, plan.scales
    units = state.Units.of(scene, scales.length, scales.tension)
    static, width = static_state(team, plan, aim, units, watch)
    plate = static.plate
    missed = plan.left_out
    missed += layer.unseen(plate, width, scales.length, scene.accuracy.tolerance)
    with watch.stage("modes"):
        try:
            modes = coupled.solve(plate, scene.modes.highest)
        except eigen.UnstableError as error:
            deflected = static.deflection is not None
            raise SolverError(buckling.told(plate, scales.tension, deflected)) from error
        stiffening = accuracy.stiffening_of(plate, static.tension)
        modes, names = labels.name(scene, modes, accuracy.unsure(modes, stiffening))
        selected = np.array(scene.modes.numbers) - 1
        modes, errors = normalise_film(modes, selected, stiffening)
    with watch.stage("tensors"):
        force = force_of(scene, scales, units, modes, watch, journal)
    with watch.stage("errors"):
        quadratic = units.deflection / scales.tension * force.quadratic
        errors = tilted.relieved(modes, errors, force.cubic / scales.cubic)
        told = force.diagnostics | error_estimates(
            static, modes, errors, force, quadratic, stiffening, missed
        )
        if np.isfinite(force.in_plane.eigenvalue):
            eigenvalue = force.in_plane.eigenvalue
            told["in_plane_frequency"] = scales.in_plane_frequency(eigenvalue)
        told |= plate.solvers.told(team.across)
        told = team.across.bcast(told)  # all groups decide alike
    named = [names[i] for i in selected]
    return Solution(modes, named, static, force, told, partial(discretised, plan, width), aim)


def error_estimates(
    static: state.StaticState,
    modes: Modes,
    errors: accuracy.ModeErrors,
    force: Force,
    quadratic: np.ndarray,
    stiffening: float,
    missed: float,
) -> dict[str, Any]:
    """Estimated relative errors of frequencies and of the cubic tensor, by name. Collective.

    errors: of the modes; quadratic: their force in the plate's units; stiffening: of the state, see
    `accuracy.stiffening_of`; missed: effect of what the model leaves out, and of an edge layer that
    the mesh does not see.
    """
    found: dict[str, Any] = {}
    frequency, of_state = errors.frequency, 0.0
    if static.deflection is not None:
        of_state = accuracy.of_state(
            static.plate, static.deflection, stiffening, force.in_plane.error
        )
        found["error_state"] = of_state
        frequency = frequency + accuracy.of_softening(
            modes, static.deflection, stiffening, force.in_plane.error, quadratic
        )
    if static.relaxed is not None:
        energies = force.in_plane.energies
        frequency = frequency + accuracy.of_relaxation(modes, static.relaxed, energies)
    of_shapes = accuracy.of_tensor(force.cubic, errors, force.in_plane.error)
    of_stiffness = float((frequency - errors.frequency).max())  # it changes shapes too
    return found | {
        "error_frequency": float(frequency.max()) + of_state + missed,
        "error_frequencies": frequency,
        "error_tensor": of_shapes + of_stiffness + of_state + missed,
        "error_rounding": float(errors.rounding.max()),
        "error_mixing": float(errors.mixing.max()),
    }


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
        w = np.zeros(len(modes.shapes))
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
    if static.other is not None:
        highest = static.other[np.abs(static.other).argmax()]
        highest = max(plate.domain.comm.allgather(highest), key=abs)
        found["other_deflection"] = np.array(unit * highest)
    centre = places.centre_value(plate, w)
    if centre is not None:
        found["centre_deflection"] = np.array(unit * centre)
    return points, cells, values[:-1], found


# -- the route ------------------------------------------------------------------------------------


class PlateRoute(Route):
    """Plates and membranes, flat or about a static state, cut at their mirrors."""

    of_plates = True

    def check(self, scene: Scene) -> None:
        """Raise SceneError for springs and viscous films that cannot be computed, too."""
        super().check(scene)
        check_springs(scene, Scales.of(scene))
        check_viscous(scene)

    def groups(self, plan: Plan, ranks: int, memory: float) -> int:
        """Groups share classes of symmetry, which wait for each other less than ranks that share a
        mesh do; memory in free bytes."""
        most = plan.cut.copies
        if (dofs := plan.dofs) is not None:
            most = min(most, int(SHARE * memory / (BYTES_PER_DOF * plan.degree * dofs)))
        return max(g for g in range(1, ranks + 1) if ranks % g == 0 and g <= max(most, 1))

    def load_cases(self, plan: Plan) -> tuple[int, int]:
        """Pairs for the direct route, states or cases for the others."""
        n, method = len(plan.scene.modes.numbers), self.method(plan.scene)
        if method == "direct":
            return comb(n + 1, 2), comb(n + 1, 2)
        if method == "tangent":
            return n + comb(n, 2), 2 * n + comb(n, 2)
        every = step_cases(n)
        return (n + 2 * comb(n, 2) + comb(n, 3) if plan.scene.flat else every), every

    def items(self, plan: Plan) -> list[Item]:
        """State, bending, mirrors, modes, tensors."""
        scene = plan.scene
        found = [
            plan_text.state_item(plan),
            plan_text.bending_item(plan),
            plan_text.mirror_item(plan.discretisation(scene.accuracy.tolerance).mirrors),
            plan_text.modes_item(plan),
            *plan_text.tensor_items(
                plan, self.method(scene), self.load_cases(plan), flat=scene.flat
            ),
        ]
        if is_of_revolution(scene):
            what = "entries whose nodal diameters cannot add up to 0"
            found.append(Item(what, False, "they are zero on a body of revolution"))
        if scene.reduction.in_plane == "fixed":
            found.append(Item("in-plane equilibrium", False, "reduction.in_plane is fixed"))
        return found

    def cost(self, plan: Plan) -> str:
        """Cells, degrees of freedom, seconds."""
        scene = plan.scene
        chosen = plan.discretisation(scene.accuracy.tolerance)
        cells = discretisation.cells_of(chosen)
        where, columns = "", self.load_cases(plan)[0]
        if cells is None:
            data = discretisation.meshed(chosen)
            cells, sides = len(data.cells), data.sides * plan.scales.length
            box = " by ".join(with_unit(side, "m", 3) for side in sides[:2])
            where = f"{chosen.source.name}, {box}: "
        dofs = discretisation.dofs_of(cells, chosen.degree)
        per_column = SECONDS_PER_CASE
        if self.method(scene) == "direct":
            per_column = SECONDS_PER_PAIR
        elif self.method(scene) == "tangent":
            columns *= len(scene.modes.numbers)
        per_dof = SECONDS_PER_DOF if chosen.mirrors.axes else SECONDS_WHOLE
        if plan_text.state_item(plan).computed:
            per_dof += SECONDS_RELAXED if scene.load is None else SECONDS_LOADED
        seconds = float(f"{SECONDS_FIXED + (per_dof + per_column * columns) * dofs:.1g}")
        return (
            f"{where}{cells} cells of degree {chosen.degree}, about {dofs} degrees of freedom of "
            f"the deflection, about {seconds:g} s on one core, once the forms are compiled; "
            "several times more if estimated errors ask for finer meshes"
        )

    def parts(self, plan: Plan, team: Team, watch: Stopwatch, journal: Journal) -> Parts:
        """Static state, modes, tensors, patterns; every mesh anew until the tolerance is met."""
        scene, scales = plan.scene, plan.scales

        def attempt(aim: float | None) -> Solution:
            return solve(team, plan, aim, watch, journal)

        def discard(last: Solution) -> None:
            last.discard(team)

        solution = solved_to_tolerance(scene, attempt, REFINEMENT, discard, Solution.has_mesh_of)
        modes, plate, force = solution.modes, solution.modes.plate, solution.force
        frequency = scales.frequency(modes.eigenvalues)
        in_plane = solution.diagnostics.get("in_plane_frequency", np.inf)
        classes = dict(zip(scene.modes.numbers, modes.parities))
        inertia.check(in_plane, frequency[-1], classes, partial(lateral.is_slender, plate))
        with watch.stage("patterns"):
            products = modal_products(modes)
            units = state.Units.of(scene, scales.length, scales.tension)
            work = patterns.PolynomialWork(
                modes, products, scales.length, units.deflection, scales.mass
            )
            made = reduced(work, scene.drive)
            warmth = heat.heat_of(scene, scales, modes, work)
            points, cells, values, static = on_triangulation(solution, scales)
        stiffness = scales.tension * (products.stiffness + force.stretching)
        eigen.check_uncoupled(stiffness, solution.names)
        gas = None
        if scene.gas is not None and scene.gas.gap is not None:
            mass = scales.mass * products.mass
            gas = squeeze.squeezed(modes, scene.gas, scales.length, mass, stiffness.diagonal())
            stiffness, frequency = stiffness + np.diag(gas.stiffness.real), gas.frequency
        own, unit = np.einsum("iiii->i", force.cubic), scales.tension / scales.length**2
        curvature = inextensional.curvature_cubic(modes, own / unit, products.stiffness.diagonal())
        motion = motion_of(scene, scales, modes, products, force.stretching, gas)
        of_range = inextensional.told(curvature, own / unit, solution.names, unit)
        told = _told(solution, frequency, stiffness, scene, motion)
        parts = Parts(
            frequency=frequency,
            mass=scales.mass * products.mass,
            label=solution.names,
            stiffness=stiffness,
            quadratic=force.quadratic,
            cubic=force.cubic,
            outside_cubic=force.outside,
            patterns=made,
            shapes=Shapes(points * scales.length, cells, values),
            static=static,
            viscous=viscous(scene, scales, modes),
            heat=warmth,
            losses=losses.losses(scene, motion),
            method=scene.reduction.method,
            in_plane=scene.reduction.in_plane,
            diagnostics=told | of_range | _size(plate),
        )
        mass_matrix = modes.mass  # it keeps the film's communicator
        del solution, modes, plate, products, force, work
        compat.free_memory(team.within, mass_matrix.comm.tompi4py())
        mass_matrix.destroy()
        return parts


def _told(
    solution: Solution,
    frequency: np.ndarray,
    stiffness: np.ndarray,
    scene: Scene,
    motion: losses.Motion | None,
) -> dict[str, Any]:
    """What is known of a solution; warnings if what is outside its modes is no slave of theirs, or
    their losses are uncertain.
    """
    told, force = dict(solution.diagnostics), solution.force
    own = told.pop("outside_own_frequencies", None)
    if own is not None and force.outside is not None:
        tensors = stiffness, force.quadratic, force.cubic, force.outside
        change = following.dynamics(frequency, own, *tensors)
        following.check(solution.names, change, frequency, own)
        told["outside_dynamics"] = change
    errors = told["error_frequencies"]
    # what is not of single modes is in the largest
    errors = errors + told["error_frequency"] - errors.max()
    return told | losses.told(scene, motion, errors, solution.names)


def _size(plate: Plate) -> dict[str, Any]:
    return {
        "dofs": int(plate.deflections.dofmap.index_map.size_global),
        "cells": int(plate.domain.mesh.topology.index_map(2).size_global),
        "degree": plate.degree,
        "mirrors": "".join(plate.mirrors.axes),
    }
