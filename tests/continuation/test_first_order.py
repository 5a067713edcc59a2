"""States of first order beside the modes: closed forms, time integration, static condensation."""

from __future__ import annotations

import re

import attrs
import numpy as np
import pytest

from nanorom.continuation import (
    Drive,
    FirstOrder,
    LinearResponse,
    ModalSystem,
    PeriodicOrbit,
    explore,
    locus,
    states,
    sweep,
)
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.orbits.shooting import Shooting
from nanorom.errors import ContinuationError
from tests.continuation.independent import (
    after,
    in_order,
    motion,
    multipliers,
    random_drives,
    random_states,
    state,
)

CLOSED = 1e-10  # of an orbit: what time integration over a period may be off
MULTIPLIERS = 1e-6  # of those by differences of integrated motions
ROUND_OFF = 1e-10


def random_system(seed: int) -> ModalSystem:
    random = np.random.default_rng(seed)
    return ModalSystem(
        stiffness=[1.0, 2.7],
        damping=[0.02, 0.03],
        quadratic=0.1 * random.standard_normal((2, 2, 2)),
        cubic=0.3 * np.eye(4).reshape(2, 2, 2, 2),
        direct=[0.05, 0.02],
        parametric=[0.1, 0.0],
        states=random_states(2, 2, seed),
        drives=random_drives(2, 2, seed),
    )


@pytest.mark.parametrize("seed", [0, 1])
def test_orbits_and_multipliers_are_those_of_time_integration(seed):
    system, omega = random_system(seed), 0.8
    found = next(states(system, (omega, 1.1 * omega), 1.0, 1.0))
    rate, start = motion(system, omega, 1.0, 1.0), state(found.orbit, 2)
    end = after(rate, start, found.orbit.period)
    assert np.abs(end - start).max() < CLOSED * np.abs(start).max()
    exact = multipliers(rate, start, found.orbit.period)
    # of each state one is zero; the others are those of (q, q', T)
    assert np.count_nonzero(np.abs(found.multipliers) == 0) == 2
    assert in_order(found.multipliers[:6]) == pytest.approx(exact, abs=MULTIPLIERS)
    scaled = system.scaled(1.0, 1.0)
    orbit = Orbit(scaled.inner(found.orbit.coefficients), omega / scaled.frequency, 1)
    shot = Shooting(scaled).check(orbit)
    assert shot.defect < CLOSED
    values = in_order(shot.multipliers)
    assert values == pytest.approx(in_order(found.multipliers), abs=MULTIPLIERS)


def photothermal(time: float, feed: float = 0.02, **changes: object) -> ModalSystem:
    arguments = {
        "stiffness": [1.0],
        "damping": [0.01],
        "direct": [1.0],
        "states": FirstOrder(rate=1 / time, displacement=[[feed]], force=[[1.0]]),
    }
    return ModalSystem(**(arguments | changes))


@pytest.mark.parametrize("time", [0.1, 1.0, 10.0])
def test_photothermal_feedback_damps_and_softens_as_in_closed_form(time):
    """Metzger and Karrai 2004, doi:10.1038/nature03118: of a force delayed by tau, the part in
    phase is a spring, that in quadrature a damper.
    """
    system = photothermal(time)
    for omega in (0.5, 1.0, 1.3):
        orbit = next(states(system, (omega, 1.1 * omega), 1.0)).orbit
        lag = 0.02 * time / (1 + (omega * time) ** 2)
        stiffness, damping = 1.0 - lag, 0.01 + lag * time
        exact = 1 / (stiffness - omega**2 + 1j * omega * damping)
        heat = 0.02 * exact * time / (1 + 1j * omega * time)
        found = orbit.coefficients[1] - 1j * orbit.coefficients[2]
        assert found == pytest.approx(np.array([exact, heat]), rel=ROUND_OFF)
    exact = np.roots([1, 0.01 + 1 / time, 1.0 + 0.01 / time, 1 / time - 0.02])
    found = next(states(system, (1.0, 1.1), 1.0)).multipliers
    exact = np.append(np.exp(2 * np.pi * exact), 0.0)
    assert np.abs(np.sort_complex(found) - np.sort_complex(exact)).max() < ROUND_OFF


def test_thermal_noise_is_shaped_by_the_feedback():
    system, omega = photothermal(1.0), np.array([0.5, 1.0, 1.1])
    rest = PeriodicOrbit(np.zeros((3, 2)), 1.0)
    found = LinearResponse(system, rest).transfer(omega)
    middle = found.shape[1] // 2
    delayed = 0.02 / (1 + 1j * omega)
    exact = 1 / (1 - omega**2 + 0.01j * omega - delayed)
    assert found[:, middle, 0, 0] == pytest.approx(exact, rel=ROUND_OFF)
    assert found[:, middle, 1, 0] == pytest.approx(exact * delayed, rel=ROUND_OFF)


