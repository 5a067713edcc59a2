"""Lyapunov exponents: of orbits those of multipliers, of tori zero, of chaos the published ones."""

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore, follow_torus, lyapunov
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing

PUBLISHED = 0.1572  # x'' + .25 x' - x + x^3 = .4 sin t; Sprott 2003, Chaos and Time-Series
# Analysis, appendix A.4.6; numerical, its last digit is not sure
PUBLISHED_ERROR = 0.001
EXACT = 1e-6  # of exponents of orbits and of the sum of all
SURE = 4.0  # standard errors


def test_exponents_of_stable_orbits_are_those_of_their_multipliers():
    """Of an oscillator damped so much that multipliers are real: no turns to average over."""
    system = duffing(0.4)
    branch = explore(system, (0.8, 1.6), direct=0.5).branches[0]
    real = np.abs(branch.multipliers.imag).max(axis=1) == 0
    apart = np.abs(np.diff(np.log(np.abs(branch.multipliers)), axis=1))[:, 0] > 1.0
    some = np.flatnonzero(branch.stable & real & apart)[::4]
    assert len(some) >= 5
    orbits = [branch.orbit(int(number)) for number in some]
    states = [np.concatenate([orbit(0.0), orbit.velocity(0.0)]) for orbit in orbits]
    omega = branch.omega[some]
    found = lyapunov(
        system, omega, 0.5, state=states, count=2, waited=0, periods=200, tolerance=1e-11
    )
    exact = np.log(np.abs(branch.multipliers[some])) * (omega / (2 * np.pi))[:, None]
    assert np.abs(found.exponents - np.sort(exact)[:, ::-1]).max() < EXACT
    assert np.abs(found.exponents.sum(axis=1) + 2.5).max() < EXACT


def test_a_chaotic_oscillator_has_the_published_exponents():
    """About one of its two wells, x = 1 + y; 48 starts of 500 periods."""
    one = np.ones((1, 1, 1, 1))
    wells = ModalSystem(
        damping=[0.25], stiffness=[2.0], quadratic=3 * one[0], cubic=one, direct=[1.0]
    )
    starts = np.random.default_rng(1).uniform(-1, 1, (48, 2))
    found = lyapunov(wells, 1.0, 0.4, state=starts, count=2, waited=200, periods=500)
    mean, spread = found.largest.mean(), found.largest.std(ddof=1)
    assert abs(mean - PUBLISHED) < PUBLISHED_ERROR + SURE * spread / np.sqrt(48)
    assert np.abs(found.exponents.sum(axis=1) + 0.25).max() < EXACT
    # the error that each tells is what they scatter by
    assert 0.5 < found.error[:, 0].mean() / spread < 2.0


def test_on_a_torus_the_largest_is_zero_and_the_others_are_its_own():
    quadratic = np.zeros((2, 2, 2))
    quadratic[0, 0, 1] = quadratic[0, 1, 0] = 0.5
    quadratic[1, 0, 0] = 1.0
    system = ModalSystem(
        damping=[0.005, 0.01], stiffness=[1.0, 4.0], quadratic=quadratic, direct=[1.0, 0.0]
    )
    points = explore(system, (0.97, 1.0), direct=0.01).points("NS")
    start = min(points, key=lambda point: point.omega)
    torus = follow_torus(system, start, omega=(0.984, 0.9886), direct=0.01).at(0.9885)[0]
    state = np.concatenate([torus.motion(0.0), torus.motion.velocity(0.0)])
    found = lyapunov(system, 0.9885, 0.01, state=state, count=4, waited=0, periods=3000)
    assert abs(found.largest[0]) < SURE * found.error[0, 0] < 1e-3
    others = np.abs(found.exponents[0, 1:] - torus.exponents)
    assert (others < SURE * found.error[0, 1:] + 1e-5).all()
    assert found.exponents.sum() == pytest.approx(-0.015, abs=EXACT)


@pytest.mark.parametrize(
    ("options", "told"), [({"count": 3}, "count"), ({"periods": 10}, "periods")]
)
def test_what_makes_no_sense_is_told(options, told):
    with pytest.raises(ContinuationError, match=told):
        lyapunov(duffing(), 1.0, 0.05, **options)
