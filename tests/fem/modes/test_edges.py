"""The convex hull of a film's edge, by which hollow films are told from convex ones."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from nanorom.fem.modes.edges import _hull

ROUNDING = 1e-12  # of the area


@pytest.mark.parametrize("points", [3, 4, 10, 1000])
def test_area_of_the_convex_hull_is_qhulls(points):
    places = np.random.default_rng(points).standard_normal((points, 2))
    assert _hull(places) == pytest.approx(ConvexHull(places).volume, rel=ROUNDING)


def test_points_inside_and_along_the_hull_do_not_count():
    lattice = np.array([[x, y] for x in range(20) for y in range(10)], dtype=float)
    assert _hull(lattice) == pytest.approx(19 * 9, rel=ROUNDING)
