"""Noise about periodic motion: the text book's at rest, variances, squeezing, gain in time."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp, trapezoid
from scipy.linalg import solve_discrete_lyapunov

from nanorom.continuation import LinearResponse, ModalSystem, PeriodicOrbit, explore
from nanorom.continuation.noise import BOLTZMANN
from nanorom.errors import ContinuationError
from tests.continuation.systems import random_potential

ROOM = 293.0  # K
EXACT = 1e-10  # arrays keep 13 digits, of which resonances take some
VARIANCE_ERROR = 1e-4  # of the numerical integral over frequency
ROTATING_WAVE = 2e-3  # error of the averaged parametric amplifier at Q = 1000
GAIN_ERROR = 1e-6

MASS = np.array([[2e-16, 2e-17], [2e-17, 1e-16]])
STIFFNESS = np.array([[3.0, 0.2], [0.2, 5.0]])
DAMPING = np.array([[4e-10, 5e-11], [5e-11, 3e-10]])


def at_rest(size, omega):
    return PeriodicOrbit(np.zeros((3, size)), omega)


def film():
    """Two coupled modes in SI units, of some 20 and 35 MHz."""
    return ModalSystem(MASS, DAMPING, STIFFNESS, direct=[1.0, 0.0])


def test_at_rest_it_is_the_text_books():
    omega = np.array([1e7, 1.2e8, 2.3e8])
    found = LinearResponse(film(), at_rest(2, 1e8)).density(omega, ROOM)
    for value, density in zip(omega, found):
        susceptibility = np.linalg.inv(STIFFNESS - value**2 * MASS + 1j * value * DAMPING)
        expected = 4 * BOLTZMANN * ROOM * susceptibility @ DAMPING @ susceptibility.conj().T
        assert np.abs(density - expected).max() < EXACT * np.abs(expected).max()


def test_every_mode_at_rest_has_the_energy_of_its_temperature():
    """Equipartition: the integral of the density over frequency is k T K^-1."""
    mass, quality, omega = 2e-16, 50.0, 1e8
    system = ModalSystem(mass, mass * omega / quality, [mass * omega**2])
    response = LinearResponse(system, at_rest(1, omega))

    def density(ratio):
        return response.displacement(ratio * omega, ROOM, [1.0])[0] ** 2 * 1e18

    points = (0.9, 0.97, 1.0, 1.03, 1.1)
    total = quad(density, 1e-6, 3.0, points=points, limit=400)[0] + quad(density, 3.0, 60.0)[0]
    expected = BOLTZMANN * ROOM / (mass * omega**2) * 1e18
    assert abs(total * omega / (2 * np.pi) - expected) < VARIANCE_ERROR * expected


def stable_orbit(system, low, high, level, parametric=0.0):
    branch = explore(system, (low, high), level, parametric).branches[0]
    index = int(np.argmax(np.where(branch.stable, branch.amplitude[:, 0], 0)))
    return branch.orbit(index)


def variational(system, orbit, level, parametric):
    """A(t) of the disturbed equations with unit mass, by the tensors as they stand."""
    size = system.size

    def matrix(time):
        q = orbit(time)
        stiffness = (
            system.stiffness
            + np.einsum("rjk,j->rk", system.quadratic + system.quadratic.transpose(0, 2, 1), q)
            + 3 * np.einsum("rjkl,j,k->rl", system.cubic, q, q)
            - parametric * np.cos(orbit.omega * time) * system.parametric
        )
        return np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -system.damping]])

    return matrix


def test_variance_about_an_orbit_is_that_of_the_moment_equations():
    """The periodic solution of P' = A P + P A^T + D against the integral of the
    density over all frequencies.
    """
    system = random_potential(2, 5, quality=8.0)
    level = 0.4
    orbit = stable_orbit(system, 0.6, 1.6, level)
    matrix = variational(system, orbit, level, 0.0)
    force = np.zeros((4, 4))
    force[2:, 2:] = 2 * BOLTZMANN * ROOM * system.damping * 1e21

    def right_side(time, flat):
        p = flat.reshape(4, 4)
        a = matrix(time)
        return (a @ p + p @ a.T + force).ravel()

    def transition(time, flat):
        return (matrix(time) @ flat.reshape(4, 4)).ravel()

    span, options = (0.0, orbit.period), {"method": "DOP853", "rtol": 1e-9, "atol": 1e-12}
    monodromy = solve_ivp(transition, span, np.eye(4).ravel(), **options).y[:, -1].reshape(4, 4)
    added = solve_ivp(right_side, span, np.zeros(16), **options).y[:, -1].reshape(4, 4)
    start = solve_discrete_lyapunov(monodromy, added)
    times = orbit.period * np.arange(64) / 64
    course = solve_ivp(right_side, span, start.ravel(), t_eval=times, **options).y
    expected = course.mean(axis=1).reshape(4, 4)[:2, :2]
    response = LinearResponse(system, orbit, level)
    edges = np.concatenate([np.linspace(1e-6, 6.0, 1201), np.geomspace(6.0, 400.0, 301)[1:]])
    values = response.density(edges, ROOM).real * 1e21
    total = trapezoid(values, edges, axis=0)
    assert np.abs(total / (2 * np.pi) - expected).max() < VARIANCE_ERROR * np.abs(expected).max()


def test_squeezing_beside_the_period_doubling_is_that_of_the_parametric_amplifier():
    """Pumped at twice its frequency to a part g of the threshold, an oscillator's quadratures have
    densities 1/(1 + g)^2 and 1/(1 - g)^2 of that at rest, on resonance.
    """
    loss, part = 1e-3, 0.6
    system = ModalSystem(damping=[loss], stiffness=[1.0], cubic=[[[[1.0]]]], parametric=[[1.0]])
    pump = part * 2 * loss
    rest = LinearResponse(system, at_rest(1, 2.0), 0.0, 0.0)
    pumped = LinearResponse(system, at_rest(1, 2.0), 0.0, pump)
    still = rest.quadratures(1.0, 1e-7, ROOM, [1.0])
    small, large, phase = pumped.quadratures(1.0, 1e-7, ROOM, [1.0])
    assert abs(still[0] / still[1] - 1) < ROTATING_WAVE
    assert abs(small / still[0] * (1 + part) ** 2 - 1) < ROTATING_WAVE
    assert abs(large / still[1] * (1 - part) ** 2 - 1) < ROTATING_WAVE
    assert abs(np.cos(phase + np.pi / 4)) < 0.01 or abs(np.sin(phase + np.pi / 4)) < 0.01


def test_response_to_a_small_force_is_that_of_time_integration():
    system = random_potential(2, 5, quality=8.0)
    level, nu, small = 0.4, 0.83, 1e-6
    orbit = stable_orbit(system, 0.6, 1.6, level)
    response = LinearResponse(system, orbit, level)
    matrix = variational(system, orbit, level, 0.0)
    most = 6
    lines = []
    for order in range(-most, most + 1):
        # the force at nu answers at nu + order * rate
        rows = response.transfer(nu + order * response.rate)
        middle = (rows.shape[1] - 1) // 2
        lines.append(rows[0, middle - order, :, 0])

    def right_side(time, y):
        rate = matrix(time) @ y
        rate[2] += small * np.cos(nu * time)
        return rate

    times = np.linspace(250.0, 280.0, 40)
    options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-16, "t_eval": times}
    exact = solve_ivp(right_side, (0.0, 280.0), np.zeros(4), **options).y[:2].T / small
    rates = nu + response.rate * np.arange(-most, most + 1)
    found = (np.exp(1j * np.outer(times, rates)) @ np.array(lines)).real
    assert np.abs(found - exact).max() < GAIN_ERROR * np.abs(exact).max()


def test_wrong_input_is_named():
    system = ModalSystem(damping=[1e-3], stiffness=[1.0], cubic=[[[[1.0]]]], parametric=[[1.0]])
    with pytest.raises(ContinuationError, match="unstable"):
        LinearResponse(system, at_rest(1, 2.0), 0.0, 0.01)
    response = LinearResponse(system, at_rest(1, 2.0))
    with pytest.raises(ContinuationError, match="temperature"):
        response.density(1.0, -1.0)
    with pytest.raises(ContinuationError, match="carrier"):
        response.quadratures(1.1, 0.0, ROOM, [1.0])
    with pytest.raises(ContinuationError, match="found 2 modes"):
        LinearResponse(system, at_rest(2, 2.0))
