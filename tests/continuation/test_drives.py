"""Drives of several harmonics with phases: closed forms, time integration, symmetries."""

from __future__ import annotations

import re

import numpy as np
import pytest

from nanorom.continuation import (
    Drive,
    LinearResponse,
    ModalSystem,
    explore,
    locus,
    rest_states,
    states,
)
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.orbits.shooting import Shooting
from nanorom.errors import ContinuationError, FileError
from nanorom.export.export import export
from tests.continuation.independent import after, motion, multipliers, random_drives, state

CLOSED = 1e-10  # of an orbit: what time integration over a period may be off
MULTIPLIERS = 1e-6  # of those by differences of integrated motions
ROUND_OFF = 1e-11

TWO_MODES = {
    "stiffness": [1.0, 2.2],
    "damping": [0.01, 0.02],
    "cubic": 0.6 * np.einsum("ij,kl->ijkl", np.eye(2), np.eye(2))
    + np.einsum("i,j,k,l->ijkl", *[[1.0, 0.5]] * 4),
}
PATTERN = np.array([[1.0, 0.2], [0.2, 0.8]])


def amplifier(quality: float, pump: float, phase: float) -> ModalSystem:
    """Signal of amplitude 1/Q at w, pump at 2 w at a part `pump` of its threshold 2/Q."""
    return ModalSystem(
        stiffness=[1.0],
        damping=[1 / quality],
        direct=[1.0],
        drives=[Drive(2, phase, parametric=[2 * pump / quality])],
    )


def complex_amplitude(system: ModalSystem, omega: float, direct: float) -> complex:
    orbit = next(states(system, (omega, 1.1 * omega), direct, 1.0)).orbit
    return complex(orbit.coefficients[1, 0] - 1j * orbit.coefficients[2, 0])


@pytest.mark.parametrize("phase", [-1.3, 0.0, 0.7, np.pi / 2, 2.5])
@pytest.mark.parametrize("quality", [1e3, 1e6])
def test_degenerate_amplifier_has_the_gain_of_the_textbook_by_phase(quality, phase):
    """Rugar and Gruetter 1991, doi:10.1103/PhysRevLett.67.699: quadratures are amplified by
    1/(1 - x) and 1/(1 + x); the averaging behind it is right to 1/Q.
    """
    pump = 0.9
    gain = abs(complex_amplitude(amplifier(quality, pump, phase), 1.0, 1 / quality))
    # the signal's quadrature along the amplified one, and across it
    along, across = np.cos(phase / 2 + np.pi / 4), np.sin(phase / 2 + np.pi / 4)
    assert gain == pytest.approx(np.hypot(along / (1 - pump), across / (1 + pump)), rel=3 / quality)


def hill(quality: float, pump: float, phase: float, omega: float, most: int = 12) -> complex:
    """The amplifier's response at omega from Hill's matrix of the harmonics -most ... most."""
    numbers = np.arange(-most, most + 1)
    matrix = np.diag(1 - (numbers * omega) ** 2 + 1j * numbers * omega / quality)
    for step, turn in ((2, np.exp(1j * phase)), (-2, np.exp(-1j * phase))):
        matrix -= pump / quality * turn * np.eye(2 * most + 1, k=-step)
    force = np.isin(numbers, (-1, 1)) / (2 * quality)
    return complex(2 * np.linalg.solve(matrix, force)[most + 1])


@pytest.mark.parametrize("omega", [0.7, 0.99, 1.0, 1.02])
def test_amplifier_is_that_of_hills_matrix(omega):
    found = complex_amplitude(amplifier(50.0, 0.8, 0.6), omega, 1 / 50)
    assert abs(found - hill(50.0, 0.8, 0.6, omega)) < ROUND_OFF * abs(found)


@pytest.mark.parametrize("seed", [0, 1])
def test_orbits_and_multipliers_are_those_of_time_integration(seed):
    system = ModalSystem(
        **TWO_MODES, direct=[0.05, 0.02], parametric=PATTERN, drives=random_drives(2, 0, seed)
    )
    omega = 0.8
    found = next(states(system, (omega, 1.1 * omega), 1.0, 0.5))
    rate, start = motion(system, omega, 1.0, 0.5), state(found.orbit, 2)
    end = after(rate, start, found.orbit.period)
    assert np.abs(end - start).max() < CLOSED * np.abs(start).max()
    exact = multipliers(rate, start, found.orbit.period)
    assert np.abs(np.sort_complex(found.multipliers) - np.sort_complex(exact)).max() < MULTIPLIERS
    scaled = system.scaled(1.0, 0.5)
    orbit = Orbit(scaled.inner(found.orbit.coefficients), omega / scaled.frequency, 1)
    shot = Shooting(scaled).check(orbit)
    assert shot.defect < CLOSED
    assert np.abs(np.sort_complex(shot.multipliers) - np.sort_complex(exact)).max() < MULTIPLIERS


def test_gate_voltage_is_squared_and_pulls_the_film():
    """(V + v cos wt)^2 with force and stiffness, against its integration in time."""
    steady, alternating, omega = 1.3, 0.4, 0.9
    force, stretch = np.array([0.02]), np.array([[0.05]])
    parts = {0: steady**2 + alternating**2 / 2, 1: 2 * steady * alternating, 2: alternating**2 / 2}
    system = ModalSystem(
        stiffness=[1.0],
        damping=[0.02],
        cubic=[[[[1.0]]]],
        drives=[Drive(k, direct=c * force, parametric=c * stretch) for k, c in parts.items()],
    )
    orbit = next(states(system, (omega, 1.1 * omega), 1.0, 1.0)).orbit

    def rate(t, y):
        square = (steady + alternating * np.cos(omega * t)) ** 2
        pull = square * (force[0] + stretch[0, 0] * y[0])
        return [y[1], pull - y[0] - 0.02 * y[1] - y[0] ** 3]

    start = state(orbit, 1)
    assert np.abs(after(rate, start, orbit.period) - start).max() < CLOSED


