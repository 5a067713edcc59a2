"""Members of a family are brought to each other by the rotation that makes them equal."""

import numpy as np
import pytest
from scipy.linalg import expm

from nanorom.continuation.orbits.turns import nearest

ROUNDING = 1e-12


@pytest.mark.parametrize("seed", range(5))
def test_rotated_motion_is_turned_back(seed):
    random = np.random.default_rng(seed)
    generator = np.zeros((5, 5))  # a pair that turns twice as fast as another, and a single mode
    generator[0, 1], generator[1, 0] = -1.0, 1.0
    generator[2, 3], generator[3, 2] = -2.0, 2.0
    motion = random.standard_normal((7, 5))
    angle = random.uniform(0, 2 * np.pi)
    moved = motion @ expm(angle * generator).T
    assert nearest(moved, motion, [generator]) == pytest.approx(motion, abs=ROUNDING)


def test_motions_of_different_size_are_turned_to_the_least_distance():
    generator = np.array([[0.0, -1.0], [1.0, 0.0]])
    found = nearest(np.array([[0.0, 2.0]]), np.array([[1.0, 0.0], [0.0, 0.0]]), [generator])
    assert found == pytest.approx(np.array([[2.0, 0.0]]), abs=ROUNDING)
