"""The loop that meets a tolerance: where it goes on, where it stops, and what it tells."""

import attrs
import pytest

from nanorom.errors import AccuracyWarning
from nanorom.fem.routes.tolerance import LEAST_AIM, Refinement, solved_to_tolerance
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
