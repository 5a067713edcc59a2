"""What a route from a scene to its reduced model has to know and do: one row of the registry."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import comb
from pathlib import Path

import numpy as np

from nanorom.fem.mesh import discretisation
from nanorom.fem.models import initial_shape
from nanorom.fem.models.build import boundary_kinds
from nanorom.fem.output.model import Parts
from nanorom.fem.plan import Plan
from nanorom.fem.plan_text import Item
from nanorom.fem.solvers.groups import Team
from nanorom.fem.stopwatch import Stopwatch
from nanorom.files.partial import Journal
from nanorom.scene import plausibility
from nanorom.scene.scene import Scene
from nanorom.scene.wrinkles import TENSION_KEY


class Route(ABC):
    """What it refuses, what it needs, what that costs, and the parts of the model that it makes.

    of_plates: its film is a plate or membrane, whose states can be followed with their load;
    in_space: a mesh file may be a surface in space.
    """

    of_plates = False
    in_space = False

    def check(self, scene: Scene) -> None:
        """Raise SceneError for what this route cannot do, before anything expensive."""
        span = plausibility.span_of(scene)
        if span is not None:
            plausibility.check(scene, span)
        if scene.plate.shape_file is not None:
            initial_shape.read_table(scene.plate.shape_file)
        if isinstance(scene.tension.variation, Path):
            initial_shape.read_table(scene.tension.variation, TENSION_KEY)

    def method(self, scene: Scene) -> str:
        """How the tensors are found: direct, step or tangent."""
        return scene.reduction.method

    def groups(self, plan: Plan, ranks: int, memory: float) -> int:
        """How many groups of ranks are the fastest: of them, each has the whole mesh in its part
        of memory (free bytes)."""
        return 1

    @abstractmethod
    def load_cases(self, plan: Plan) -> tuple[int, int]:
        """Static solutions at most, and how many there would be without skips."""

    @abstractmethod
    def items(self, plan: Plan) -> list[Item]:
        """Everything that could be computed, in the order of the computation."""

    @abstractmethod
    def cost(self, plan: Plan) -> str:
        """Predicted size and run time, in words."""

    def span(self, plan: Plan) -> plausibility.Span:
        """Shorter and longer side of the film in m; a mesh file is read for it. One process.

        Raises SceneError if the supports name curves that the file does not have.
        """
        known = plausibility.span_of(plan.scene)
        if known is not None:
            return known
        chosen = plan.discretisation(plan.scene.accuracy.tolerance)
        data = discretisation.meshed(chosen, self.in_space)
        boundary_kinds(plan.scene, list(data.facets), chosen.mirrors)
        *_, short, long = np.sort(data.sides) * plan.scales.length
        return float(short), float(long)

    @abstractmethod
    def parts(self, plan: Plan, team: Team, watch: Stopwatch, journal: Journal) -> Parts:
        """The parts of the reduced model, to the scene's tolerance. Collective.

        Raises SceneError, MeshError or SolverError with one line that names the cause; warns with
        AccuracyWarning where the tolerance is not met.
        """


def step_cases(n_modes: int) -> int:
    """Static load cases of STEP (Muravyov and Rizzi 2003)."""
    return 2 * n_modes + 3 * comb(n_modes, 2) + comb(n_modes, 3)
