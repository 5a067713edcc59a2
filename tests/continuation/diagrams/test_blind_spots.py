"""Branches that were missed once: beyond the ends of others, deep in cascades, of systems that feed
themselves; and sweeps that leave the well.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import (
    Diagram,
    ModalSystem,
    budget,
    explore,
    explore_each,
    explore_levels,
    sweep,
)
from nanorom.continuation.diagrams import record
from nanorom.errors import ContinuationError

SAME = 1e-8
ONE_HARMONIC = 0.05  # relative: what the others of these orbits amount to
CLOSES = 1e-8  # of an orbit after a period of time integration
FEIGENBAUM = 4.669201609  # limit of ratios of distances between period doublings
ALREADY = 0.1  # relative: how near the limit the ratios of the last doublings are
UNFOLLOWED = json.loads((Path(__file__).parent / "unfollowed.json").read_text())
ARRAYS = ("damping", "stiffness", "quadratic", "cubic", "direct", "parametric")


def softening() -> ModalSystem:
    """q'' + 0.05 q' + q + q^2 = F cos(w t): a well with one way out."""
    return ModalSystem(damping=0.05, stiffness=[1.0], quadratic=[[[1.0]]], direct=[1.0])


def closes(orbit, right_side) -> float:
    start = np.concatenate([orbit(0.0), orbit.velocity(0.0)])
    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
    end = solve_ivp(right_side, (0.0, orbit.period), start, **options).y[:, -1]
    return float(np.abs(end - start).max())


def test_the_branch_that_another_one_ends_on_is_followed() -> None:
    """A doubled branch ends where nothing was known: on a branch of the drive's period, from which
    the number of special points rises from 64 to 76 (found before from a seed given by hand).
    """
    system = ModalSystem(**{name: UNFOLLOWED[name] for name in ARRAYS})
    levels = UNFOLLOWED["direct_level"], UNFOLLOWED["parametric_level"]
    diagram = explore(system, tuple(UNFOLLOWED["omega"]), *levels)
    assert len(diagram.branches) >= 13
    assert len(diagram.special_points) >= 76
    (end,) = [p for p in diagram.points("PD") if abs(p.omega - 2.130823413) < SAME]
    assert diagram.branches[end.branch].period_multiple == 1
    assert diagram.branches[end.branch].parent is None


def test_a_cascade_is_followed_to_its_fifth_doubling() -> None:
    system = softening()
    diagram = explore(system, (0.5, 1.5), 0.08, depth=4)
    # branches of the cascade alone: there are others of two periods and what leaves them
    cascade: set[int] = set()
    for number, branch in enumerate(diagram.branches):
        if branch.parent in cascade or (branch.parent is None and branch.period_multiple == 1):
            cascade.add(number)
    found = [point for point in diagram.points("PD") if point.branch in cascade]
    points = sorted(found, key=lambda point: point.period_multiple)
    assert [point.period_multiple for point in points] == [1, 2, 4, 8, 16]
    gaps = -np.diff([point.omega for point in points])
    assert gaps[-2] / gaps[-1] == pytest.approx(FEIGENBAUM, rel=ALREADY)

    def right_side(t, y, omega):
        return [y[1], 0.08 * np.cos(omega * t) - 0.05 * y[1] - y[0] - y[0] ** 2]

    for branch in diagram.branches:
        orbit = branch.orbit(5)
        if abs(branch.multipliers[5, 0]) < 1.5:  # else the integration loses it
            assert closes(orbit, lambda t, y, w=orbit.omega: right_side(t, y, w)) < CLOSES


def test_a_sweep_that_escapes_keeps_what_it_recorded(capfd) -> None:
    omega = np.linspace(1.1, 0.7, 41)
    found = sweep(softening(), omega, 0.12, periods=100)
    assert found.escaped is not None
    assert 0 < len(found.omega) < len(omega)
    np.testing.assert_array_equal(found.omega, omega[: len(found.omega)])
    assert found.escaped == omega[len(found.omega)]
    assert found.amplitude.shape == (len(found.omega), 1)
    assert np.isfinite(found.state).all()
    out, error = capfd.readouterr()
    assert not out + error


def test_a_system_that_feeds_itself_at_small_amplitudes_is_followed() -> None:
    """Van der Pol: outside of the range of entrainment the orbit of the drive's period is unstable,
    inside it is stable; where it loses stability to a torus is a Neimark-Sacker point.
    """
    damping, cubic, force = -0.05, 0.2, 0.06
    system = ModalSystem(
        damping=[damping], stiffness=[1.0], cubic_damping=[[[[cubic]]]], direct=[1.0]
    )
    diagram = explore(system, (0.8, 1.2), force)
    entrained = [branch for branch in diagram.branches if branch.stable.any()]
    assert entrained
    for branch in entrained:
        orbit = branch.orbit(int(np.flatnonzero(branch.stable)[0]))

        def right_side(t, y, omega=orbit.omega):
            # q d(q^2)/dt = 2 q^2 q'
            loss = (damping + 2 * cubic * y[0] ** 2) * y[1]
            return [y[1], force * np.cos(omega * t) - loss - y[0]]

        assert closes(orbit, right_side) < CLOSES
    assert diagram.points("NS")
    assert not diagram.branches[0].stable[0]


