"""From a scene to the reduced model of a solid, in three dimensions.

The scene's film is made as thick as it is, or the volumes of a mesh file are taken as they are.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import attrs
import numpy as np

from nanorom.errors import MeshError
from nanorom.fem import plan_text
from nanorom.fem.mesh import thick
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.models import build_solid, following
from nanorom.fem.models.solid import LOWEST_DEGREE, Solid
from nanorom.fem.modes import eigen
from nanorom.fem.modes import solid as solids
from nanorom.fem.modes.solid import SolidModes
from nanorom.fem.output import losses
from nanorom.fem.output.model import Parts
from nanorom.fem.output.solid import SolidWork, drawn
from nanorom.fem.plan import Plan
from nanorom.fem.plan_text import Item
from nanorom.fem.routes import solid_check
from nanorom.fem.routes.route import Route
from nanorom.fem.routes.tolerance import Refinement, can_refine, solved_to_tolerance
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import Team, check_alike
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.symmetry import Mirrors
from nanorom.fem.tensors.solid import SolidTensors, condensed
from nanorom.files.partial import Journal
from nanorom.rom.patterns import reduced
from nanorom.scene import plausibility
from nanorom.scene.material import Material
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit

REFINEMENT = Refinement(4, 0.5, "the estimated error is")
COARSER = 8.0  # in aim: cells at edges, on which the error depends, are three times as long
BY_SHAPE = 5.0  # errors of a tensor by those of frequencies, at least: measured up to 4.5
FEWER = 0.6  # cells of the coarser mesh at most by those of the finer: else it tells no error


@attrs.frozen(eq=False)
class Solution:
    """Modes and tensors on one mesh, and how much others differ from them, relative.

    errors: of frequencies, and of the cubic tensor by its largest entry.
    """

    modes: SolidModes
    tensors: SolidTensors
    errors: tuple[float, float]
    rounding: float = 0.0
    mixing: float = 0.0

    @property
    def error(self) -> float:
        """The larger one of frequencies and tensors."""
        return max(self.errors)


class SolidRoute(Route):
    """Solids in tetrahedra, all that lies outside the modes condensed directly."""

    def check(self, scene: Scene) -> None:
        """Raise SceneError for what a solid cannot be asked."""
        super().check(scene)
        solid_check.check(scene)

    def method(self, scene: Scene) -> str:
        """The force of a solid is cubic: what lies outside the modes is condensed exactly."""
        return "direct"

    def load_cases(self, plan: Plan) -> tuple[int, int]:
        """One for each pair of modes."""
        n = len(plan.scene.modes.numbers)
        return n * (n + 1) // 2, n * (n + 1) // 2

    def items(self, plan: Plan) -> list[Item]:
        """Modes and tensors of the whole solid."""
        return [
            Item("pre-stress", False, "a uniform stress is in equilibrium with the held faces"),
            plan_text.mirror_item(Mirrors()),
            plan_text.modes_item(plan),
            *plan_text.tensor_items(plan, "direct", self.load_cases(plan), flat=False),
        ]

    def cost(self, plan: Plan) -> str:
        """Cells, their degree and unknowns."""
        scene = plan.scene
        chosen = thick.choose(scene, plan.scales.length, scene.accuracy.tolerance)
        cells, where = chosen.source.cells, ""
        if cells is None:
            data = chosen.source.mesh(1)
            box = " by ".join(with_unit(side, "m", 3) for side in data.sides * plan.scales.length)
            cells, where = len(data.cells), f"{chosen.source.name}, {box}: "
        unknowns = build_solid.unknowns_of(cells, chosen.degree)
        first = "" if scene.accuracy.tolerance is None else " at first"
        return (
            f"{where}{cells} tetrahedra of degree {chosen.degree}, about {unknowns} "
            f"unknowns{first}; {build_solid.MOST_UNKNOWNS} at most"
        )

    def span(self, plan: Plan) -> plausibility.Span:
        """Shorter and longer side in plan; of a file that is read for it. One process."""
        scene = plan.scene
        known = plausibility.span_of(scene)
        if known is not None:
            return known
        chosen = thick.choose(scene, plan.scales.length, scene.accuracy.tolerance)
        data = chosen.source.mesh(1)
        build_solid.held_of(scene, list(data.facets))
        *_, short, long = np.sort(data.sides) * plan.scales.length
        return float(short), float(long)

    def parts(self, plan: Plan, team: Team, watch: Stopwatch, journal: Journal) -> Parts:
        """Modes, tensors, patterns and losses, to the scene's tolerance."""
        scene, length = plan.scene, plan.scales.length
        material = scene.material
        solution = solved_to_tolerance(scene, lambda aim: solve(team, plan, aim, watch), REFINEMENT)
        modes, tensors = solution.modes, solution.tensors
        modulus = material.youngs_modulus
        clock = np.sqrt(modulus / material.density) / length  # rad/s of an eigenvalue of 1
        frequency = clock * np.sqrt(modes.eigenvalues) / (2 * np.pi)
        with watch.stage("patterns"):
            shapes = drawn(modes, length)
            along = build_solid.stretched(scene)
            size = scene.plate.thickness
            work = SolidWork(modes, shapes, length, material.density, size, along)
            patterns = reduced(work, scene.drive)
            motion = motion_of(modes, tensors.stiffness, frequency, scene.material, length)
        error = np.full(len(frequency), solution.errors[0])
        own = clock * np.sqrt(tensors.own) / (2 * np.pi)
        unit = modulus / length
        stiffness, quadratic = modulus * length * tensors.stiffness, modulus * tensors.quadratic
        cubic, outside = unit * tensors.cubic, unit * tensors.outside
        change = following.dynamics(frequency, own, stiffness, quadratic, cubic - outside, outside)
        following.check(modes.names, change, frequency, own)
        return Parts(
            frequency=frequency,
            mass=motion.mass,
            label=modes.names,
            stiffness=stiffness,
            quadratic=quadratic,
            cubic=cubic,
            patterns=patterns,
            shapes=shapes,
            losses=losses.losses(scene, motion),
            method=self.method(scene),
            diagnostics={
                "asymmetry": tensors.asymmetry,
                "error_frequency": solution.errors[0],
                "error_tensor": solution.errors[1],
                "outside_dynamics": change,
                "outside_frequency": float(clock * np.sqrt(tensors.eigenvalue) / (2 * np.pi)),
            }
            | losses.told(scene, motion, error, modes.names)
            | _size(modes.solid),
        )


