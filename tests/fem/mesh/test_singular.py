"""Exponents of corner singularities against published ones."""

import numpy as np
import pytest

from nanorom.fem.mesh.singular import Corner
from nanorom.scene.support import Edge, PlaneSpring

GRID = 0.02  # to which exponents are found: they only choose a mesh


@pytest.mark.parametrize(
    ("first", "last", "angle", "nu", "exponent"),
    [
        # stress ~ r^(a - 1): a = 0.5445 in a free corner of 270 degrees, 0.5015 in 330
        # (Williams 1952)
        ("free", "free", 270, 0.3, 2 * 0.5445),
        ("free", "free", 330, 0.3, 2 * 0.5015),
        # in the plane fixed against free, 90 degrees, plane stress: 0.7583 at nu = 0.3
        ("clamped", "free", 90, 0.3, 2 * 0.7583),
        ("simply_supported", "free", 90, 0.3, 2 * 0.7583),
        # where a clamped edge becomes free both go as r^(1/2)
        ("clamped", "free", 180, 0.3, 1.0),
        # simply supported: w ~ r^(pi/angle)
        ("simply_supported", "simply_supported", 120, 0.3, 2 * 0.5),
        # fixed corner in the plane: displacements ~ r^1.516 at nu = 0.25
        ("clamped", "clamped", 90, 0.25, 2 * 1.516),
    ],
)
def test_exponents_are_the_published_ones(first, last, angle, nu, exponent):
    found = Corner(first, last, np.radians(angle)).exponent(nu)
    assert found == pytest.approx(exponent, abs=2 * GRID)


def test_straight_sides_of_one_kind_are_smooth():
    for kind in ("clamped", "free", "simply_supported"):
        assert Corner(kind, kind, np.pi).exponent(0.3) >= 4.0


def test_tractions_that_do_not_fit_at_a_corner_make_it_singular():
    """Stress is bounded there and differs by the direction, or goes as log r."""
    sliding = Edge(w="free", in_plane="tangential")
    elastic = Edge(w="free", in_plane=PlaneSpring(tangential=1.0))
    for first, last in ((sliding, "free"), (sliding, sliding), (elastic, "free")):
        assert Corner(first, last, np.pi / 2).exponent(0.3) == 2.0
    held = Edge(w="simply_supported", in_plane="tangential")
    assert Corner(held, held, np.pi / 2).exponent(0.3) > 4.0  # no slope, no traction
