"""Amplitudes, phases and decibels of outputs against the susceptibility in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore, readout
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing

ACCURATE = 1e-8  # of an orbit between the ends of a step


def test_quadratures_and_decibels_of_a_point_are_those_of_the_susceptibility():
    system = ModalSystem(stiffness=[1.0, 4.0], damping=[0.02, 0.03], direct=[1.0, 0.5])
    branch = explore(system, (0.8, 2.4), 0.1).branches[0]
    found = readout(branch, [0.3, -0.7])
    omega = branch.omega
    exact = 0.03 / (1 - omega**2 + 0.02j * omega) - 0.035 / (4 - omega**2 + 0.03j * omega)
    assert found.amplitude == pytest.approx(exact, rel=ACCURATE)
    assert found.x - 1j * -found.y == pytest.approx(exact, rel=ACCURATE)
    assert found.size * np.exp(1j * found.phase) == pytest.approx(exact, rel=ACCURATE)
    assert np.abs(np.diff(found.phase)).max() < np.pi
    assert found.decibel(0.01) == pytest.approx(20 * np.log10(np.abs(exact) / 0.01), abs=1e-7)
    assert found.frequency == pytest.approx(omega / (2 * np.pi))


def test_time_begins_with_the_drive_and_half_harmonics_are_those_of_doubled_branches():
    diagram = explore(duffing(100.0), (1.8, 2.2), 0.0, 0.05)
    doubled = next(branch for branch in diagram.branches if branch.period_multiple == 2)
    half = readout(doubled, 0, 1 / 2)
    middle = len(doubled) // 2
    orbit = doubled.orbit(middle)
    times = orbit.period * np.arange(64) / 64
    wave = np.exp(-0.5j * orbit.omega * times)
    assert half.amplitude[middle] == pytest.approx(2 * np.mean(orbit(times)[:, 0] * wave))
    assert np.abs(readout(doubled, 0, 1).amplitude).max() < 1e-12 < half.size[middle]
    assert readout(doubled, 0, 1000).size.max() == 0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"output": 2}, "output: found mode 2; allowed 0 to 0"),
        ({"output": [1.0, 2.0]}, "output: shape"),
        ({"harmonic": 0.5}, "harmonic: found 0.5; allowed multiples of 1/1"),
    ],
)
def test_what_orbits_do_not_have_is_refused(given, message):
    branch = explore(duffing(), (0.8, 0.9), 0.001).branches[0]
    with pytest.raises(ContinuationError, match=message):
        readout(branch, **given)
    with pytest.raises(ContinuationError, match="reference"):
        readout(branch).decibel(0.0)
