"""Levels of a drive side by side, and branches that are reached from neighbours or guesses."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, PeriodicOrbit, add_isolas, explore, explore_levels
from nanorom.continuation.curves import critical_curve
from nanorom.continuation.diagrams.merging import missing_folds
from nanorom.errors import ContinuationError
from tests.continuation.independent import gap
from tests.continuation.systems import duffing, from_monomials

QUALITY = 180.0


def test_levels_in_parallel_give_the_serial_result() -> None:
    system, omega = from_monomials("p2"), (1.9, 2.1)
    levels = [(0.002, 0.013), (0.002, 0.0), (0.004, 0.016)]
    seen: list[int] = []
    parallel = explore_levels(
        system, omega, levels, processes=2, progress=lambda done, of: seen.append(done)
    )
    assert seen == [1, 2, 3]
    for one, (direct, parametric) in zip(parallel, levels):
        two = explore(system, omega, direct, parametric)
        assert (one.direct, one.parametric) == (direct, parametric)
        assert len(one.branches) == len(two.branches)
        for a, b in zip(one.branches, two.branches):
            np.testing.assert_array_equal(a.omega, b.omega)
            np.testing.assert_array_equal(a.multipliers, b.multipliers)
        assert [p.omega for p in one.special_points] == [p.omega for p in two.special_points]


def test_a_failing_level_is_named() -> None:
    with pytest.raises(ContinuationError, match="direct nan"):
        explore_levels(duffing(), (0.8, 1.5), [(np.nan, 0.0)], processes=1)


def test_branch_out_of_reach_is_found_from_an_orbit_on_it() -> None:
    """A range inside the bistable region cuts the loop into three pieces: they are found outside of
    the range, and nothing is found twice from orbits on them.
    """
    system = duffing(QUALITY)
    whole = explore(system, (0.8, 1.5), direct=0.005).branches[0]
    alone = explore(system, (1.10, 1.15), direct=0.005)
    seeds = [whole.orbit(i) for i in range(len(whole))]
    seeded = explore(system, (1.10, 1.15), direct=0.005, seeds=seeds)
    assert len(alone.branches) == 3
    assert len(seeded.branches) == 3
    assert sum(not branch.stable.any() for branch in seeded.branches) == 1
    assert all(branch.ending == "range" for branch in seeded.branches)


def tuned_absorber() -> ModalSystem:
    """Duffing oscillator with a nonlinear tuned vibration absorber, masses 1 and 0.05.

    Detroux, Habib, Masset and Kerschen 2015, doi:10.1016/j.ymssp.2015.01.035: below the force at
    which it merges with the main branch, its upper resonance is an isola.
    """
    between = np.array([1.0, -1.0])
    cubic = 0.0042 * np.einsum("i,j,k,l->ijkl", *[between] * 4)
    cubic[0, 0, 0, 0] += 1.0
    spring, friction = np.outer(between, between), np.diag([0.002, 0.0])
    return ModalSystem(
        mass=[1.0, 0.05],
        damping=friction + 0.0129 * spring,
        stiffness=np.diag([1.0, 0.0]) + 0.0454 * spring,
        cubic=cubic,
        direct=[1.0, 0.0],
    )


def test_isolas_are_reached_from_neighbouring_levels() -> None:
    system, omega = tuned_absorber(), (0.6, 2.5)
    levels = [(force, 0.0) for force in (0.06, 0.13, 0.15, 0.17, 0.19)]
    serial, parallel = (explore_levels(system, omega, levels, processes=n) for n in (1, 2))
    assert [len(diagram.branches) for diagram in serial] == [1, 2, 2, 2, 2]
    for one, two in zip(serial, parallel):
        for a, b in zip(one.branches, two.branches, strict=True):
            np.testing.assert_array_equal(a.omega, b.omega)
    alone = explore(system, omega, 0.13)
    assert len(alone.branches) == 1
    isola = serial[1].branches[1]
    assert isola.ending == "closed"
    folds = [point.omega for point in serial[1].points("LP", branch=1)]
    np.testing.assert_allclose(sorted(folds), [isola.omega.min(), isola.omega.max()], rtol=1e-3)
    assert add_isolas(system, omega, serial, 1) == serial  # nothing is found twice
    for index in range(0, len(isola), 20):
        orbit = isola.orbit(index)
        assert gap(system, orbit, 0.13, 0.0) < 1e-8


def test_curves_of_folds_find_isolas_without_multipliers(monkeypatch) -> None:
    """Of many modes the multipliers of every orbit cost fifty times as much as the curves."""
    system, omega = tuned_absorber(), (0.6, 2.5)
    diagrams = [explore(system, omega, 0.13)]
    monkeypatch.setattr(critical_curve, "orbit_at", None)
    missing, left_out = missing_folds(system, omega, diagrams)
    assert not left_out and len(missing[0]) == 2
    assert add_isolas(system, omega, diagrams, 1)[0].branches[1].ending == "closed"


def test_subharmonic_resonance_of_order_three_is_reached_from_a_guess() -> None:
    """Period 3T: harmonic balance with a cos(wt/3 + phase) and F/(1 - w^2) cos(wt) starts it."""
    system, drive, omega = duffing(100.0), 6.0, 4.0
    guesses = []
    for amplitude in (0.5, 0.8):
        for phase in (0.0, 1.4, 2.8):
            coefficients = np.zeros((7, 1))
            coefficients[1:3, 0] = amplitude * np.array([np.cos(phase), np.sin(phase)])
            coefficients[5] = drive / (1 - omega**2)
            guesses.append(PeriodicOrbit(coefficients, omega, 3))
    diagram = explore(system, (3.0, 6.0), direct=drive, seeds=guesses)
    (branch,) = (b for b in diagram.branches if b.period_multiple == 3)
    assert branch.stable.any() and not branch.stable.all()
    (fold,) = diagram.points("LP")  # where it begins, far from all other branches
    assert fold.period_multiple == 3 and fold.omega == pytest.approx(branch.omega.min(), rel=1e-3)
    for index in range(0, len(branch), 15):
        orbit = branch.orbit(index)
        assert gap(system, orbit, drive, 0.0) < 1e-8


def test_rest_is_a_branch_when_only_the_stiffness_is_driven() -> None:
    diagram = explore(duffing(QUALITY), (0.8, 2.2), parametric=0.2)
    assert np.all(diagram.branches[0].amplitude == 0)
    assert [p.type for p in diagram.points(branch=0)] == ["BP", "BP", "PD", "PD"]
    assert {b.period_multiple for b in diagram.branches} == {1, 2}