def _size(solid: Solid) -> dict[str, Any]:
    return {
        "dofs": int(solid.free.size),
        "cells": int(solid.domain.mesh.topology.index_map(3).size_global),
        "degree": solid.degree,
    }


def motion_of(
    modes: SolidModes,
    stiffness: np.ndarray,
    frequency: np.ndarray,
    material: Material,
    length: float,
) -> losses.Motion:
    """What losses of the modes follow from, in SI; stiffness (L, L) in the solid's units.
    Collective.
    """
    modulus, density = material.youngs_modulus, material.density
    mass = density * length**3 * modes.masses()
    borne = np.zeros_like(stiffness)
    for axis, stress in enumerate(modes.solid.stress):
        if stress:
            borne += stress * modes.solid.slopes(modes.shapes, [axis])
    strained = modulus * length * (stiffness - borne)
    return losses.Motion(
        frequency=frequency,
        stiffness=modulus * length * np.diag(stiffness),
        strained=strained,
        dilated=np.diag(strained),
        mass=mass,
        square=mass / density,
    )


def solve(team: Team, plan: Plan, aim: float | None, watch: Stopwatch) -> Solution:
    """Modes and tensors on one mesh, and how far they are from coarser ones. Collective."""
    scene, length = plan.scene, plan.scales.length
    chosen = thick.choose(scene, length, aim if can_refine(scene) else None)
    modes, tensors = _solved(team, scene, chosen, watch)
    rough_modes, rough = _beside(team, plan, chosen, aim, modes, watch)
    frequency = np.abs(rough_modes.eigenvalues / modes.eigenvalues - 1).max() / 2
    groups = eigen.clusters(modes.eigenvalues, solids.PAIR)
    coarse, fine = (_shares(each.cubic, groups) for each in (rough, tensors))
    change = np.abs(coarse - fine).max() / np.abs(fine).max()
    change = max(change, BY_SHAPE * frequency)
    errors = team.across.bcast((float(frequency), float(change)))
    return Solution(modes, tensors, errors)


def _beside(
    team: Team,
    plan: Plan,
    chosen: Discretisation,
    aim: float | None,
    modes: SolidModes,
    watch: Stopwatch,
) -> tuple[SolidModes, SolidTensors]:
    """The same on a mesh of fewer cells if there is one, else by one degree less. Collective.

    Of degree 2, by one more: the lowest one locks.
    """
    if aim is not None and can_refine(plan.scene):
        coarser = thick.choose(plan.scene, plan.scales.length, COARSER * aim)
        with suppress(MeshError):  # of cells that are too large for a curved surface
            found = _solved(team, plan.scene, coarser, watch)
            if _size(found[0].solid)["cells"] <= FEWER * _size(modes.solid)["cells"]:
                return found
    step = -1 if chosen.degree > LOWEST_DEGREE else 1
    return _solved(team, plan.scene, attrs.evolve(chosen, degree=chosen.degree + step), watch)


def _shares(cubic: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
    """Means of B_iijj over modes i and j of two groups of like frequency, for all groups.

    They do not depend on the signs of shapes, nor on how pairs are turned, which a coarse mesh
    knows to some degrees only.
    """
    own = np.einsum("iijj->ij", cubic)
    return np.array([[own[np.ix_(a, b)].mean() for b in groups] for a in groups])


def _solved(
    team: Team, scene: Scene, chosen: Discretisation, watch: Stopwatch
) -> tuple[SolidModes, SolidTensors]:
    """Modes and tensors on one mesh. Collective."""
    with watch.stage("mesh"):
        domain = build_solid.build_domain(team.within, chosen)
        check_alike(team.across, domain.mesh.geometry.x)
    solid = build_solid.build_solid(scene, domain, chosen.degree)
    with watch.stage("modes"):
        index = np.array(scene.modes.numbers) - 1
        modes = solids.solve(solid, scene.modes.highest).take(index)
    with watch.stage("tensors"):
        tensors = condensed(modes)
    compat.free_memory(team.within)
    return modes, tensors
