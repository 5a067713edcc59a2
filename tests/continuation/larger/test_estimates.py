"""Few modes held against a larger model: errors, the modes that make them, and what grows."""

from itertools import permutations

import attrs
import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore
from nanorom.continuation.diagrams.selection import of_level
from nanorom.continuation.larger.equations import LargerSystem
from nanorom.continuation.larger.estimate import estimate
from nanorom.continuation.larger.growth import growths
from tests.continuation.systems import random_potential

SEEDS = range(3)
INSIDE, SIZE = 2, 5
RANGE, LEVEL = (0.85, 1.5), 0.05
ROUND_OFF = 1e-12
LOCATED = 1e-8  # of a frequency: where an estimate finds the larger system's own point


def weakly_coupled(seed):
    """A random potential whose last modes take a small part in the motion of the first."""
    whole = random_potential(SIZE, seed)
    weight = np.where(np.arange(SIZE) < INSIDE, 1.0, 0.3)
    cubic, quadratic = np.array(whole.cubic), np.array(whole.quadratic)
    for axis in range(4):
        cubic *= weight.reshape([-1 if i == axis else 1 for i in range(4)])
    for axis in range(3):
        quadratic *= weight.reshape([-1 if i == axis else 1 for i in range(3)])
    direct = np.array([1.0, 0.5, 0.0, 0.0, 0.0])
    return attrs.evolve(whole, cubic=cubic, quadratic=quadratic, direct=direct)


def part(whole, modes):
    """Some of the modes alone, the others following statically."""
    kept = np.array(modes)
    rest = np.setdiff1d(np.arange(whole.size), kept)
    pull = whole.quadratic[np.ix_(kept, kept, rest)]
    compliance = np.linalg.inv(whole.stiffness[np.ix_(rest, rest)])
    f = np.einsum("rjs,st,klt->rjkl", pull, compliance, pull)
    static = -2 * (f + f.transpose(0, 2, 1, 3) + f.transpose(0, 3, 2, 1)) / 3
    two = np.ix_(kept, kept)
    return ModalSystem(
        damping=whole.damping[two],
        stiffness=whole.stiffness[two],
        quadratic=whole.quadratic[np.ix_(kept, kept, kept)],
        cubic=whole.cubic[np.ix_(kept, kept, kept, kept)] + static,
        direct=whole.direct[kept],
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_special_points_are_estimated_where_the_larger_system_has_them(seed):
    whole, inside = weakly_coupled(seed), np.arange(INSIDE)
    few = explore(part(whole, inside), RANGE, direct=LEVEL)
    many = explore(whole, RANGE, direct=LEVEL)
    assert few.special_points
    larger = LargerSystem(whole, inside, LEVEL, 0.0)
    count = len(few.special_points)
    for point in of_level(0, few, count, count):
        found = estimate(larger, point)
        assert found.found
        expected = np.array([p.omega for p in many.special_points if p.type == point.type])
        omega = point.orbit.omega * (1 + found.omega)
        assert np.abs(omega / expected - 1).min() < LOCATED
        if point.type == "LP":  # nothing of its shift along the branch is nobody's
            assert found.shares.sum() > (1 - ROUND_OFF) * found.error


def resting():
    """A driven mode, and one at rest that it makes parametrically unstable near the fold."""
    cubic = np.zeros((2, 2, 2, 2))
    cubic[0, 0, 0, 0], cubic[1, 1, 1, 1] = 1.0, 1.5
    for place in set(permutations((0, 0, 1, 1))):
        cubic[place] = 0.4
    return ModalSystem(damping=[0.01, 0.011], stiffness=[1.0, 1.2], cubic=cubic, direct=[1.0, 0.0])


def test_mode_at_rest_that_grows_is_named_where_the_larger_system_branches():
    whole = resting()
    few = explore(part(whole, [0]), RANGE, direct=LEVEL)
    many = explore(whole, RANGE, direct=LEVEL)
    branching = [p.omega for p in many.special_points if p.type == "BP" and p.amplitude[1] == 0]
    assert len(branching) >= 2
    larger = LargerSystem(whole, np.array([0]), LEVEL, 0.0)
    found = growths(larger, 0, few.branches[0])
    assert found
    for growth in found:
        assert growth.omega > min(branching)
        assert growth.multiplier > 1
        assert growth.shares[1] == pytest.approx(1.0)
    weak = LargerSystem(whole, np.array([0]), LEVEL / 100, 0.0)
    quiet = explore(part(whole, [0]), RANGE, direct=LEVEL / 100)
    assert not growths(weak, 0, quiet.branches[0])


def test_errors_are_shared_among_the_modes_outside_alone():
    whole = weakly_coupled(1)
    few = explore(part(whole, [0, 1]), RANGE, direct=LEVEL)
    larger = LargerSystem(whole, np.array([0, 1]), LEVEL, 0.0)
    point = of_level(0, few, 1, 1)[0]
    found = estimate(larger, point)
    assert not found.shares[[0, 1]].any()
    without = np.array(whole.cubic)
    for axis in range(4):
        without[tuple(slice(3, 4) if i == axis else slice(None) for i in range(4))] = 0.0
    quadratic = np.array(whole.quadratic)
    for axis in range(3):
        quadratic[tuple(slice(3, 4) if i == axis else slice(None) for i in range(3))] = 0.0
    changed = attrs.evolve(whole, cubic=without, quadratic=quadratic)
    alone = estimate(LargerSystem(changed, np.array([0, 1]), LEVEL, 0.0), point)
    assert alone.shares[3] == pytest.approx(0.0, abs=1e-12)
    assert found.shares[3] == found.shares.max()


def test_a_model_at_rest_under_a_modulation_is_estimated():
    """Where rest loses its stability, the larger system's own point is found, from rest."""
    whole, inside = weakly_coupled(0), np.arange(1)
    strong = attrs.evolve(
        whole,
        direct=np.zeros(SIZE),
        quadratic=np.zeros((SIZE,) * 3),
        parametric=np.diag([1.0, 0.5, 0.5, 0.5, 0.5]) + 0.1 * (1 - np.eye(SIZE)),
    )
    alone = ModalSystem(
        damping=strong.damping[:1, :1],
        stiffness=strong.stiffness[:1, :1],
        cubic=strong.cubic[:1, :1, :1, :1],
        parametric=strong.parametric[:1, :1],
    )
    twice = 2 * float(np.sqrt(strong.stiffness[0, 0]))
    near = 0.9 * twice, 1.1 * twice
    few, many = (explore(system, near, parametric=0.1) for system in (alone, strong))
    assert few.points("PD")
    larger = LargerSystem(strong, inside, 0.0, 0.1)
    for point in of_level(0, few, 6):
        found = estimate(larger, point)
        assert np.isfinite(found.error)
        if point.type == "PD":
            there = point.orbit.omega * (1 + found.omega)
            own = min(abs(each.omega / there - 1) for each in many.points("PD"))
            assert own < LOCATED
