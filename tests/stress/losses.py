"""Errors of what bending loses beside those told, on random films with seeds.

./run python -m tests.stress.losses [COUNT]
"""

import warnings

import attrs
import numpy as np

from nanorom.bench import report
from nanorom.errors import AccuracyWarning
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.material import Material
from nanorom.scene.outlines import DiscRegion
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support

LOSS, SIZE = 1e-4, 20e-6
FINE = 100.0  # by which the tolerance of the finer run is less
STRAIN = 3e-3  # at most: beyond, the film's plane does not follow its modes


@attrs.frozen
class Case:
    """A film, its largest dilution Q loss, the largest true error and that told, their ratio."""

    seed: int
    film: str
    dilution: float
    tolerance: float
    true: float
    told: float
    ratio: float


def film(seed: int) -> tuple[str, Scene]:
    """A disc or a rectangle under some tension, held somehow, with a pad or without."""
    random = np.random.default_rng(seed)
    thickness = 10 ** random.uniform(-8, -6.5)
    poisson = random.uniform(0.0, 0.4)
    rigidity = 250e9 * thickness**3 / (12 * (1 - poisson**2))
    tension = 10 ** random.uniform(0, 6) * rigidity / SIZE**2
    tension = min(tension, STRAIN * 250e9 * thickness)
    edge = random.choice(["clamped", "clamped", "simply_supported"])
    round_, padded = random.random() < 0.5, random.random() < 0.3
    shape = Disc(SIZE) if round_ else Rectangle(SIZE, SIZE * random.uniform(0.4, 1.0))
    pad = DiscRegion(radius=random.uniform(0.2, 0.7) * SIZE, thickness=1.5 * thickness, loss=1e-3)
    scene = Scene(
        geometry=shape,
        plate=Plate(thickness=thickness, model="plate"),
        material=Material(250e9, poisson, 3100.0, loss=LOSS),
        tension=Tension(tension, tension * random.uniform(0.7, 1.0)),
        support=Support(edge),
        modes=Modes(count=3),
        regions=(pad,) if padded and round_ else (),
        accuracy=Accuracy(tolerance=float(10 ** random.uniform(-4, -2))),
    )
    what = f"{edge} {shape.shape}" + (" with pad" if scene.regions else "")
    return what, scene


def case(seed: int) -> Case:
    """True errors are those beside a run at a hundredth of the tolerance."""
    what, scene = film(seed)
    tolerance = scene.accuracy.tolerance
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        coarse, fine = (reduce_scene(s) for s in (scene, scene.with_(tolerance=tolerance / FINE)))
    told = coarse.diagnostics["error_losses"] + fine.diagnostics["error_losses"]
    true = np.abs(coarse.losses["material"] / fine.losses["material"] - 1)
    dilution = LOSS / coarse.losses["material"].min()
    ratio = float((true / told).max())
    return Case(seed, what, dilution, tolerance, float(true.max()), float(told.max()), ratio)


if __name__ == "__main__":
    report.tabled(case, "tests.stress.losses", 20)
