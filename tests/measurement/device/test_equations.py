"""Orbits at measured rows and their derivatives, against the continuation itself."""

import attrs
import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore
from nanorom.continuation.readout import readout
from nanorom.measurement.device.equations import Terms
from nanorom.measurement.device.rows import CHANGE, assigned
from nanorom.measurement.device.stretches import stretches

TRUNCATION = 2e-4  # relative: harmonics beyond the third are left out
STEP = 1e-4  # relative, of differences
SLOPES = 3e-3  # of derivatives: those of differences of orbits with all harmonics
RANGE, LEVEL = (0.9, 1.35), 0.02


def two_modes(time=0.0):
    """Two coupled modes near each other, in units of the first; forces on both."""
    random = np.random.default_rng(3)
    tensor = random.normal(size=(2,) * 4) * 0.1
    axes = [np.transpose(tensor, order) for order in _orders()]
    cubic = sum(axes) / len(axes)
    cubic[0, 0, 0, 0], cubic[1, 1, 1, 1] = 1.0, 1.4
    return Terms(np.array([0.02, 0.025]), np.array([1.0, 1.21]), cubic, np.array([1.0, 0.7]), time)


def _orders():
    from itertools import permutations

    return list(permutations(range(4)))


def explored(terms, limits=RANGE):
    system = ModalSystem(
        damping=terms.damping,
        stiffness=terms.stiffness,
        cubic=terms.cubic,
        direct=terms.force,
        cubic_damping=terms.time * terms.cubic,
    )
    return explore(system, limits, LEVEL, tolerance=1e-8)


def changed(terms, change, step):
    """Terms with a change added."""
    pairs = zip(attrs.asdict(terms, recurse=False).items(), attrs.astuple(change, recurse=False))
    return Terms(**{name: value + step * more for (name, value), more in pairs})


def directions(terms):
    """One change of each kind of array."""
    random, nothing = np.random.default_rng(5), changed(terms, terms, -1.0)
    return [
        attrs.evolve(nothing, damping=terms.damping * [1, 0.3]),
        attrs.evolve(nothing, stiffness=terms.stiffness * [0.01, -0.02]),
        attrs.evolve(nothing, cubic=terms.cubic * 0.5),
        attrs.evolve(nothing, force=random.normal(size=2)),
        attrs.evolve(nothing, time=0.05),
    ]


@pytest.mark.parametrize("time", [0.0, 0.1])
def test_orbits_at_rows_are_those_of_the_continuation(time):
    terms = two_modes(time)
    diagram = explored(terms)
    found = stretches(terms, LEVEL, diagram, RANGE)
    assert sum(fold is not None for own in found for fold in own.folds) >= 2
    for branch in diagram.branches:
        stable = np.flatnonzero(branch.stable)
        weights = np.array([1.0, 0.4])
        sizes = readout(branch, weights).size[stable]
        for omega, size in zip(branch.omega[stable], sizes):
            near = []
            for own in found:
                if own.omega[0] <= omega <= own.omega[1]:
                    states, _ = own.at(np.array([omega]))
                    signal = own.equations.signal(states, weights)[0]
                    near.append(abs(own.equations.unit * abs(signal) / size - 1))
            assert min(near) < TRUNCATION


def test_derivatives_of_orbits_and_folds_are_differences():
    terms = two_modes(0.1)
    changes = directions(terms)
    own = max(stretches(terms, LEVEL, explored(terms), RANGE), key=lambda s: s.omega[1])
    upper = max(
        (s for s in stretches(terms, LEVEL, explored(terms), RANGE) if s.folds[1] is not None),
        key=lambda s: s.omega[1],
    )
    omega = np.linspace(*own.omega, 7)[2:-2]
    states, rate = own.at(omega)
    slopes, _ = own.equations.slopes(states, rate, changes)
    fold = upper.equations.fold_slopes(
        upper.folds[1] / upper.equations.unit, upper.omega[1] / upper.equations.frequency, changes
    )
    for k, change in enumerate(changes):
        ends = []
        for step in (STEP, -STEP):
            other = changed(terms, change, step)
            near = stretches(other, LEVEL, explored(other), RANGE)
            same = min(near, key=lambda s: np.abs(s.omega - own.omega).max())
            top = min(
                (s for s in near if s.folds[1] is not None),
                key=lambda s: abs(s.omega[1] - upper.omega[1]),
            )
            ends.append((same.equations.unit * same.at(omega)[0], top.omega[1]))
        orbit = (ends[0][0] - ends[1][0]) / (2 * STEP)
        ours = own.equations.unit * slopes[..., k]
        assert np.abs(ours - orbit).max() < SLOPES * np.abs(orbit).max()
        assert fold.omega[k] == pytest.approx((ends[0][1] - ends[1][1]) / (2 * STEP), rel=SLOPES)


def test_rows_go_on_with_their_stretch_until_they_fall():
    random = np.random.default_rng(1)
    cost = np.stack([np.where(np.arange(60) < 40, 0.0, 50.0), np.where(np.arange(60) < 40, 50, 0)])
    cost = cost.T + random.random((60, 2))
    cost[20] = [3 * CHANGE, 0.0]  # an outlier is none
    which = assigned(cost)
    assert (which[:40] == 0).sum() >= 39
    assert (which[41:] == 1).all()