def test_negative_damping_that_nothing_limits_is_refused() -> None:
    with pytest.raises(ContinuationError, match="cubic_damping"):
        ModalSystem(damping=[-0.01], stiffness=[1.0], cubic_damping=[[[[-0.1]]]])
    limited = np.zeros((2, 2, 2, 2))
    limited[0, 0, 0, 0] = 1.0
    ModalSystem(damping=[-0.01, 0.01], stiffness=[1.0, 2.0], cubic_damping=limited)
    with pytest.raises(ContinuationError, match="cubic_damping"):
        ModalSystem(damping=[0.01, -0.01], stiffness=[1.0, 2.0], cubic_damping=limited)


def duffing_states(omega: float, damping: float, force: float) -> list[float]:
    """Amplitudes of q'' + c q' + q + q^3 = F cos(w t) by one harmonic, from its cubic equation."""
    # a^2 ((1 - w^2 + 3/4 a^2)^2 + (c w)^2) = F^2
    gap = 1 - omega**2
    cubic = [9 / 16, 1.5 * gap, gap**2 + (damping * omega) ** 2, -(force**2)]
    roots = np.roots(cubic)
    return sorted(np.sqrt(roots.real[np.abs(roots.imag) < 1e-9]))


@pytest.mark.parametrize("omega", [(1.2, 1.6), (1.1, 1.2), (1.5, 3.5), (1.3, 1.31)])
def test_a_range_inside_a_bistable_region_shows_every_state_at_its_ends(omega) -> None:
    system = ModalSystem(damping=[0.01], stiffness=[1.0], cubic=[[[[1.0]]]], direct=[1.0])
    diagram = explore(system, omega, 0.03)
    told = {round(left.omega, 6) for left in diagram.unexplored if left.kind == "window"}
    for edge in omega:
        expected = duffing_states(edge, 0.01, 0.03)
        found = sorted(
            branch.amplitude[end, 0]
            for branch in diagram.branches
            for end in (0, -1)
            if abs(branch.omega[end] - edge) < 2e-3 * (omega[1] - omega[0])
        )
        assert len(found) == len(expected)
        np.testing.assert_allclose(found, expected, rtol=ONE_HARMONIC)
        assert (round(edge, 6) in told) == (len(expected) > 1)


def tuned_absorber() -> ModalSystem:
    """A Duffing oscillator with a nonlinear absorber of a twentieth of its mass."""
    between = np.array([1.0, -1.0])
    cubic = 0.0042 * np.einsum("i,j,k,l->ijkl", *[between] * 4)
    cubic[0, 0, 0, 0] += 1.0
    spring = np.outer(between, between)
    return ModalSystem(
        mass=[1.0, 0.05],
        damping=np.diag([0.002, 0.0]) + 0.0128 * spring,
        stiffness=np.diag([1.0, 0.0]) + 0.0454 * spring,
        cubic=cubic,
        direct=[1.0, 0.0],
    )


