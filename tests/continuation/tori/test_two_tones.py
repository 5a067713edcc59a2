"""Two drives at once: against closed forms, time integration and linear periodic response."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import ModalSystem, Tone, explore, two_tones
from nanorom.errors import ContinuationError

EXACT, LOSS = 1e-11, 0.02
MOTION_ERROR, FOLD_ERROR = 1e-10, 1e-8
GAIN_ERROR = 1e-6  # tones as small as 1e-6 of the nonlinear amplitude leave the linear response


def oscillator(cubic=0.0, quadratic=0.0):
    return ModalSystem(
        damping=[LOSS],
        stiffness=[1.0],
        cubic=[[[[cubic]]]],
        quadratic=[[[quadratic]]],
        direct=[1.0],
        parametric=[[1.0]],
    )


def susceptibility(omega):
    return 1 / (1 - omega**2 + 1j * LOSS * omega)


def test_linear_responses_add():
    family = two_tones(oscillator(), Tone(0.9, 0.1), Tone((1.2, 1.4), 0.05))
    assert family.ending == "range"
    for state in family.states:
        line = state.motion.line
        assert abs(line(1, 0)[0] - 0.1 * susceptibility(0.9)) < EXACT
        assert abs(line(0, 1)[0] - 0.05 * susceptibility(state.second)) < EXACT
        sizes = 0.1 * abs(susceptibility(0.9)) + 0.05 * abs(susceptibility(state.second))
        assert abs(state.amplitude[0] - sizes) < EXACT  # incommensurate: they meet in the end
        assert np.abs(state.exponents + LOSS / 2).max() < 1e-6


def test_sidebands_solve_the_equations():
    system = oscillator(cubic=1.0, quadratic=0.1)
    family = two_tones(system, Tone(1.02, 0.02), Tone(1.06, (0.009, 0.01), 0.01))
    state = family[-1]
    assert state.parameter == pytest.approx(0.01, abs=1e-14)

    def right_side(time, y):
        one, two = np.cos(1.02 * time), np.cos(1.06 * time)
        force = 0.02 * one + 0.01 * two * (1 + y[0])
        return [y[1], force - LOSS * y[1] - y[0] - 0.1 * y[0] ** 2 - y[0] ** 3]

    times = np.linspace(0.0, 100.0, 31)
    start = [state.motion(0.0)[0], state.motion.velocity(0.0)[0]]
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    exact = solve_ivp(right_side, (0.0, 100.0), start, t_eval=times, **options).y[0]
    assert np.abs(state.motion(times)[:, 0] - exact).max() < MOTION_ERROR
    assert abs(state.motion.line(2, -1)[0]) > 0.01  # intermodulation 2 w1 - w2


def test_amplification_by_a_parametric_pump():
    """Signal and idler below threshold, against the linear equations of all their sidebands."""
    pump, signal = 0.03, 1e-6
    family = two_tones(oscillator(cubic=1.0), Tone(2.0, 0.0, pump), Tone((0.99, 0.999), signal))
    state = family[-1]
    orders = np.arange(-6, 7)
    rates = state.second + 2.0 * orders
    matrix = np.diag(1 / susceptibility(rates)).astype(complex)
    matrix -= pump / 2 * (np.eye(13, k=1) + np.eye(13, k=-1))
    exact = np.linalg.solve(matrix, signal * (orders == 0))
    assert abs(exact[6]) > 2 * abs(signal * susceptibility(state.second))
    for order, value in zip((-1, 0), exact[5:7]):
        found = state.motion.line(order, 1)[0]
        assert abs(found - value) < GAIN_ERROR * abs(value)


def test_folds_are_those_of_periodic_motion_where_the_first_tone_is_silent():
    system, level = oscillator(cubic=1.0), 0.015
    family = two_tones(system, Tone(3.0), Tone((0.98, 1.2), level), tolerance=1e-9)
    folds = explore(system, (0.98, 1.2), direct=level).points("LP")
    assert [point.type for point in family.special_points] == ["LP"] * len(folds) == ["LP", "LP"]
    found = sorted(point.second for point in family.special_points)
    assert np.abs(np.array(found) - sorted(fold.omega for fold in folds)).max() < FOLD_ERROR


@pytest.mark.parametrize(
    "first, second, words",
    [
        (Tone((1.0, 2.0)), Tone(1.0, (0.0, 1.0)), "first.omega"),
        (Tone(1.0), Tone(1.0), "found 0 ranges"),
        (Tone(1.0), Tone((1.0, 2.0), (0.0, 1.0)), "found 2 ranges"),
        (Tone(1.0), Tone((2.0, 1.0), 0.1), "rising"),
        (Tone(1.0), Tone(1.0, (0.0, 1.0), np.inf), "second.parametric"),
        (Tone(-1.0), Tone(1.0, (0.0, 1.0)), "positive frequencies"),
    ],
)
def test_wrong_tones_are_named(first, second, words):
    with pytest.raises(ContinuationError, match=words):
        two_tones(oscillator(), first, second)
