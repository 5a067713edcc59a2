"""Errors of solids beside those told, on random ones with seeds.

./run python -m tests.stress.solids [COUNT]
"""

import warnings

import attrs
import numpy as np

from nanorom.bench import report
from nanorom.errors import AccuracyWarning
from nanorom.fem.plan import Plan
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.routes import solid as route
from nanorom.fem.solvers import groups
from nanorom.fem.stopwatch import Stopwatch
from nanorom.scene.film import Plate
from nanorom.scene.geometry import Disc, Rectangle, String
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support

SIZE = 20e-6
FINE = 2e-4  # error that the mesh of the finer run is made for


@attrs.frozen
class Case:
    """A solid; relative errors of the first frequency and of its own cubic coefficient, true and
    told, and the larger of their ratios.
    """

    seed: int
    solid: str
    tolerance: float
    unknowns: int
    frequency: float
    frequency_told: float
    cubic: float
    cubic_told: float
    ratio: float


def solid(seed: int) -> tuple[str, Scene]:
    """A beam, a plate or a disc of some thickness, held all around, at two sides or at one."""
    random = np.random.default_rng(seed)
    kind = int(random.integers(3))
    aspect = random.uniform(0.1, 0.3)
    shape = (String(SIZE, aspect * SIZE), Rectangle(SIZE, 3 * aspect * SIZE), Disc(SIZE))[kind]
    side = (SIZE * aspect, 3 * aspect * SIZE, 2 * SIZE)[kind]
    ends = {"left": "clamped", "right": "clamped"}
    held = (ends, random.choice(["clamped", "two", "one"]), "clamped")[kind]
    held = {"two": ends, "one": {"left": "clamped"}}.get(str(held), held)
    scene = Scene(
        geometry=shape,
        plate=Plate(side * random.uniform(*((0.2, 1.0), (0.1, 0.3), (0.1, 0.2))[kind]), "solid"),
        material=Material(160e9, random.uniform(0.0, 0.45), 2320.0),
        support=Support(held),
        modes=Modes(count=1),
        accuracy=Accuracy(tolerance=float(10 ** random.uniform(-2.3, -1.5))),
    )
    where = held if isinstance(held, str) else " and ".join(held)
    return f"{shape.shape}, {where}", scene


def case(seed: int) -> Case:
    """True errors are those beside one run on a much finer mesh."""
    what, scene = solid(seed)
    tolerance = scene.accuracy.tolerance
    assert tolerance is not None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)  # what is told then is compared, too
        found = reduce_scene(scene)
    plan = Plan.of(scene)
    fine = route.solve(groups.alone(), plan, FINE, Stopwatch(None))
    clock = np.sqrt(160e9 / 2320.0) / plan.scales.length / (2 * np.pi)
    exact = clock * np.sqrt(fine.modes.eigenvalues[0])
    frequency = abs(found.frequency[0] / exact - 1)
    unit = 160e9 / plan.scales.length
    cubic = abs(found.cubic[0, 0, 0, 0] / (unit * fine.tensors.cubic[0, 0, 0, 0]) - 1)
    told = [found.diagnostics[f"error_{name}"] for name in ("frequency", "tensor")]
    ratio = max(frequency / told[0], cubic / told[1])
    size = found.diagnostics["dofs"]
    return Case(seed, what, tolerance, size, frequency, told[0], cubic, told[1], ratio)


if __name__ == "__main__":
    report.tabled(case, "tests.stress.solids", 12)
