"""Ramps and ring-downs against Green's functions, closed forms and elliptic integrals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.special import ellipk

from nanorom.continuation import ModalSystem, PeriodicOrbit, ramp, ring_down, states
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing

QUALITY = 100.0


def linear(quality: float = QUALITY) -> ModalSystem:
    return ModalSystem(stiffness=[1.0], damping=[1 / quality], direct=[1.0])


def last_orbit(system: ModalSystem, omega: tuple[float, float], direct: float) -> PeriodicOrbit:
    return list(states(system, omega, direct))[-1].orbit


def test_fast_ramp_is_the_convolution_with_the_impulse_response():
    start, stop, rate = 0.95, 1.05, 5e-5
    found = ramp(linear(), (start, stop), rate, 1.0, state=np.zeros(2), tolerance=1e-11)
    decay = 0.5 / QUALITY
    damped = np.sqrt(1 - decay**2)
    speed = 2 * np.pi * rate
    end = (stop - start) / speed
    end -= end % (2 * np.pi / stop / 32)  # whole samples
    nodes, weights = np.polynomial.legendre.leggauss(2000)
    s, w = end * (nodes + 1) / 2, end * weights / 2
    force = np.cos(start * s + speed * s**2 / 2)
    response = np.exp(-decay * (end - s)) * np.exp(1j * damped * (end - s)) / damped
    q = (w * force * response.imag).sum()
    v = (w * force * (damped * response.real - decay * response.imag)).sum()
    assert found.state == pytest.approx([q, v], abs=1e-7)


def test_slow_ramps_tend_to_the_response_at_rest_in_frequency():
    quality, errors = 20.0, []
    for rate in (2e-5, 1e-5):
        found = ramp(linear(quality), (0.9, 1.05), rate, 1e-3)
        after = found.omega > 0.93  # when the start has died out
        omega = found.omega[after]
        exact = 1e-3 / (1 - omega**2 + 1j * omega / quality)
        errors.append(np.abs(found.amplitude[after, 0] - exact).max() / np.abs(exact).max())
    assert errors[1] < 0.1
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)  # of first order in the rate
    assert found.frequency[-1] < 1.05 / (2 * np.pi)


def test_falling_and_rising_ramps_jump_at_different_folds():
    system = duffing(25.0)
    up = ramp(system, (1.0, 1.2), 5e-5, 0.04, tolerance=1e-6)
    down = ramp(system, (1.2, 1.0), 5e-5, 0.04, tolerance=1e-6)
    largest = [float(each.omega[np.abs(each.amplitude[:, 0]).argmax()]) for each in (up, down)]
    assert np.all(np.diff(up.omega) > 0) and np.all(np.diff(down.omega) < 0)
    assert largest[0] > largest[1] + 0.05


def test_linear_motion_rings_down_at_its_own_frequency_and_rate():
    found = ring_down(linear(), last_orbit(linear(), (0.9, 1.0), 0.01), 5 * QUALITY)
    assert found.omega == pytest.approx(np.sqrt(1 - 0.25 / QUALITY**2), rel=1e-8)
    assert found.decay == pytest.approx(0.5 / QUALITY, rel=1e-6)
    assert found.quality_factor == pytest.approx(QUALITY, rel=1e-4)
    assert found.amplitude == pytest.approx(
        found.amplitude[0] * np.exp(-0.5 / QUALITY * (found.time - found.time[0])), rel=1e-5
    )


def elliptic_backbone(amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First harmonic and frequency of q'' + q + q^3 = 0 by its largest displacement."""
    m = amplitude**2 / (2 * (1 + amplitude**2))
    k = ellipk(m)
    nome = np.exp(-np.pi * ellipk(1 - m) / k)
    first = amplitude * 2 * np.pi / (np.sqrt(m) * k) * np.sqrt(nome) / (1 + nome)
    return first, np.pi * np.sqrt(1 + amplitude**2) / (2 * k)


def test_nonlinear_motion_rings_down_along_the_backbone():
    quality = 400.0
    system = duffing(quality)
    orbit = last_orbit(system, (0.9, 1.02), 0.4 / quality)
    found = ring_down(system, orbit, 2 * quality)
    backbone = CubicSpline(*elliptic_backbone(np.linspace(0.01, 0.5, 400)))
    assert found.amplitude[0] / found.amplitude[-1] > 1.8
    assert found.omega == pytest.approx(backbone(found.amplitude), rel=3e-4)
    inner = slice(400, -400)  # the windows at the ends see but one side
    assert found.omega[inner] == pytest.approx(backbone(found.amplitude[inner]), rel=2e-5)
    assert found.decay == pytest.approx(0.5 / quality, rel=0.03)  # smaller where it stiffens


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s, o: ramp(s, (1.0, 1.0), 1.0), "omega: found"),
        (lambda s, o: ramp(s, (1.0, 2.0), -1.0), "rate: found -1.0; allowed more than 0"),
        (lambda s, o: ramp(s, (1.0, 2.0), 1e-9), "time: found 5.07e.07 periods"),
        (lambda s, o: ramp(s, (1.0, 2.0), 1.0, periods=1), "periods: found 1"),
        (lambda s, o: ramp(s, (1.0, 2.0), 1.0, state=[0.0]), "state: give"),
        (lambda s, o: ring_down(s, o, 1e9), "allowed 2e.05; take a shorter time"),
        (lambda s, o: ring_down(s, o, 1.0), "time: found 1.0; allowed more than"),
        (lambda s, o: ring_down(s, o, 1e3, output=[1.0, 0.0]), "output: shape"),
        (lambda s, o: ring_down(s, o, 1e3, output=[0.0]), "output: it does not move"),
    ],
)
def test_what_cannot_be_integrated_is_refused_before_it_is(call, message):
    orbit = PeriodicOrbit(np.array([[0.0], [0.1], [0.0]]), 1.0)
    with pytest.raises(ContinuationError, match=message):
        call(linear(), orbit)