def test_pump_at_twice_the_frequency_is_the_parametric_drive_at_its_own():
    plain = explore(ModalSystem(**TWO_MODES, parametric=PATTERN), (1.7, 3.2), 0.0, 0.08)
    pump = ModalSystem(**TWO_MODES, drives=[Drive(2, parametric=PATTERN)])
    double = explore(pump, (0.85, 1.6), 0.0, 0.08)
    assert len(plain.special_points) == len(double.special_points) >= 7
    for one, two in zip(plain.special_points, double.special_points):
        assert two.omega == pytest.approx(one.omega / 2, rel=ROUND_OFF)
        assert two.type == one.type.replace("PD", "BP")


def test_only_the_phase_between_harmonics_matters():
    delay, pump = 1.1, 0.3
    tensor = 0.1 * np.ones((2, 2, 2))
    own = {"direct": [1.0, 0.3], "parametric": PATTERN}
    first = ModalSystem(
        **TWO_MODES,
        **own,
        quadratic=tensor,
        drives=[Drive(2, pump, direct=[0.3, 0.0], parametric=0.5 * PATTERN)],
    )
    later = ModalSystem(
        **TWO_MODES,
        quadratic=tensor,
        drives=[
            Drive(1, delay, **own),
            Drive(2, pump + 2 * delay, direct=[0.3, 0.0], parametric=0.5 * PATTERN),
        ],
    )
    points = [explore(system, (0.6, 1.7), 0.03, 0.1).special_points for system in (first, later)]
    assert len(points[0]) == len(points[1]) >= 3
    for one, two in zip(*points):
        assert (one.type, two.omega) == (two.type, pytest.approx(one.omega, rel=ROUND_OFF))
    level = 0.032
    curve = locus(first, points[0][0], 0.03, 0.1, omega=(0.6, 1.7), level=(0.03, level), steps=30)
    there = explore(first, (0.6, 1.7), float(curve.level[-1]), 0.1).points("LP")
    assert min(abs(point.omega - curve.omega[-1]) for point in there) < 1e-9


def test_small_disturbances_of_a_pumped_film_are_those_of_hills_matrix():
    system, omega, offset = amplifier(50.0, 0.8, 0.6), 1.01, 0.003
    orbit = next(states(system, (omega, 1.1), 1 / 50, 1.0)).orbit
    response = LinearResponse(system, orbit, 1 / 50, 1.0)
    found = response.transfer(omega + offset)[0, :, 0, 0]
    middle = len(found) // 2
    numbers = np.arange(-12, 13)
    s = offset + omega * (1 + numbers)
    matrix = np.diag(1 - s**2 + 1j * s / 50)
    for step, turn in ((2, np.exp(0.6j)), (-2, np.exp(-0.6j))):
        matrix -= 0.8 / 50 * turn * np.eye(25, k=-step)
    exact = np.linalg.inv(matrix)[12]
    assert np.abs(found[middle - 4 : middle + 5] - exact[8:17]).max() < 1e-8 * np.abs(exact).max()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"harmonic": -1}, "drives: found harmonic -1; allowed a whole number from 0 to 20"),
        ({"harmonic": 1.5}, "drives: found harmonic 1.5"),
        ({"phase": np.nan}, "drives: found phase nan"),
        ({"harmonic": 0, "phase": 0.5}, "and 0 of a constant force"),
        ({"direct": [1.0, 2.0]}, "drives.direct: shape (2,), expected (1,)"),
        ({"states": [1.0]}, "drives.states: shape (1,), expected (0,)"),
    ],
)
def test_wrong_drives_are_refused_in_one_line(given, message):
    with pytest.raises(ContinuationError, match=re.escape(message)):
        ModalSystem(stiffness=[1.0], damping=[0.1], drives=[Drive(**given)])


def test_what_other_programs_do_not_know_is_not_exported(tmp_path):
    with pytest.raises(FileError, match="several harmonics"):
        export(amplifier(10.0, 0.1, 0.0), "csv", tmp_path / "out.csv")


def test_level_enters_by_the_power_that_a_drive_says():
    """A field acts with its square: level 3 is nine times the force of level 1."""
    parts = {"stiffness": [1.0, 2.3], "damping": [0.02, 0.03], "cubic": np.full((2,) * 4, 0.1)}
    j, p = np.array([1.0, 0.4]), np.array([[0.2, 0.1], [0.1, 0.0]])
    square = ModalSystem(**parts, drives=[Drive(2, direct=j, parametric=p, power=2)])
    plain = ModalSystem(**parts, drives=[Drive(2, direct=j, parametric=p)])
    level = 0.3
    one, other = square.scaled(level, level), plain.scaled(level**2, level**2)
    assert one.force == pytest.approx(other.force, rel=1e-14)
    assert one.parametric == pytest.approx(other.parametric, rel=1e-14)
    with pytest.raises(ContinuationError, match="power of the level"):
        rest_states(square, (0.0, 1.0), "direct")
    with pytest.raises(ContinuationError, match=r"^drives: found power 0"):
        Drive(2, direct=j, power=0)
