"""Estimated errors are near the true ones, and meshes are as coarse as their tolerance allows."""

import numpy as np
import pytest

from nanorom.bench import accuracy, scenes
from nanorom.exact import cases
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.modes.decay import Polynomials, extrapolated, orthonormal
from nanorom.fem.plan import Plan
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import MeshFile
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from nanorom.workflow import reduce
from tests.fem.test_plan import rectangle

CASES = {
    "plate": lambda: (cases.drum(0.0, 5), 1e-6),
    "one mode": lambda: (cases.drum(100.0, 1), 1e-8),
    "edge layer": lambda: (cases.drum(1e3, 5), 1e-4),
    "thin edge layer": lambda: (cases.drum(1e5, 5), 1e-6),
    "near buckling": lambda: (cases.drum(-0.9999 * cases.BUCKLING, 3), 1e-6),
    "corners": lambda: (cases.square(4), 1e-5),
}
ROUNDING = 1e-12  # of frequencies
TAKEN_APART = 1e-9  # of the energies of polynomials of a cell
FINE = 1e-8  # tolerance of the mesh that a clamped rectangle is held against


@pytest.mark.parametrize("case", CASES)
def test_estimates_are_neither_too_small_nor_a_hundred_times_too_large(case):
    known, tolerance = CASES[case]()
    claim = accuracy.claim(cases.with_tolerance(known, tolerance), tolerance)
    assert claim.verdict == "ok", claim


@pytest.mark.parametrize("number", [0, 7, 11])
def test_random_scenes_keep_what_they_claim(number):
    """Of `nanorom bench --accuracy`: a string, an elastic and a clamped drum."""
    row = scenes.held(number, scenes.drawn(number))
    assert row.verdict == "ok", row


def test_a_peak_on_a_free_edge_is_that_of_the_shape_itself():
    """Waves fitted on the film's side alone were wrong by ten times what they told."""
    row = scenes.held(6, scenes.drawn(6))
    assert "string" in row.scene
    assert row.verdict == "ok", row


def test_peaks_on_the_rims_of_holes_are_told():
    """Once off by forty times what was told: the ninth mode is largest on the rim of a hole."""
    drum = Scene(
        geometry=MeshFile(MESHES / "perforated.geo", scale=1.0),
        plate=Plate(1e-3, model="plate"),
        material=Material(1.0, 0.25, 1.0),
        tension=Tension(1e-8),
        support=Support({"edge": "clamped", "holes": "free"}),
        modes=Modes(count=9),
        accuracy=Accuracy(degree=4, mesh_size=0.2),
    )
    coarse, fine = (reduce(drum.with_(degree=degree)) for degree in (4, 5))
    mass = np.abs(coarse.mass / fine.mass - 1)  # as the square of the peak
    assert mass[8] > 1e-5
    difference = np.abs(coarse.cubic - fine.cubic).max() / np.abs(fine.cubic).max()
    assert difference < coarse.diagnostics["error_tensor"] < 20 * difference


def test_the_papers_drum_takes_few_unknowns():
    """Two rings of cells for 1e-3, three for 1e-5."""
    for tolerance, most in ((1e-3, 300), (1e-5, 500)):
        model = reduce(cases.with_tolerance(cases.paper_drum(), tolerance).scene)
        found = model.diagnostics
        assert found["dofs"] < most
        assert max(found["error_frequency"], found["error_tensor"]) < tolerance


def test_a_clamped_rectangle_errs_by_less_than_estimated():
    scene = rectangle(tension=Tension(x=0.05, y=0.04))
    fine = reduce(scene.with_(tolerance=FINE))
    coarse = reduce(scene.with_(tolerance=1e-4))
    error = np.abs(coarse.frequency / fine.frequency - 1).max()
    assert error < coarse.diagnostics["error_frequency"] < 1e-4
    difference = np.abs(coarse.cubic - fine.cubic).max() / np.abs(fine.cubic).max()
    assert difference < coarse.diagnostics["error_tensor"] < 1e-4


def test_what_is_beyond_a_degree_follows_the_last_of_even_and_of_odd_ones():
    """Tails that fall by 1e4 and by 100 in turn: the next falls as the last but one."""
    tails = np.array([[1e-10], [1e-6], [1e-4]])
    assert extrapolated(tails) == pytest.approx(1e-12, rel=0.03)


@pytest.mark.parametrize("power", [3, 4, 5, 7, 9])
def test_what_is_beyond_a_degree_of_a_singular_field_is_not_told_too_small(power):
    """In a corner energies of single degrees k fall as a power of k, and tails end at degree 8."""
    energy = np.arange(1.0, 1e5) ** -power
    tails = np.array([[energy[first - 1 : 8].sum()] for first in (8, 7, 6)])
    beyond = energy[8:].sum()
    assert 0.9 * beyond < extrapolated(tails)[0] < 2 * beyond


def test_cells_towards_an_edge_lie_in_order_within_the_film():
    random = np.random.default_rng(1)
    for _ in range(300):
        tolerance, tension = 10 ** random.uniform((-9, -4), (-1, 3))
        count = int(random.integers(1, 40))
        kind = random.choice(["clamped", "simply_supported"])
        sides = rectangle(
            plate=Plate(thickness="10 nm", model="plate"),
            tension=Tension(x=tension, y=tension),
            support=Support(str(kind)),
            modes=Modes(count=count),
        )
        chosen = Plan.of(sides).discretisation(tolerance)
        for lines in (chosen.source.x, chosen.source.y):
            assert lines[0] == 0.0
            assert (np.diff(lines) > 0).all()
        drum = cases.drum(1e3 * tension, count).scene
        chosen = Plan.of(drum).discretisation(tolerance)
        radii = chosen.source.radii
        assert radii[0] > 0
        assert radii[-1] == 1.0
        assert (np.diff(radii) > 0).all()


@pytest.mark.parametrize(("split", "tolerance"), [(1e-7, 1e-8), (1e-9, 1e-6)])
def test_split_pairs_are_told_to_the_tolerance_and_their_mean_as_an_error(split, tolerance):
    case = cases.with_tolerance(cases.square(4, split), tolerance)
    model = reduce(case.scene)
    error = np.abs(model.frequency / np.sort(case.frequency()) - 1).max()
    assert error <= tolerance
    assert error < 3 * model.diagnostics["error_frequency"] + ROUNDING


@pytest.mark.parametrize("degree", [3, 8])
def test_energies_are_taken_apart_where_tension_is_along_one_direction_of_a_turned_cell(degree):
    """A polynomial that changes across the tension alone has no energy, or less by rounding."""
    angles = np.linspace(0.0, np.pi, 200)
    along = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    slopes = np.einsum("ca,cb->cab", along, along) * np.logspace(-6, 6, len(angles))[:, None, None]
    factor = orthonormal(degree, slopes)
    energy = np.einsum("cin,cim->cnm", factor, factor)
    known = Polynomials.of(degree)
    nodal = known.coefficients.T @ np.einsum("cab,abnm->cnm", slopes, known.slopes)
    exact = nodal @ known.coefficients
    scale = np.abs(exact).max(axis=(1, 2), keepdims=True)
    assert (np.abs(energy - exact) < TAKEN_APART * scale).all()
