"""Tori of modal systems: rotation numbers and motion against time integration, events, stability.

The system of two modes 1:2 is one that SSMTool treats by its slow dynamics (order 3).
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import ModalSystem, explore, follow_torus
from nanorom.continuation.sweep import equations
from nanorom.errors import ContinuationError
from tests.continuation.systems import random_potential

RANGE, LEVEL = (0.97, 1.03), 0.01
# second base frequency by DOP853 (relative error 3e-13) of the equations as they stand, started
# off the torus, 3000 periods waited, smoothly weighted mean (exp(-1/(t(1-t)))) of the turn of
# (q1, q1') about its mean over 3000 periods; half the periods give the same to 4e-12
SECOND = {0.9885: 0.029553765708, 1.0092: 0.027271788098}
ROTATION_ERROR = 1e-8
SLOW_DYNAMICS = 4e-4  # error of a reduction to slow dynamics of third order, which gives .98877
MOTION_ERROR = 1e-9
TRACE_ERROR = 1e-5  # of the sum; along a small curve its own direction is known less well
RESIDUAL = 1e-9
TONGUE = (2e-9, 3e-9)  # width of one of order thirteen at this damping
GROWTH_ERROR = 0.02  # four turns are no whole number of periods of the drive


def two_modes(scale=1.0, rate=1.0):
    """x1'' + .005 x1' + x1 + x1 x2 = .01 cos wt, x2'' + .01 x2' + 4 x2 + x1^2 = 0, in other units
    of displacement and time if asked for.
    """
    quadratic = np.zeros((2, 2, 2))
    quadratic[0, 0, 1] = quadratic[0, 1, 0] = 0.5
    quadratic[1, 0, 0] = 1.0
    return ModalSystem(
        damping=np.array([0.005, 0.01]) * rate,
        stiffness=np.array([1.0, 4.0]) * rate**2,
        quadratic=quadratic * rate**2 / scale,
        direct=np.array([scale, 0.0]) * rate**2,
    )


def torus_points(system, rate=1.0):
    diagram = explore(system, (0.9 * rate, 1.1 * rate), direct=LEVEL)
    return sorted(diagram.points("NS"), key=lambda point: point.omega)


@pytest.fixture(scope="module")
def starts():
    return torus_points(two_modes())


@pytest.fixture(scope="module")
def families(starts):
    """From both Neimark-Sacker points into what lies between them."""
    system = two_modes()
    return [follow_torus(system, point, RANGE, direct=LEVEL, steps=17) for point in starts]


def right_side(omega):
    def derivative(time, y):
        force = LEVEL * np.cos(omega * time)
        return [
            y[2],
            y[3],
            force - 0.005 * y[2] - y[0] - y[0] * y[1],
            -0.01 * y[3] - 4 * y[1] - y[0] ** 2,
        ]

    return derivative


def integrated(omega, state, times):
    span = (0.0, times[-1])
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
    return solve_ivp(right_side(omega), span, state, t_eval=times, **options).y.T


@pytest.mark.parametrize("omega, second", SECOND.items())
def test_second_frequency_is_that_of_time_integration(families, omega, second):
    state = families[int(omega > 1)].at(omega)[0]  # of those beyond the fold the first
    assert state.stable
    assert abs(state.omega - omega) < 1e-14
    assert abs(abs(state.second) - second) < ROTATION_ERROR * second


def test_motion_on_a_torus_solves_the_equations(families):
    for family in families:
        state = family[9]
        times = np.linspace(0.0, 60.0, 121)
        start = np.concatenate([state.motion(0.0), state.motion.velocity(0.0)])
        exact = integrated(state.omega, start, times)
        assert np.abs(state.motion(times) - exact[:, :2]).max() < MOTION_ERROR
        assert np.abs(state.motion.velocity(times) - exact[:, 2:]).max() < MOTION_ERROR


def test_lines_of_the_spectrum_add_up_to_the_motion(families):
    motion = families[0][9].motion
    rates, amplitudes, orders = motion.spectrum(1e-14)
    times = np.array([0.0, 3.7, 512.3])
    values = (np.exp(1j * np.outer(times, rates)) @ amplitudes).real
    assert np.abs(values - motion(times)).max() < 1e-11
    assert np.diff(rates).min() > 1e-9  # every line once
    for amplitude, (first, second) in zip(amplitudes, orders):
        assert np.abs(motion.line(first, second) - amplitude).max() < 1e-15
    base = np.array([motion.omega, motion.second])
    assert np.abs(orders @ base - rates).max() < 1e-12


def test_amplitude_is_what_a_long_run_comes_close_to(families):
    state = families[0][9]
    largest = np.abs(state.motion(np.arange(0.0, 2e4, 0.237))).max(axis=0)
    assert np.all(largest <= state.amplitude * (1 + 1e-12))
    assert np.all(largest > state.amplitude * (1 - 5e-3))


def test_tori_begin_at_the_neimark_sacker_points(starts, families):
    for point, family in zip(starts, families):
        angle = np.abs(np.angle(point.multipliers[np.abs(np.abs(point.multipliers) - 1) < 1e-7]))
        expected = angle[0] / (2 * np.pi) * point.omega
        assert abs(family.omega[0] - point.omega) < 1e-6
        assert abs(abs(family.second[0]) - expected) < 1e-5


def test_folds_and_doublings_are_near_those_of_the_slow_dynamics(families):
    kinds = [point.type for family in families for point in family.special_points]
    assert kinds == ["LP", "LP"]
    assert abs(families[0].special_points[0].omega - 0.98877) < SLOW_DYNAMICS
    # a fold of tori changes the stability of one normal direction
    for family in families:
        fold = family.special_points[0]
        assert abs(fold.state.exponents[0]) < 1e-7
        before = np.abs(family.omega - fold.omega).argmin()
        assert family.stable[: before - 1].all() and not family.stable[before + 2 :].any()


def test_growth_rates_add_up_to_the_losses(families):
    for family in families:
        assert np.abs(family.exponents.sum(axis=1) + 0.015).max() < TRACE_ERROR * 0.015


def test_growth_rate_is_that_of_a_disturbance(families):
    """Distance from an unstable torus at the same place of it, four turns later."""
    state = families[0][-1]
    assert not state.stable
    motion, period = state.motion, 2 * np.pi / state.omega
    start = np.concatenate([motion(0.0), motion.velocity(0.0)])
    change = 1e-9 * np.array([1.0, 0.3, -0.5, 0.2])
    turns = round(4 * 2 * np.pi / abs(state.second * period))
    periods = np.array([0, 100, 100 + turns])
    disturbed = integrated(state.omega, start + change, period * periods)
    angles = state.second * period * periods[1:, None] + np.linspace(-1e-4, 1e-4, 4001)
    curve = np.concatenate([strobed(motion, angles), strobed(motion, angles, 1)], axis=-1)
    distance = np.linalg.norm(disturbed[1:, None] - curve, axis=-1).min(axis=1)
    growth = np.log(distance[1] / distance[0]) / (turns * period)
    assert abs(growth - state.exponents[0]) < GROWTH_ERROR * state.exponents[0]


def strobed(motion, angles, derivatives=0):
    """Values at drive phase 0 and any second angles."""
    turned = np.exp(1j * np.multiply.outer(angles, motion.orders[1]))
    coefficients = (1j * motion.rates[:, :, None]) ** derivatives * motion.coefficients
    return np.einsum("...k,mkr->...r", turned, coefficients).real


def test_residual_is_told_and_small(families):
    for family in families:
        assert family.residual.max() < RESIDUAL
        assert family.residual.min() > 0


def test_units_do_not_matter(starts):
    scale, rate = 3e-9, 2e7
    system = two_modes(scale, rate)
    point = torus_points(system, rate)[0]
    family = follow_torus(system, point, (0.97 * rate, 1.03 * rate), direct=LEVEL, steps=4)
    plain = follow_torus(two_modes(), starts[0], RANGE, direct=LEVEL, steps=4)
    assert np.allclose(family.omega, plain.omega * rate, rtol=1e-10)
    assert np.allclose(family.second, plain.second * rate, rtol=1e-8)
    assert np.allclose(family.amplitude, plain.amplitude * scale, rtol=1e-8)


def test_level_can_be_varied_instead_of_frequency(starts, families):
    (known,) = families[0].at(0.988)
    point = starts[0]
    range_ = (0.009, 0.02)
    family = follow_torus(two_modes(), point, direct=range_, at=LEVEL, steps=3)
    assert family.varied == "direct"
    assert np.all(family.omega == point.omega)
    # the same torus from both families: level raised at the point's frequency
    again = follow_torus(two_modes(), point, (0.98, 1.0), direct=LEVEL, steps=3)
    assert abs(family.parameter[0] - LEVEL) < 1e-6
    assert abs(family.second[0] - again.second[0]) < 1e-5
    assert known.stable


def test_a_motion_in_time_leads_to_the_same_family(families):
    """From a state off the torus that settles on it."""
    omega = 0.9885
    state = np.array([-0.1636, -0.1364, 0.0564, 0.1477])
    family = follow_torus(
        two_modes(), state, (0.988, 0.9886), direct=LEVEL, at=omega, waited=200, steps=1
    )
    assert len(family) == 3
    assert family.omega[0] < family.omega[1] < family.omega[2]
    (known,) = families[0].at(omega)[:1]
    assert abs(abs(family.second[1]) - SECOND[omega]) < ROTATION_ERROR * SECOND[omega]
    assert np.abs(family.amplitude[1] - known.amplitude).max() < MOTION_ERROR


def test_a_motion_that_comes_to_rest_is_no_torus():
    system = ModalSystem(damping=[0.3], stiffness=[1.0], cubic=[[[[1.0]]]], direct=[1.0])
    with pytest.raises(ContinuationError, match="periodic"):
        follow_torus(system, np.zeros(2), (0.8, 0.9), direct=0.1, at=0.85, waited=25)


def test_tongue_is_named_with_its_ends():
    """Two modes 1:3 whose second frequency passes a thirteenth of the drive's."""
    system = random_potential(2, 0, quality=100.0)
    (point,) = explore(system, (1.5, 2.2), direct=0.1, tolerance=1e-8).points("NS")
    family = follow_torus(system, point, (1.9, 1.9912), direct=0.1, harmonics=33)
    (tongue,) = family.tongues
    assert tongue.name == "1:13"
    assert TONGUE[0] < tongue.width < TONGUE[1]
    # between the tori that turn faster and slower
    slower = np.flatnonzero(family.rotation < 1 / 13)[0]
    assert family.omega[slower - 1] < tongue.low < tongue.high < family.omega[slower]
    # the locked orbit returns after thirteen periods, by another integrator
    orbit = tongue.locked
    assert orbit.period_multiple == 13
    unit = system.scaled(0.1)
    start = np.concatenate([orbit(0.0), orbit.velocity(0.0)])
    scale = np.repeat([unit.amplitude, unit.amplitude * unit.frequency], 2)
    rate = orbit.omega / unit.frequency
    span = (0.0, 13 * 2 * np.pi / rate)
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    end = solve_ivp(equations(unit, rate), span, start / scale, **options).y[:, -1] * scale
    assert np.abs(end - start).max() < MOTION_ERROR * 10


@pytest.mark.parametrize(
    "change, words",
    [
        ({"omega": (1.1, 1.2)}, "does not hold the point"),
        ({"omega": 1.0}, "allowed exactly one"),
        ({"direct": (0.0, 1.0)}, "found 2 ranges"),
        ({"omega": (1.0, 0.9)}, "rising"),
        ({"direct": np.nan}, "direct: found nan"),
        ({"steps": 0}, "steps: found 0"),
        ({"harmonics": 1000}, "harmonics: found 1000"),
        ({"tolerance": 0.0}, "tolerance: found"),
        ({"omega": None, "direct": (0.0, 1.0)}, "at: missing"),
    ],
)
def test_wrong_input_is_named(starts, change, words):
    arguments = {"omega": RANGE, "direct": LEVEL, **change}
    with pytest.raises(ContinuationError, match=words.replace("(", r"\(")):
        follow_torus(two_modes(), starts[0], **arguments)


def test_only_neimark_sacker_points_start_a_torus():
    point = explore(two_modes(), (0.9, 1.1), direct=LEVEL).points("LP")[0]
    with pytest.raises(ContinuationError, match="allowed a special point of type NS"):
        follow_torus(two_modes(), point, RANGE, direct=LEVEL)