def heated(time: float) -> ModalSystem:
    """A film that its own motion heats and thereby softens: a cubic of -1 where tau -> 0."""
    return ModalSystem(
        stiffness=[1.0],
        damping=[0.02],
        cubic=[[[[2.0]]]],
        direct=[1.0],
        states=FirstOrder(rate=1 / time, squares=[[[1 / time]]], stiffness=[[[-1.0]]]),
    )


def test_fast_states_are_an_added_cubic():
    """What the delay adds, a damping, is of first order in tau; it shifts the peak most."""
    softer = {"damping": [0.1]}
    assert heated(0.01).condensed().cubic[0, 0, 0, 0] == pytest.approx(1.0)
    exact, slow, fast = (
        np.array([p.omega for p in explore(system, (0.8, 1.6), 0.12).points("LP")])
        for system in (
            attrs.evolve(heated(1.0), **softer).condensed(),
            attrs.evolve(heated(0.02), **softer),
            attrs.evolve(heated(0.01), **softer),
        )
    )
    assert len(exact) == len(slow) == len(fast) == 2
    assert np.abs(fast - exact) == pytest.approx([0.0, 0.0], abs=0.02)
    assert abs(fast[1] - exact[1]) < 3e-4
    assert (slow - exact) / (fast - exact) == pytest.approx([2.0, 2.0], rel=0.1)


def test_torus_bifurcations_of_driven_films_with_heat_are_followed():
    system = random_system(1)
    diagram = explore(system, (1.2, 1.45), 1.0, 1.0, depth=0)
    point = diagram.points("NS")[0]
    curve = locus(system, point, 1.0, 1.0, omega=(1.2, 1.5), level=(0.98, 1.02), steps=20)
    for end in (0, -1):
        again = explore(system, (1.2, 1.45), float(curve.level[end]), 1.0, depth=0)
        assert min(abs(p.omega - curve.omega[end]) for p in again.points("NS")) < 1e-7


def test_sweeps_in_time_settle_on_the_same_orbits():
    system, omega = heated(3.0), 0.9
    exact = next(states(system, (omega, 1.1 * omega), 0.02))
    found = sweep(system, [omega], 0.02, tolerance=1e-9, settle=1e-7, periods=2000)
    assert found.settled.all()
    assert found.amplitude[0] == pytest.approx(exact.amplitude, rel=1e-3)


def test_units_of_the_states_do_not_matter():
    states_of = heated(1.0).states
    milli = attrs.evolve(
        states_of, squares=1e3 * states_of.squares, stiffness=1e-3 * states_of.stiffness
    )
    one = explore(heated(1.0), (0.8, 1.4), 0.02)
    other = explore(attrs.evolve(heated(1.0), states=milli), (0.8, 1.4), 0.02)
    for a, b in zip(one.special_points, other.special_points, strict=True):
        assert a.omega == pytest.approx(b.omega, rel=1e-12)
        assert a.amplitude * [1, 1e3] == pytest.approx(b.amplitude, rel=1e-10)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rate": -1.0}, "states.rate: a state does not relax"),
        ({"rate": [1.0, 2.0]}, "states.displacement: shape (1, 1), expected (2, 1)"),
        ({"displacement": None}, "states: coupled to no mode"),
        ({"displacement": [[1.0, 2.0]]}, "states: found coupling to 2 modes; allowed 1"),
        ({"rate": 1e4}, "states.rate: a state relaxes more than 300 times faster"),
    ],
)
def test_wrong_states_are_refused_in_one_line(given, message):
    arguments = {"rate": 1.0, "displacement": [[1.0]]} | given
    with pytest.raises(ContinuationError, match=re.escape(message)):
        system = ModalSystem(stiffness=[1.0], damping=[0.1], states=FirstOrder(**arguments))
        system.scaled()


def test_condensed_states_may_be_driven():
    driven = [Drive(2, 0.3, states=[0.5])]
    fast = photothermal(0.01, drives=driven)
    slow = next(states(fast, (0.4, 0.5), 1.0)).orbit.coefficients[:, 0]
    at_once = next(states(fast.condensed(), (0.4, 0.5), 1.0)).orbit.coefficients[:, 0]
    assert slow[3:5] == pytest.approx(at_once[3:5], abs=0.02 * np.abs(at_once[3:5]).max())
    with pytest.raises(ContinuationError, match="states that modulate a stiffness"):
        attrs.evolve(heated(1.0), drives=driven).condensed()
