"""Resonances as narrow as 1/Q: silicon-nitride strings and membranes have Q of 1e5 to 1e9."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore

POWER = 2e-3  # of the power: what the drive does in excess of the loss, anywhere on the branch
PEAK = 2e-3  # of the amplitude at the peak: f = c w q but for the third harmonic
APART = 10.0  # degrees
WIDTH = 2e-3  # of the width of a tongue: second order in the drive, and location of its ends


def duffing(damping: float) -> ModalSystem:
    return ModalSystem(
        damping=[damping],
        stiffness=[1.0],
        cubic=np.ones((1, 1, 1, 1)),
        direct=[1.0],
        parametric=[1.0],
    )


@pytest.mark.parametrize("quality", [1e4, 1e6, 1e8, 1e9])
def test_drive_and_damping_balance_on_every_orbit_at_any_quality(quality) -> None:
    """Mean power f <cos q'> = c <q'^2>, exact for periodic orbits; without it orbits of false
    amplitude continue the resonance beyond its peak.
    """
    damping = 1 / quality
    level = 0.2 * damping
    diagram = explore(duffing(damping), (0.9, 1.2), level)
    (branch,) = diagram.branches
    assert branch.ending == "range"
    for omega, coefficients in zip(branch.omega, branch.coefficients):
        harmonics = (np.arange(len(coefficients)) + 1) // 2
        speed = 0.5 * float((omega**2 * harmonics**2 * coefficients[:, 0] ** 2).sum())
        power = 0.5 * level * omega * float(coefficients[2, 0])
        assert abs(power - damping * speed) < POWER * damping * max(speed, 1e-3 * 0.2**2)
    folds = [point for point in diagram.special_points if point.type == "LP"]
    assert len(folds) == len(diagram.special_points) == 2
    peak = max(folds, key=lambda point: point.amplitude[0])
    assert abs(peak.omega * peak.amplitude[0] / 0.2 - 1) < PEAK
    assert abs(branch.amplitude.max() / peak.amplitude[0] - 1) < PEAK


@pytest.mark.parametrize("quality", [1e3, 1e6, 1e8, 1e9])
@pytest.mark.parametrize("window", [(1.9, 2.1), (1.7, 2.9)])
def test_tongues_as_narrow_as_the_damping_are_found(quality, window) -> None:
    """Of rest under a stiffness modulated by p: from 2 - d to 2 + d, d^2 = (p / 2)^2 - c^2."""
    damping = 1 / quality
    diagram = explore(duffing(damping), window, 0.0, 4 * damping, depth=0)
    points = sorted(point.omega for point in diagram.special_points)
    assert [point.type for point in diagram.special_points] == ["PD", "PD"]
    expected = np.sqrt(3.0) * damping
    np.testing.assert_allclose(np.array(points) - 2, [-expected, expected], rtol=WIDTH, atol=2e-12)


def test_combination_tongues_and_those_of_moving_orbits_are_found() -> None:
    """Near w_1 + w_2 of two modes that modulation alone couples: d = (P / sqrt(w_1 w_2)...)."""
    damping, level = 1e-6, 2e-5
    cubic = np.einsum("ij,kl->ijkl", np.eye(2), np.eye(2))
    system = ModalSystem(
        damping=[damping, damping],
        stiffness=[1.0, 1.7**2],
        cubic=cubic,
        parametric=[[0.0, 1.0], [1.0, 0.0]],
    )
    points = explore(system, (2.4, 3.1), 0.0, level, depth=0).special_points
    assert [point.type for point in points] == ["NS", "NS"]
    # averaging: w - w_1 - w_2 = +- sqrt(p^2 / (4 w_1 w_2) - c^2), both modes damped alike
    half = np.sqrt(level**2 / (4 * 1.7) - damping**2)
    width = np.ptp([point.omega for point in points])
    assert abs(width / (2 * half) - 1) < WIDTH
    # the doubling of a response under direct drive, which shifts the tongue by many of its widths
    moved = explore(duffing(1e-6), (1.7, 2.9), 0.05, 4e-6, depth=0).special_points
    assert [point.type for point in moved] == ["PD", "PD"]
    assert 2e-6 < np.ptp([point.omega for point in moved]) < 4e-6


def test_doubled_motions_that_nothing_leads_to_are_found_each_once() -> None:
    """Under both drives there are four, of two phases each: two of the tongue, two beside it. The
    power of the drives is the loss in each of them.
    """
    damping, direct, parametric, omega = 1e-6, 0.05, 4e-6, 2.3
    diagram = explore(duffing(damping), (1.7, 2.9), direct, parametric)
    phases = []
    for branch in diagram.branches:
        if branch.period_multiple == 1:
            continue
        index = int(np.abs(branch.omega - omega).argmin())
        orbit = branch.orbit(index)
        times, q, v = orbit.time_series()
        drive = np.cos(orbit.omega * times)[:-1, None]
        power = (v[:-1] * drive * (direct + parametric * q[:-1])).mean()
        assert abs(power / (damping * (v[:-1] ** 2).mean()) - 1) < POWER
        for place in np.flatnonzero(np.diff(np.sign(branch.omega - omega))):
            cosine, sine = branch.coefficients[place][1:3, 0]
            phases.append(np.degrees(np.arctan2(sine, cosine)) % 180)  # a period later: 180 more
    assert len(phases) == 4
    assert np.diff(np.sort(phases)).min() > APART
