"""Resonances in the film's own plane: found, told of, and refused where they meet the modes."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv, jvp

from nanorom.bench.skips import ALONE
from nanorom.errors import AccuracyWarning, SolverError
from nanorom.exact import cases
from nanorom.fem.models import beam
from nanorom.fem.plan import Plan
from nanorom.fem.routes import plate as plates
from nanorom.fem.stopwatch import Stopwatch
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import String
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from nanorom.workflow import reduce

RITZ = 1.75  # a bound from above, from the modes' own products
SHEAR = 3e-3  # of the frequency: strain of the tension 1.5e-3, and Ritz' error
ALONG = "select = [1, 3]"  # (1,0) and (2,0) of a string, between them (1,1)
MODULUS, DENSITY, LENGTH = 250e9, 3100.0, 100e-6


def in_plane_frequency_of_a_disc(film):
    """Lowest in-plane frequency of a disc held at its edge, by its Helmholtz potentials."""
    shear = film.modulus / (2 * (1 + film.nu))
    ratio = np.sqrt((1 - film.nu) / 2)  # of the velocities of shear and of stretching

    def determinant(k, n):
        a = ratio * k
        return n**2 * jv(n, a) * jv(n, k) - a * k * jvp(n, a) * jvp(n, k)

    lowest = np.inf
    grid = np.linspace(0.5, 8, 400)
    for n in range(4):
        values = determinant(grid, n)
        first = np.flatnonzero(values[:-1] * values[1:] < 0)[0]
        lowest = min(lowest, brentq(determinant, grid[first], grid[first + 1], args=(n,)))
    return lowest * np.sqrt(shear / cases.DENSITY) / (2 * np.pi * film.radius)


@pytest.mark.parametrize(("method", "highest"), [("direct", 1.4), ("step", RITZ)])
def test_in_plane_frequency_is_a_bound_on_the_exact_one_of_a_disc(method, highest):
    model = reduce(cases.drum(100.0, 6).scene.with_(method=method, tolerance=1e-4))
    found = model.diagnostics["in_plane_frequency"]
    assert 1 <= found / in_plane_frequency_of_a_disc(cases.Film()) < highest


def string(modes, stress, model="auto"):
    thickness = 100 if model == "beam" else 20  # nm
    return Scene.from_toml(
        f"""
        [geometry]
        shape = "string"
        length = {LENGTH}
        width = "3 um"
        [plate]
        thickness = "{thickness} nm"
        model = "{model}"
        [material]
        youngs_modulus = {MODULUS}
        poisson_ratio = 0.23
        density = {DENSITY}
        [tension]
        x = "{thickness * stress} N/m"
        y = 0
        [support]
        edge = {{ left = "clamped", right = "clamped", bottom = "free", top = "free" }}
        [modes]
        {modes}
        """
        + ("" if model == "beam" else '[accuracy]\ndegree = 4\nmesh_size = "10 um"')
    )


def test_in_plane_frequency_of_a_string_is_that_of_its_longitudinal_waves():
    wave = np.sqrt(MODULUS / DENSITY) / (2 * LENGTH)
    found = reduce(string(ALONG, 1.0)).diagnostics["in_plane_frequency"]
    assert 1 <= found / wave < RITZ
    assert reduce(string("count = 3", 1.0, "beam")).diagnostics[
        "in_plane_frequency"
    ] == pytest.approx(wave)


NEAR_AND_BEYOND = {
    "auto": (string(ALONG, 15.0), string("count = 8", 200.0)),
    "beam": (string("count = 3", 5.0, "beam"), string("count = 6", 20.0, "beam")),
}


@pytest.mark.parametrize("model", NEAR_AND_BEYOND)
def test_modes_near_the_in_plane_resonances_are_warned_of_and_beyond_them_refused(model):
    near, beyond = NEAR_AND_BEYOND[model]
    with pytest.warns(AccuracyWarning, match=r"in-plane .* coefficients by \d\d+% there; ask"):
        reduce(near)
    with pytest.raises(SolverError, match=r"in-plane resonances begin at \S+ .Hz .* fewer of"):
        reduce(beyond)


SLENDER = {"geometry": String("1 mm", "10 um"), "plate": Plate("100 nm", "plate")}


def silicon_nitride(modes, tension=100.0, tolerance=1e-4):
    """String of silicon nitride, a hundred times as long as wide."""
    return Scene(
        material=Material(youngs_modulus=MODULUS, poisson_ratio=0.23, density=DENSITY),
        tension=Tension(tension, 0.0),
        support=Support({"left": "clamped", "right": "clamped"}),
        modes=modes,
        accuracy=Accuracy(tolerance=tolerance),
        **SLENDER,
    )


@pytest.mark.parametrize(("tension", "modes"), [(0.1, [1, 7]), (100.0, [1, 2])])
def test_lateral_bending_of_a_string_is_that_of_a_beam_under_its_tension(tension, modes):
    """Products of (1,0) and (1,1) excite it; the higher tension triples its frequency."""
    width, thickness = 10e-6, 100e-9
    stiffness = MODULUS * width * thickness
    sideways = beam.Beam(
        1e-3, stiffness, stiffness * width**2 / 12, tension * width, DENSITY * width * thickness
    )
    exact = beam.modes(sideways, 1).frequency[0]
    plan = Plan.of(silicon_nitride(Modes(select=modes), tension))
    found = plates.solve(ALONE, plan, 1e-4, Stopwatch(None))
    assert found.names == ["(1,0)", "(1,1)"]
    assert found.diagnostics["in_plane_frequency"] == pytest.approx(exact, rel=SHEAR)


def test_modes_among_lateral_bending_are_refused():
    """What would help is told: tension makes lateral bending faster, and so does width."""
    told = r"in-plane resonances begin at 316 kHz.* fewer of them or make the film wider"
    with pytest.raises(SolverError, match=told):
        reduce(silicon_nitride(Modes(count=4)))
    found = reduce(silicon_nitride(Modes(count=1))).diagnostics["in_plane_frequency"]
    assert found > 8e6  # its square does not bend the film sideways


def test_nothing_is_told_of_a_plane_that_is_held_fixed():
    model = reduce(cases.drum(100.0, 1).scene.with_(in_plane="fixed", tolerance=1e-3))
    assert "in_plane_frequency" not in model.diagnostics
