"""Levels in parallel, states, loci, backbones, isolas, sweeps and sampled orbits."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from nanorom.continuation import (
    ModalSystem,
    PeriodicOrbit,
    add_isolas,
    backbone,
    explore,
    explore_levels,
    locus,
    states,
    sweep,
)
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing, from_monomials, random_potential

QUALITY = 180.0
CURVE = 1e-9


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


def test_states_lie_on_the_branch_and_can_be_stopped() -> None:
    first = list(islice(states(duffing(), (0.8, 1.5), 0.005), 5))
    assert len(first) == 5
    assert first[0].omega == pytest.approx(0.8)
    for state in first:
        end = _integrate(duffing(), state.orbit, 0.005, 0.0)
        assert np.abs(end - _state(state.orbit)).max() < 1e-8
    falling = list(states(duffing(), (0.8, 1.5), 0.005, falling=True))
    assert falling[0].omega == pytest.approx(1.5)
    assert falling[-1].omega == pytest.approx(0.8)


def _state(orbit):
    return np.concatenate([orbit(0.0), orbit.velocity(0.0)])


def _integrate(system, orbit, direct, parametric):
    def right_side(t, y):
        q, v = y[: system.size], y[system.size :]
        drive = np.cos(orbit.omega * t) * (
            direct * system.direct + parametric * system.parametric @ q
        )
        force = system.stiffness @ q + system.quadratic @ q @ q + system.cubic @ q @ q @ q
        total = drive - force - system.damping @ v
        return np.concatenate([v, np.linalg.solve(system.mass, total)])

    span = (0.0, orbit.period)
    return solve_ivp(right_side, span, _state(orbit), method="DOP853", rtol=1e-12, atol=1e-14).y[
        :, -1
    ]


@pytest.mark.parametrize("seed", range(3))
def test_orbits_of_dense_systems_close_in_time_integration(seed) -> None:
    system = random_potential(3, seed)
    diagram = explore(system, (0.8, 1.6), direct=0.05, parametric=0.02)
    for branch in diagram.branches:
        for index in range(0, len(branch), 15):
            orbit = branch.orbit(index)
            assert np.abs(_integrate(system, orbit, 0.05, 0.02) - _state(orbit)).max() < 1e-8


def test_sampled_motion_spectrum_and_shape_agree() -> None:
    diagram = explore(from_monomials("p2"), (1.5, 2.5), direct=0.002, parametric=0.013)
    orbit = diagram.branches[1].orbit(20)
    assert orbit.period_multiple == 2
    times, q, v = orbit.time_series(points=400, periods=2)
    np.testing.assert_allclose(q[400], q[0], atol=1e-12)
    frequencies, amplitudes = orbit.spectrum()
    rebuilt = (np.exp(1j * np.outer(times, frequencies)) @ amplitudes).real
    np.testing.assert_allclose(rebuilt, q, atol=1e-12)
    np.testing.assert_allclose(np.gradient(q[:, 0], times)[5:-5], v[5:-5, 0], atol=1e-3)
    np.testing.assert_allclose(np.abs(q).max(axis=0), diagram.branches[1].amplitude[20], rtol=1e-3)
    modes = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 1.0]])
    np.testing.assert_allclose(orbit.shape(modes, times), q @ modes)


def test_duffing_backbone_is_exact() -> None:
    """x'' + x + x^3 = 0: omega = pi sqrt(1 + a^2) / (2 K(m)), m = a^2 / (2 (1 + a^2))."""
    curve = backbone(duffing(), amplitude=3.0)
    a = curve.amplitude[:, 0]
    exact = np.pi * np.sqrt(1 + a**2) / (2 * ellipk(a**2 / (2 * (1 + a**2))))
    assert a.max() > 3
    np.testing.assert_allclose(curve.omega, exact, atol=1e-8)
    np.testing.assert_allclose(curve.energy, a**2 / 2 + a**4 / 4, rtol=1e-6)


def test_parametric_tongue_opens_at_two_over_quality() -> None:
    """Damped Mathieu equation near 2 omega_0: threshold gamma = 2/Q to leading order in 1/Q."""
    system = duffing(QUALITY)
    diagram = explore(system, (1.9, 2.1), parametric=0.013, depth=0)
    (one, two) = diagram.points("PD")
    curve = locus(
        system, one, 0.0, 0.013, omega=(1.9, 2.1), level=(1e-3, 0.03), parameter="parametric"
    )
    assert curve.level.min() == pytest.approx(2 / QUALITY, rel=1e-3)
    # the curve goes round the bottom of the tongue to the other period doubling
    gaps = np.hypot(curve.omega - two.omega, curve.level - 0.013)
    assert gaps.min() < 5e-3


def test_cusp_of_the_duffing_folds() -> None:
    """Slow flow: F^2 = 8 delta^3 / (3 sqrt(3) kappa), F = beta/2, delta = 1/(2Q), kappa = 3/8."""
    system = duffing(QUALITY)
    fold = explore(system, (0.8, 1.5), direct=0.005).points("LP")[0]
    curve = locus(system, fold, 0.005, 0.0, omega=(0.8, 1.4), level=(1e-4, 0.008))
    # kappa)
    expected = np.sqrt(4 * 8 / (3 * np.sqrt(3) * 3 / 8) / (2 * QUALITY) ** 3)
    assert curve.level.min() == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("kind", ["LP", "PD"])
def test_locus_meets_the_diagrams_of_other_levels(kind) -> None:
    system = from_monomials("p2")
    start = explore(system, (1.9, 2.5), direct=0.004, parametric=0.016, depth=0)
    curve = locus(
        system,
        start.points(kind)[0],
        0.004,
        0.016,
        omega=(1.9, 2.6),
        level=(0.7, 1.4),
        parameter="both",
        steps=12,
    )
    index = len(curve.omega) // 3
    factor = float(curve.level[index])
    other = explore(system, (1.9, 2.6), direct=0.004 * factor, parametric=0.016 * factor, depth=0)
    assert min(abs(p.omega - curve.omega[index]) for p in other.points(kind)) < CURVE


def three_modes(damping=1.0, stiffness=1.0, cubic=0.0) -> ModalSystem:
    """Everything at once; factors on the damping and stiffness of the second mode, and an addition
    to one cubic coefficient.
    """
    random, frequencies = np.random.default_rng(5), np.array([1.0, 1.35, 2.3])
    vectors = random.standard_normal((6, 3)) / np.sqrt(3)
    tensor = np.einsum("mi,mj,mk,ml->ijkl", vectors, vectors, vectors, vectors)
    tensor /= tensor[0, 0, 0, 0]
    others, parametric = random.standard_normal((2, 3, 3))
    parametric = (parametric + parametric.T) / 2
    parametric[0, 0] = 1.0
    force = np.append(1.0, random.standard_normal(3)[1:])
    friction = 0.1 * tensor + 0.02 * random.standard_normal((3,) * 4)
    tensor[0, 0, 0, 0] += cubic
    return ModalSystem(
        damping=frequencies / 60 * [1, damping, 1],
        stiffness=frequencies**2 * [1, stiffness, 1],
        quadratic=0.2 / 3 * np.einsum("mi,mj,mk->ijk", others, others, others),
        cubic=tensor,
        direct=force,
        parametric=parametric,
        cubic_damping=friction,
    )


@pytest.mark.parametrize("kind", ["LP", "PD", "NS"])
def test_locus_of_a_system_with_nonlinear_damping_meets_other_diagrams(kind) -> None:
    system = three_modes()
    levels, omega = np.array([0.1, 0.25]), (0.9, 2.9)
    start = explore(system, omega, *levels, depth=0).points(kind)[-1]
    curve = locus(system, start, *levels, omega=omega, level=(0.5, 2.0), parameter="both", steps=6)
    index = len(curve.omega) // 3
    assert abs(curve.level[index] - 1) > 0.01
    other = explore(system, omega, *(curve.level[index] * levels), depth=0)
    apart = [abs(p.omega - curve.omega[index]) for p in other.points(kind)]
    assert min(apart) < CURVE


@pytest.mark.parametrize("kind", ["LP", "PD", "NS"])
@pytest.mark.parametrize("name", ["damping", "stiffness", "cubic"])
def test_locus_in_any_parameter_meets_the_diagram_of_the_changed_system(kind, name) -> None:
    system, omega = three_modes(), (0.9, 2.9)
    # the change of the system per unit of the argument of the same name
    changed = three_modes(**{name: 2.0 if name != "cubic" else 1.0})
    parameter = {name: getattr(changed, name) - getattr(system, name)}
    start = explore(system, omega, 0.1, 0.25, depth=0).points(kind)[-1]
    limits = {"omega": omega, "level": (-0.3, 0.3)}
    curve = locus(system, start, 0.1, 0.25, parameter=parameter, steps=8, **limits)
    level = float(curve.level[2])
    assert abs(level) > 0.01
    other = explore(three_modes(**{name: level + (name != "cubic")}), omega, 0.1, 0.25, depth=0)
    assert min(abs(p.omega - curve.omega[2]) for p in other.points(kind)) < CURVE


def test_cusps_and_tips_of_tongues_are_located() -> None:
    """A little above there are two special points, a little below there is none."""
    system = duffing(30.0)
    for kind, levels, parameter, omega in (
        ("LP", (0.03, 0.0), "direct", (0.8, 1.6)),
        ("LP", (0.03, 0.0), "damping", (0.8, 1.6)),
        ("PD", (0.0, 0.1), "parametric", (1.8, 2.2)),
    ):
        point = explore(system, omega, *levels, depth=0).points(kind)[0]
        reach = {"direct": (1e-3, 0.1), "parametric": (1e-3, 0.2), "damping": (0.5, 5.0)}
        curve = locus(
            system, point, *levels, omega=omega, level=reach[parameter], parameter=parameter
        )
        (turn,) = curve.turns
        for side, count in ((1 + 1e-6, 2), (1 - 1e-6, 0)):
            level = float(curve.level[turn]) * (2 - side if parameter == "damping" else side)
            near = duffing(30.0 / level) if parameter == "damping" else system
            there = {"direct": (level, 0.0), "parametric": (0.0, level)}.get(parameter, levels)
            diagram = explore(near, omega, *there, depth=0)
            assert len(diagram.points(kind)) == count
            for p in diagram.points(kind):
                assert p.omega == pytest.approx(curve.omega[turn], abs=1e-3)


def test_loci_of_orbits_that_broke_a_symmetry_are_followed_in_theirs() -> None:
    """Strongly driven Duffing oscillator: orbits with even harmonics, and where they begin."""
    system, omega, drive = duffing(30.0), (0.46, 0.6), 20.0
    start = explore(system, omega, drive)
    for kind, branch in (("BP", 0), ("LP", 1), ("PD", 1)):
        point = start.points(kind, branch)[-1]
        curve = locus(system, point, drive, 0.0, omega=(0.3, 0.8), level=(15.0, 25.0), steps=6)
        level, frequency = float(curve.level[2]), curve.omega[2]
        assert abs(level / drive - 1) > 1e-4
        other = explore(system, omega, level)
        assert min(abs(p.omega - frequency) for p in other.points(kind)) < CURVE


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
        assert np.abs(_integrate(system, orbit, 0.13, 0.0) - _state(orbit)).max() < 1e-8


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
        assert np.abs(_integrate(system, orbit, drive, 0.0) - _state(orbit)).max() < 1e-8


def test_rest_is_a_branch_when_only_the_stiffness_is_driven() -> None:
    diagram = explore(duffing(QUALITY), (0.8, 2.2), parametric=0.2)
    assert np.all(diagram.branches[0].amplitude == 0)
    assert [p.type for p in diagram.points(branch=0)] == ["BP", "BP", "PD", "PD"]
    assert {b.period_multiple for b in diagram.branches} == {1, 2}


def test_sweeps_jump_at_the_folds() -> None:
    system = duffing(30.0)
    folds = sorted(p.omega for p in explore(system, (0.8, 1.6), direct=0.05).points("LP"))
    assert len(folds) == 2
    up = sweep(system, np.linspace(folds[1] - 0.03, folds[1] + 0.03, 13), direct=0.05, state=None)
    start = explore(system, (0.8, folds[1] - 0.03), direct=0.05).branches[0].orbit(-1)
    up = sweep(
        system,
        np.linspace(folds[1] - 0.03, folds[1] + 0.03, 13),
        direct=0.05,
        state=_state(start),
    )
    jump = int(np.argmin(np.diff(up.amplitude[:, 0])))
    assert up.omega[jump] <= folds[1] + 0.005 + 1e-9
    assert up.omega[jump + 1] >= folds[1]
    assert up.settled.all()