def check_isola(diagram: Diagram) -> None:
    """The second branch is closed, apart from the first, and made of orbits of the equations."""
    system, (main, isola) = tuned_absorber(), diagram.branches
    assert isola.ending == "closed" and main.ending == "range"
    folds = [point.omega for point in diagram.points("LP", branch=1)]
    np.testing.assert_allclose(sorted(folds), [isola.omega.min(), isola.omega.max()], rtol=1e-3)
    for index in range(0, len(isola), len(isola) // 5):
        orbit = isola.orbit(index)
        crossed = np.interp(orbit.omega, main.omega[-20:], main.amplitude[-20:, 0])
        times = np.linspace(0, orbit.period, 100)
        assert np.abs(orbit(times)[:, 0]).max() > 2 * crossed
        speed = np.abs(orbit.velocity(times)).max()

        def right_side(t, y, omega=orbit.omega):
            q, v = y[:2], y[2:]
            force = system.stiffness @ q + system.cubic @ q @ q @ q + system.damping @ v
            drive = diagram.direct * np.cos(omega * t) * system.direct
            return np.concatenate([v, (drive - force) / np.diag(system.mass)])

        assert closes(orbit, right_side) < CLOSES * speed


@pytest.mark.parametrize("levels", [(0.18, 0.185, 0.19), (0.17, 0.185)])
def test_an_isola_is_found_once_whether_or_not_a_level_has_it_connected(levels) -> None:
    """It merges with the branch from rest at 0.18562."""
    drives = [(level, 0.0) for level in levels]
    diagrams = explore_levels(tuned_absorber(), (0.6, 3.5), drives, processes=1)
    assert [len(diagram.branches) for diagram in diagrams] == [1 + (f < 0.1856) for f in levels]
    check_isola(diagrams[0])
    assert len(diagrams[-1].points("LP")) == (6 if levels[-1] < 0.1856 else 4)


@pytest.mark.parametrize("force", [500.0, 700.0])
def test_a_drive_that_is_hundreds_of_times_the_stiffness_is_followed_over_the_range(force) -> None:
    """Between its resonances of higher order no drive is raised to its level without a fold."""
    damping, omega = 0.05, (1.0, 3.0)
    system = ModalSystem(damping=[damping], stiffness=[1.0], cubic=[[[[1.0]]]], direct=[1.0])
    diagram = explore(system, omega, force, depth=0)
    assert not [left for left in diagram.unexplored if left.kind != "window"]
    base = diagram.branches[0]
    assert base.omega[0] == pytest.approx(omega[0], rel=1e-3)
    assert base.omega[-1] == pytest.approx(omega[1], rel=1e-3)
    for index in np.flatnonzero(base.stable)[:: base.stable.sum() // 4]:
        orbit = base.orbit(int(index))

        def right_side(t, y, omega=orbit.omega):
            return [y[1], force * np.cos(omega * t) - damping * y[1] - y[0] - y[0] ** 3]

        speed = base.amplitude.max() ** 2  # of a motion that the cubic force alone turns back
        assert closes(orbit, right_side) < CLOSES * speed


def duffing() -> ModalSystem:
    return ModalSystem(damping=0.01, stiffness=[1.0], cubic=[[[[1.0]]]], direct=[1.0])


@pytest.mark.parametrize("omega", [(1e-6, 1e-5), (1e-9, 9e-3)])
def test_a_range_in_a_wrong_unit_is_refused_before_anything_runs(omega) -> None:
    with pytest.raises(ContinuationError, match="lowest natural frequency.*unit"):
        explore(duffing(), omega, 0.1)


def test_a_range_that_begins_far_below_is_cut_and_told() -> None:
    diagram = explore(duffing(), (1e-6, 1.6), 0.03)
    assert diagram.branches[0].omega[0] == pytest.approx(0.01, rel=1e-3)
    assert "follows the drive" in diagram.unexplored[0].why
    assert len(diagram.points("LP")) == 1


def test_a_motion_that_relaxes_too_fast_is_told_by_its_coordinate() -> None:
    system = ModalSystem(
        mass=[1.0, 1e-4],
        damping=[0.05, 1.0],
        stiffness=[1.0, 1.0],
        cubic=0.3 * np.ones((2,) * 4),
        direct=[1.0, 0.5],
    )
    with pytest.raises(ContinuationError, match="damping: found a motion that relaxes"):
        explore(system, (0.5, 1.5), 0.05)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_level_that_fails_withholds_no_other_and_easy_ones_come_first(processes) -> None:
    levels = [(0.03, 0.0), (np.inf, 0.0), (0.01, 0.0), (0.02, 0.0)]
    found: list[int] = []
    with pytest.raises(ContinuationError, match="direct inf"):
        for number, _ in explore_each(duffing(), (0.8, 1.2), levels, processes):
            found.append(number)
    assert sorted(found) == [0, 2, 3]
    if processes == 1:
        assert found == [2, 3, 0]


def test_a_diagram_that_takes_too_many_steps_says_what_it_left(monkeypatch) -> None:
    whole = explore(softening(), (0.5, 1.5), 0.08)
    assert any(branch.origin is not None for branch in whole.branches)
    monkeypatch.setattr(record, "BUDGET", 0)
    diagram = explore(softening(), (0.5, 1.5), 0.08)
    assert not any(branch.origin is not None for branch in diagram.branches)
    (left,) = [left for left in diagram.unexplored if left.kind == "branch"]
    assert left.omega == pytest.approx(whole.points("PD")[0].omega)
    assert "most steps" in left.why


def test_a_level_that_takes_too_much_work_says_where_it_ended(monkeypatch) -> None:
    """As a drive does that is a thousand times too strong; here the bound is low."""
    whole = explore(softening(), (0.5, 1.5), 0.08)
    monkeypatch.setattr(budget, "STEPS", 2e-4)
    diagram = explore(softening(), (0.5, 1.5), 0.08)
    assert {branch.ending for branch in diagram.branches} == {"work"}
    assert sum(map(len, diagram.branches)) < sum(map(len, whole.branches))
    told = [left.why for left in diagram.unexplored if left.kind == "ending"]
    assert len(told) == len(diagram.branches)
    assert all("more work than a level may take" in why for why in told)


def test_special_points_that_are_not_confirmed_for_want_of_work_are_told(monkeypatch) -> None:
    monkeypatch.setattr(budget, "ASIDE", 0.0)
    diagram = explore(softening(), (0.5, 1.5), 0.08)
    assert not diagram.special_points
    assert "not confirmed" in {left.kind: left.why for left in diagram.unexplored}["point"]
