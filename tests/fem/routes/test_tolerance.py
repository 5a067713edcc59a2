"""The loop that meets a tolerance: where it goes on, where it stops, and what it tells."""

import attrs
import pytest

from nanorom.errors import AccuracyWarning
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.routes import plate
from nanorom.fem.routes.tolerance import LEAST_AIM, Refinement, solved_to_tolerance
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from tests.fem.routes.test_sides import film

HOW = Refinement(most=5, finer=0.3, told="estimated error")
TOLERANCE = 1e-6


@attrs.frozen
class Attempt:
    error: float
    rounding: float = 0.0
    mixing: float = 0.0


def solved(error_of, **parts):
    """What the loop returns where the error is a function of the aim, and the aims it tried."""
    aims = []

    def solve(aim):
        aims.append(aim)
        return Attempt(error_of(aim), **parts)

    return solved_to_tolerance(film("cccc", 1.0, tolerance=TOLERANCE), solve, HOW), aims


@pytest.mark.parametrize("order", [1.0, 0.6])
def test_error_that_follows_its_aim_is_met(order):
    found, _ = solved(lambda aim: 30 * aim**order)
    assert found.error <= TOLERANCE


def test_error_that_hardly_falls_ends_before_the_last_mesh_with_its_cause():
    with pytest.warns(AccuracyWarning, match="re-entrant corner.*accuracy.tolerance = 0.008 is"):
        found, aims = solved(lambda aim: 0.01 * aim**0.01)
    assert len(aims) < HOW.most
    assert min(aims) > LEAST_AIM
    assert found.error == pytest.approx(0.01 * aims[-1] ** 0.01)


def test_error_that_stays_for_some_meshes_and_then_falls_is_met():
    """As that of a drum in two parts, whose meshes are the same for near aims."""
    found, aims = solved(lambda aim: 3.5e-6 if aim > 2e-8 else 2e-8)
    assert found.error <= TOLERANCE
    assert len(aims) > 3


def test_a_mesh_that_near_aims_have_in_common_is_solved_once():
    aims = []

    def solve(aim):
        aims.append(aim)
        return Attempt(3.5e-6 if aim > 2e-9 else 2e-8)

    def same(attempt, aim):
        return (attempt.error > TOLERANCE) == (aim > 2e-9)

    scene = film("cccc", 1.0, tolerance=TOLERANCE)
    assert solved_to_tolerance(scene, solve, HOW, same=same).error <= TOLERANCE
    assert len(aims) == 2 and 2e-9 * HOW.finer / 2 < aims[1] <= 2e-9


def test_every_mesh_of_a_drum_under_a_force_is_another_one(monkeypatch):
    """It was solved with 289, and four times with 945 degrees of freedom."""
    solve, sizes = plate.solve, []

    def counted(*arguments):
        found = solve(*arguments)
        sizes.append(found.modes.plate.deflections.dofmap.index_map.size_global)
        return found

    monkeypatch.setattr(plate, "solve", counted)
    scene = Scene(
        geometry=Disc(radius=3.1e-6),
        plate=Plate(4.4e-9, model="plate"),
        material=Material(75e9, 0.377, 1256.0),
        tension=Tension(4.8e-4, 4.8e-4),
        load=Load(force=2e-11, position=(1.2e-7, 0.0), radius=1.55e-7),
        modes=Modes(count=1),
        accuracy=Accuracy(tolerance=1e-3),
    )
    reduce_scene(scene)
    assert len(sizes) > 1
    assert len(set(sizes)) == len(sizes)


def test_modes_that_errors_mix_are_told_as_such():
    with pytest.warns(AccuracyWarning, match="an exact pair.* right to 3.0e-08"):
        solved(lambda aim: 1.0 + 3e-8, mixing=1.0)


def test_modes_that_are_told_apart_are_taken_from_the_finest_mesh():
    """A smaller tolerance, which no mesh meets, is no reason for a larger error."""
    aims = []

    def solve(aim):
        aims.append(aim)
        return Attempt(1e6 * aim, mixing=1e6 * aim)

    with pytest.warns(AccuracyWarning, match="an exact pair"):
        found = solved_to_tolerance(film("cccc", 1.0, tolerance=1e-9), solve, HOW)
    assert aims == [1e-9, LEAST_AIM]
    assert found.error == 1e6 * LEAST_AIM
