"""Rectangles whose sides are held in different ways, with relaxed pre-stress among them."""

import warnings

import numpy as np
import pytest

from nanorom.errors import AccuracyWarning, SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.routes import plate as route
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Rectangle, String
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from tests.fem.ritz import rectangle

THICKNESS, NU = 0.01, 0.3
RIGIDITY = THICKNESS**3 / (12 * (1 - NU**2))  # E = 1
KINDS = {"c": "clamped", "s": "simply_supported", "f": "free"}
SIDES = ("left", "right", "bottom", "top")


def film(sides, width, tension=(0.0, 0.0), tolerance=1e-6, count=3):
    """Film of length, modulus and density 1; tension in units of its bending stiffness."""
    kinds = {side: KINDS[kind] for side, kind in zip(SIDES, sides)}
    return Scene(
        geometry=Rectangle(length=1.0, width=width),
        plate=Plate(thickness=THICKNESS, model="plate"),
        material=Material(youngs_modulus=1.0, poisson_ratio=NU, density=1.0),
        tension=Tension(*(RIGIDITY * t for t in tension)),
        support=Support(kinds),
        modes=Modes(count=count),
        accuracy=Accuracy(tolerance=tolerance),
    )


def solved(scene):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)  # cantilevers bend without stretching
        warnings.filterwarnings("error", "tolerance", AccuracyWarning)  # it is met
        return reduce_scene(scene)


# Ritz' method on products of piecewise polynomials (degree 10, once differentiable, four intervals
# that shrink by 0.15 towards each side); its change from degree 8 is 1.5e-8 in frequencies
CCCF = [0.01207402582, 0.02477711061, 0.03100749234]
CCCF_STIFFENING = 19633.680  # B_1111/m_1^2; another Ritz code gives the same
RITZ = 2e-8
SETTLED = 3.0  # of the last change of Ritz' values: what may be left of their error


def test_one_free_side_among_clamped_ones_reaches_a_small_tolerance():
    model = solved(film("cccf", 0.8, tolerance=1e-7))
    assert model.frequency == pytest.approx(CCCF, rel=RITZ + 1e-7)
    stiffening = model.cubic[0, 0, 0, 0] / model.mass[0] ** 2
    assert stiffening == pytest.approx(CCCF_STIFFENING, rel=RITZ + 1e-7)


@pytest.mark.parametrize("sides", ["cfcf", "ssfs", "sfcs", "fscc", "cfff"])
def test_free_sides_beside_held_ones_reach_the_default_tolerance(sides):
    model = solved(film(sides, 0.8, count=2))
    found = model.diagnostics
    assert max(found["error_frequency"], found["error_tensor"]) <= 1e-6


@pytest.mark.parametrize("seed", range(3))
def test_random_sides_and_tensions_meet_ritz(seed):
    """As nearly as a basis of Ritz' products has settled; tension acts between held sides alone."""
    random = np.random.default_rng([1616, seed])
    loose = True
    while loose:  # a free film, and one that turns about a line
        sides = "".join(random.choice(list("csf"), 4))
        loose = "c" not in sides and sum(side == "s" for side in sides) < 2
    width = random.uniform(0.5, 1.0)
    held = "f" not in sides[:2], "f" not in sides[2:]
    tension = random.uniform(0, 50, 2) * held
    own = [
        rectangle(sides, width, NU, RIGIDITY / THICKNESS, tension * RIGIDITY / THICKNESS, n)
        for n in (12, 16)
    ]
    model = solved(film(sides, width, tension, 1e-6, 1))
    found = 2 * np.pi * model.frequency[0], model.cubic[0, 0, 0, 0] / THICKNESS
    for ours, coarse, fine in zip(found, *own):
        assert abs(ours / fine - 1) < SETTLED * abs(coarse / fine - 1) + 1e-6
        assert abs(ours / fine - 1) < 2e-3


RELAXED = 0.00249420  # two meshes of another hp code, and Ritz' method


def test_an_estimate_counts_the_error_of_relaxed_pre_stress():
    """Free below and pulled along y, so that the tension relaxes to little of it."""
    fine = solved(film("ssfs", 0.6, (0.0, 100.0), 1e-7, 2))
    assert fine.frequency[0] == pytest.approx(RELAXED, rel=1e-5)
    rough = solved(film("ssfs", 0.6, (0.0, 100.0), 1e-3, 2))
    error = np.abs(rough.frequency / fine.frequency - 1)
    estimate = rough.diagnostics["error_frequencies"]
    assert error[0] > 1e-6  # there is something to estimate
    assert (error < estimate).all()
    assert (estimate < 30 * error).all()


def test_a_film_held_on_one_line_alone_is_refused():
    with pytest.raises(SceneError, match="turn about a straight line"):
        reduce_scene(film("fffs", 0.8))


def test_the_best_solution_is_kept_when_a_finer_mesh_fails(monkeypatch):
    scene = film("cccf", 0.8, tolerance=1e-3, count=1)
    solve, aims = route.solve, []

    def failing(team, plan, aim, *rest):
        aims.append(aim)
        if len(aims) == 2:
            raise SceneError("the mesh is out of order")
        solution = solve(team, plan, aim, *rest)
        solution.diagnostics["error_tensor"] = 2e-3
        return solution

    monkeypatch.setattr(route, "solve", failing)
    with pytest.warns(AccuracyWarning, match="not met.*the mesh is out of order"):
        model = reduce_scene(scene)
    assert len(aims) == 2
    assert model.frequency == pytest.approx(CCCF[:1], rel=1e-3)


def test_a_tolerance_that_is_missed_is_told_with_one_that_is_met(monkeypatch):
    scene = film("cccc", 0.8, tolerance=1e-3, count=1)
    solve = route.solve

    def by_a_hair(*given):
        solution = solve(*given)
        solution.diagnostics["error_tensor"] = 1.04e-3
        return solution

    monkeypatch.setattr(route, "solve", by_a_hair)
    with pytest.warns(AccuracyWarning, match=r"accuracy.tolerance = 0.002 is met"):
        reduce_scene(scene)


@pytest.mark.parametrize("width", [0.02, 0.1])
def test_a_string_that_widens_as_it_is_stretched_is_solved(width):
    """Corrections of its modes that add nothing to them have an energy of rounding, of any sign."""
    string = Scene(
        geometry=String(length=1.0, width=width),
        plate=Plate(thickness=1e-4, model="plate"),
        material=Material(youngs_modulus=1.0, poisson_ratio=-0.45, density=1.0),
        tension=Tension(0.0),
        support=Support({"left": "simply_supported", "right": "simply_supported"}),
        modes=Modes(count=9),
        accuracy=Accuracy(tolerance=1e-7),
    )
    model = solved(string)
    flexural = 1e-8 / 12  # by mass: without tension the first mode is nearly a beam's
    beam = np.pi / 2 * np.sqrt(flexural)
    assert model.frequency[0] == pytest.approx(beam, rel=2 * width)
