"""What every model of a film must keep: a potential, one result by two routes, an order."""

import numpy as np
import pytest

from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.load import Load
from nanorom.scene.scene import Accuracy, Modes, Reduction
from nanorom.scene.support import Spring, Support
from tests.fem.routes.test_loaded_scenes import RADIUS, TENSION, drum

THICKNESS = 4e-8  # T R^2/D = 1: no layer at the edge that coarse meshes would miss
POTENTIAL = 1e-6  # asymmetry of the tensors that STEP finds
ROUTES = 1e-6  # direct against STEP
DEGREE = 3  # of the refinement: eigenvalues err as h^(2 (k - 1)) by C0 interior penalty
SMOOTH = (3.5, 5.2)  # order 4; states that err more than modes fall faster at first
SINGULAR = (0.8, 4.5)  # corners between a held and a free side are singular


def shallow(directory):
    """A table of a bulge of one thickness."""
    axis = np.linspace(-1.01, 1.01, 61) * RADIUS
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    file = directory / "bulge.csv"
    z = THICKNESS * (1 - (x**2 + y**2) / RADIUS**2)
    np.savetxt(file, np.column_stack([x, y, z]), delimiter=",")
    return {"plate": Plate(THICKNESS, "plate", file)}


def relaxed(_):
    """A film whose long sides are free: its stress is that of another equilibrium."""
    sides = {"left": "clamped", "right": "clamped"}
    return {"geometry": Rectangle(4 * RADIUS, 2 * RADIUS), "support": Support(sides)}


MODELS = {
    "initial shape": (shallow, SMOOTH),
    "pressure": (lambda _: {"load": Load(pressure=1e5)}, SMOOTH),
    "gate": (lambda _: {"load": Load(voltage=10.0, gap=2e-7)}, SMOOTH),
    "stress": (lambda _: {"load": Load(stress=1e7, pressure=5e4)}, SMOOTH),
    "relaxed": (relaxed, SINGULAR),
    "springs": (
        lambda _: {"support": Support(Spring(5 * TENSION / RADIUS, 0.05 * TENSION * RADIUS))},
        SMOOTH,
    ),
}


def scene(name, directory, degree, size, **changes):
    given = {
        "plate": Plate(THICKNESS, "plate"),
        "geometry": Disc(RADIUS),
        "tension": Tension.isotropic(TENSION),
        "modes": Modes(count=2),
        "accuracy": Accuracy(degree=degree, mesh_size=size),
    }
    given |= {"load": None, **MODELS[name][0](directory), **changes}
    return drum(**given)


@pytest.mark.parametrize("name", MODELS)
def test_tensors_derive_from_a_potential_and_direct_is_step(name, tmp_path):
    direct, stepped = (
        reduce_scene(scene(name, tmp_path, 5, RADIUS / 2, reduction=Reduction(*how)))
        for how in (("direct",), ("step", "free", "0.1 nm"))
    )
    assert stepped.diagnostics["asymmetry"] < POTENTIAL
    assert stepped.frequency == pytest.approx(direct.frequency, rel=1e-9)
    for tensor in ("quadratic", "cubic"):
        exact = getattr(direct, tensor)
        found = getattr(stepped, tensor)
        assert found == pytest.approx(exact, abs=ROUTES * max(np.abs(exact).max(), 1e-300))


@pytest.mark.parametrize("name", MODELS)
def test_refinement_converges_at_its_order(name, tmp_path):
    def frequency(degree, size):
        made = scene(name, tmp_path, degree, size, modes=Modes(count=1))
        return reduce_scene(made).frequency[0]

    exact = frequency(8, RADIUS / 2)
    coarse, fine = (abs(frequency(DEGREE, RADIUS / n) / exact - 1) for n in (4, 8))
    low, high = MODELS[name][1]
    assert low < np.log2(coarse / fine) < high
