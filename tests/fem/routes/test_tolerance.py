"""The loop that meets a tolerance: where it goes on, where it stops, and what it tells."""

import attrs
import pytest

from nanorom.errors import AccuracyWarning
from nanorom.fem.routes.tolerance import Refinement, needed_aim, solved_to_tolerance
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


def test_error_that_hardly_falls_ends_after_two_meshes_with_its_cause():
    with pytest.warns(AccuracyWarning, match="re-entrant corner.*accuracy.tolerance = 0.008 is"):
        found, aims = solved(lambda aim: 0.01 * aim**0.01)
    assert len(aims) == 2
    assert found.error == pytest.approx(0.01 * aims[1] ** 0.01)


def test_modes_that_errors_mix_are_told_as_such():
    with pytest.warns(AccuracyWarning, match="an exact pair.* right to 3.0e-08"):
        solved(lambda aim: 1.0 + 3e-8, mixing=1.0)


def test_needed_aim_is_where_a_power_law_meets_the_tolerance():
    aims = (1e-3, 1e-5)
    errors = [2 * aim**0.7 for aim in aims]
    needed = needed_aim(aims[0], errors[0], aims[1], errors[1], 1e-6)
    assert 2 * needed**0.7 == pytest.approx(1e-6)
