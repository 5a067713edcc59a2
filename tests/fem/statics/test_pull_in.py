"""The voltage at which a gate pulls a film in, and how well the film is known just before it."""

import numpy as np
import pytest

from nanorom.errors import SolverError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc
from nanorom.scene.load import VACUUM_PERMITTIVITY, Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from tests.fem.radial import Disc as Radial

H, NU, TENSION, GAP = 0.01, 0.3, 1e-3, 0.02
TOLERANCE = 1e-6
TO_TOLERANCE, BY_HAND = Accuracy(tolerance=TOLERANCE), Accuracy(degree=8, mesh_size=0.5)
RATIO = 3.0  # of a true error to the estimate that is told
PRINTED = 5e-6  # half of the last of six digits


def film(voltage, accuracy=TO_TOLERANCE):
    """Radius 1, E h = rho h = 1."""
    return Scene(
        geometry=Disc(1.0),
        plate=Plate(H, model="plate"),
        material=Material(1 / H, NU, 1 / H),
        tension=Tension(TENSION),
        support=Support("clamped"),
        load=Load(voltage=voltage, gap=GAP),
        modes=Modes(count=1),
        accuracy=accuracy,
    )


def eigenvalue(disc, voltage2):
    return disc.solve(gap=GAP, voltage2=voltage2).eigenvalues(0, 1)[0]


@pytest.fixture(scope="module")
def pull_in():
    """The voltage at which the lowest eigenvalue, a square root of what is left to it, is zero."""
    disc = Radial(TENSION, H**2 / 12 / (1 - NU**2), NU, count=30)
    known = [(v, eigenvalue(disc, v) ** 2) for v in (1e-8, 1.5e-8)]
    while True:
        (a, first), (b, last) = known[-2:]
        limit = b + last * (b - a) / (first - last)
        if abs(limit - b) < 1e-8 * limit:
            return np.sqrt(limit / VACUUM_PERMITTIVITY)
        following = b + 0.5 * (limit - b)
        known.append((following, eigenvalue(disc, following) ** 2))


def test_pull_in_is_the_same_for_any_voltage_beyond_it(pull_in):
    for beyond in (1.05, 4.0):
        with pytest.raises(SolverError, match="pulled in at") as told:
            reduce_scene(film(beyond * pull_in, BY_HAND))
        found = float(str(told.value).split("pulled in at ")[1].split()[0])
        assert found == pytest.approx(pull_in, rel=PRINTED)


@pytest.mark.parametrize("share", [0.99, 0.99999])
def test_the_estimate_holds_just_before_pull_in(pull_in, share):
    voltage = share * pull_in
    disc = Radial(TENSION, H**2 / 12 / (1 - NU**2), NU, count=30)
    for part in (0.5, 0.9, 0.99, share):
        value = eigenvalue(disc, VACUUM_PERMITTIVITY * (min(part, share) * pull_in) ** 2)
    model = reduce_scene(film(voltage))
    error = abs(model.frequency[0] / (np.sqrt(value) / (2 * np.pi)) - 1)
    told = model.diagnostics["error_frequency"]
    assert error < TOLERANCE + told
    assert error < RATIO * told + 1e-9
