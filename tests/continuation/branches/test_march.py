"""The loop of steps: it meets exact curves, shortens steps that fail and says why it ends."""

import numpy as np
import pytest

from nanorom.continuation import explore
from nanorom.continuation.branches.march import March, StepControl
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing

ON_CIRCLE = 1e-12


def _turn(point, length):
    """Along the unit circle by the tangent, corrected; steps above 0.3 fail."""
    if length > 0.3:
        raise ContinuationError("too long")
    x, y = point
    there = np.array([x - length * y, y + length * x])
    return there / np.linalg.norm(there), True


def test_points_lie_on_the_curve_and_steps_grow_to_the_largest_that_succeeds():
    points = [there for _, there in March(_turn, np.array([1.0, 0.0]), StepControl(1, 1e-3, 1, 50))]
    assert len(points) == 50
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, rtol=ON_CIRCLE)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert chords.max() <= 0.3
    assert chords.min() > 0.1


def test_a_curve_that_cannot_be_followed_is_lost_with_the_reason():
    march = March(_turn, np.array([1.0, 0.0]), StepControl(1.0, 0.5, 1.0, 50))
    assert not list(march)
    assert (march.ending, march.why) == ("lost", "too long")


def test_a_curve_ends_where_it_says_so():
    def until_three(point, length):
        return None if point >= 3 else (point + 1, True)

    march = March(until_three, 0, StepControl(1, 1, 1, 50))
    assert [there for _, there in march] == [1, 2, 3]
    assert march.ending == "end"


@pytest.mark.parametrize("level", [18.8, 18.88120132, 18.91])
def test_the_branch_from_the_high_end_is_found_where_raising_the_drive_meets_a_fold(level):
    """Of 18.8 and 18.94 alone it was found, and nothing was told: both ends have a branch, and the
    second one breaks its symmetry.
    """
    diagram = explore(duffing(30.0), (0.46, 0.6), level, depth=0)
    assert [branch.ending for branch in diagram.branches] == ["range", "range"]
    assert [len(diagram.points("BP", branch)) for branch in (0, 1)] == [1, 1]
    assert {left.kind for left in diagram.unexplored} == {"window"}
