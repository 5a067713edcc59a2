"""Shooting goes on where the harmonics do not suffice: the same branch, found independently."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import explore
from tests.continuation.systems import duffing

SAME = 1e-8
FEW = 5  # harmonics: too few beyond the flanks of the resonance


@pytest.fixture(scope="module")
def diagrams():
    """The same level by harmonic balance alone, and with shooting on most of the branch."""
    many = explore(duffing(60.0), (0.85, 1.3), direct=0.012)
    few = explore(duffing(60.0), (0.85, 1.3), direct=0.012, harmonics=FEW)
    return many, few


def by_shooting(branch):
    return [k for k, c in enumerate(branch.coefficients) if (len(c) - 1) // 2 > FEW]


def test_branch_goes_on_to_the_end_of_the_range(diagrams):
    many, few = diagrams
    assert len(many.branches) == len(few.branches) == 1
    assert few.branches[0].ending == "range"
    # from the end of the range at which the few harmonics suffice to the other
    assert few.branches[0].omega[-1] == pytest.approx(0.85, abs=SAME)
    assert len(by_shooting(few.branches[0])) > 20


def test_special_points_are_those_of_harmonic_balance(diagrams):
    many, few = diagrams
    assert len(many.special_points) == len(few.special_points) == 2
    assert {p.type for p in few.special_points} == {"LP"}
    for one, two in zip(*(sorted(d.special_points, key=lambda p: p.omega) for d in diagrams)):
        assert abs(one.omega - two.omega) < SAME
        np.testing.assert_allclose(two.amplitude, one.amplitude, rtol=1e-4)
        np.testing.assert_allclose(two.state, one.state, atol=1e-4)  # flat along omega at a fold


def test_orbits_close_and_amplitudes_are_theirs(diagrams):
    branch = diagrams[1].branches[0]
    for k in by_shooting(branch)[::10]:
        orbit = branch.orbit(k)
        start = np.concatenate([orbit(0.0), orbit.velocity(0.0)])

        def right_side(t, y, omega=orbit.omega):
            return [y[1], 0.012 * np.cos(omega * t) - y[1] / 60 - y[0] - y[0] ** 3]

        span = (0.0, orbit.period)
        end = solve_ivp(right_side, span, start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        assert np.abs(end - start).max() < SAME
        _, q, _ = orbit.time_series(points=4000)
        assert branch.amplitude[k, 0] == pytest.approx(np.abs(q).max(), rel=1e-5)
        assert branch.stable[k] == (np.abs(branch.multipliers[k]).max() < 1)


def test_symmetry_breaking_is_found_by_shooting_alone():
    """Strong low-frequency drive: superharmonic resonances, each with a pair of branch points."""
    system, omega = duffing(30.0), (0.46, 0.6)
    many = explore(system, omega, direct=20.0, depth=0)
    few = explore(system, omega, direct=20.0, depth=0, harmonics=80)
    ours, theirs = (sorted((p.type, p.omega) for p in d.special_points) for d in (few, many))
    assert [kind for kind, _ in ours] == [kind for kind, _ in theirs] == ["BP", "BP", "LP", "LP"]
    assert max(abs(a[1] - b[1]) for a, b in zip(ours, theirs)) < SAME
    assert few.branches[0].ending == "range"
    assert max(len(c) for c in few.branches[0].coefficients) > 2 * 80 + 1
