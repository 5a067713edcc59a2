"""What a route from a scene to its reduced model has to know and do: one row of the registry."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import comb

from nanorom.fem.models import initial_shape
from nanorom.fem.output.model import Parts
from nanorom.fem.plan import Plan
from nanorom.fem.plan_text import Item
from nanorom.fem.solvers.groups import Team
from nanorom.fem.stopwatch import Stopwatch
from nanorom.files.partial import Journal
from nanorom.scene.scene import Scene


class Route(ABC):
    """What it refuses, what it needs, what that costs, and the parts of the model that it makes.

    of_plates: its film is a plate or membrane, whose states can be followed with their load, and
    whose own periodic orbits can be solved for.
    """

    of_plates = False

    def check(self, scene: Scene) -> None:
        """Raise SceneError for what this route cannot do, before anything expensive."""
        if scene.plate.initial_shape is not None:
            initial_shape.read_table(scene.plate.initial_shape)

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

    @abstractmethod
    def parts(self, plan: Plan, team: Team, watch: Stopwatch, journal: Journal) -> Parts:
        """The parts of the reduced model, to the scene's tolerance. Collective.

        Raises SceneError, MeshError or SolverError with one line that names the cause; warns with
        AccuracyWarning where the tolerance is not met.
        """


def step_cases(n_modes: int) -> int:
    """Static load cases of STEP (Muravyov and Rizzi 2003)."""
    return 2 * n_modes + 3 * comb(n_modes, 2) + comb(n_modes, 3)
