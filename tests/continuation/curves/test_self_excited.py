"""Hopf points of states at rest and limit cycles against closed forms and time integration."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import (
    Drive,
    FirstOrder,
    ModalSystem,
    RestPoint,
    explore,
    limit_cycles,
    rest_states,
)
from nanorom.errors import ContinuationError
from tests.continuation.independent import after, motion, multipliers, state

CLOSED = 1e-7  # of an orbit: what time integration over a period may be off
LOCATED = 1e-10
DIFFERENCES = 1e-4  # of multipliers from differences of integrated motions
DAMPING, RELAXATION, FEED = 0.01, 0.2, -0.05


def photothermal(power: float, **changes: object) -> ModalSystem:
    """Light heats the film by where it is, and heat pushes it: T' = -R T + power g q."""
    arguments = {
        "stiffness": [1.0],
        "damping": [DAMPING],
        "cubic": [[[[0.5]]]],
        "states": FirstOrder(RELAXATION, displacement=[[power * FEED]], force=[[1.0]]),
    }
    return ModalSystem(**(arguments | changes))


def test_photothermal_oscillation_begins_where_hurwitz_has_it():
    found = rest_states(photothermal(0.0), (0.0, 1.0), photothermal(1.0))
    (point,) = found.special_points
    # (s^2 + c s + 1)(s + R) - P g = 0 has a pair on the axis
    critical = (1 + DAMPING * RELAXATION) * (DAMPING + RELAXATION) - RELAXATION
    assert point.type == "HB"
    assert point.level == pytest.approx(critical / -FEED, rel=LOCATED)
    assert point.omega == pytest.approx(np.sqrt(1 + DAMPING * RELAXATION), rel=LOCATED)
    assert found.stable[found.level < point.level].all()
    assert not found.stable[found.level > point.level].any()


def test_photothermal_limit_cycles_are_those_of_time_integration():
    off, on = photothermal(0.0), photothermal(1.0)
    (point,) = rest_states(off, (0.0, 1.0), on).special_points
    curve = limit_cycles(off, point, (0.0, 1.0), on)
    assert len(curve) > 20 and curve.stable[1:].all() and not len(curve.turns)
    for index in (len(curve) // 2, len(curve) - 1):
        orbit = curve.orbit(index)
        rate = motion(photothermal(float(curve.level[index])), orbit.omega, 0.0, 0.0)
        start = state(orbit, 1)
        end = after(rate, start, orbit.period)
        assert np.abs(end - start).max() < CLOSED * np.abs(start).max()
        exact = multipliers(rate, start, orbit.period)
        assert exact[0] == pytest.approx(1.0, abs=DIFFERENCES)  # along the motion
        assert curve.multipliers[index][:3] == pytest.approx(exact, abs=DIFFERENCES)


def test_van_der_pol_has_its_frequency_and_amplitude():
    """q'' - mu (1 - q^2) q' + q = 0; Andersen and Geer 1982, doi:10.1137/0142047: frequency 1 -
    mu^2/16 + 17 mu^4/3072 + 35 mu^6/884736, amplitude 2 + mu^2/96 - ...
    """
    system = ModalSystem(
        mass=[2.0],
        stiffness=[2.0],
        damping=[0.2],
        cubic_damping=[[[[1.0]]]],  # 2 D q^2 q'
    )
    parameter = {"damping": [[-2.0]]}
    (point,) = rest_states(system, (0.0, 2.0), parameter).special_points
    curve = limit_cycles(system, point, (0.0, 2.0), parameter, at=[1.1])
    assert curve.stable[1:].all()
    mu = curve.level - 0.1  # over the mass, as the factor of q^2 q' is 1
    small = (mu > 0.05) & (mu < 0.5)
    series = 1 - mu**2 / 16 + 17 * mu**4 / 3072 + 35 * mu**6 / 884736
    assert curve.omega[small] == pytest.approx(series[small], abs=1e-5 * mu[small].max())
    # q = sqrt(mu) x has the amplitude of x, for which both factors are mu
    amplitude = 2 + mu**2 / 96
    assert curve.amplitude[small, 0] / np.sqrt(mu[small]) == pytest.approx(
        amplitude[small], rel=1e-4
    )
    # its period at mu = 1, to all digits of time integration
    (index,) = np.flatnonzero(np.abs(mu - 1) < 1e-12)
    assert curve.orbit(index).period == pytest.approx(6.663286859323, rel=1e-9)


def oscillator_with_companion(companion: float, coupling: float = 0.0) -> ModalSystem:
    """A van der Pol oscillator, whose damping falls with the parameter, and a mode at rest."""
    loss = np.zeros((2, 2, 2, 2))
    loss[0, 0, 0, 0] = loss[1, 1, 1, 1] = 1.0
    quadratic = np.zeros((2, 2, 2))  # of the potential coupling q_0 q_1^2
    quadratic[0, 1, 1] = coupling
    quadratic[1, 0, 1] = quadratic[1, 1, 0] = coupling
    return ModalSystem(
        stiffness=[1.0, companion**2],
        damping=[0.1, 0.3],
        quadratic=quadratic,
        cubic_damping=loss,
    )


def test_limit_cycle_becomes_a_torus_where_its_companion_loses_its_damping():
    system = oscillator_with_companion(1.7)
    point = rest_states(system, (0.0, 0.5), {"damping": -np.eye(2)}).special_points[0]
    assert point.level == pytest.approx(0.1, rel=LOCATED)
    curve = limit_cycles(system, point, (0.0, 0.5), {"damping": -np.eye(2)})
    ((index, code),) = curve.critical
    assert code == "NS" and curve.level[index] == pytest.approx(0.3, rel=1e-7)
    assert curve.stable[1:index].all() and not curve.stable[index + 1 :].any()


def test_limit_cycle_doubles_its_period_where_its_companion_is_pumped():
    """The companion's equation is one of Mathieu's kind, with the motion as its pump."""
    change = {"damping": np.diag([-1.0, 0.0])}
    system = oscillator_with_companion(0.5, 0.5)
    point = rest_states(system, (0.0, 0.5), change).special_points[0]
    curve = limit_cycles(system, point, (0.0, 0.5), change)
    (index, code), *_ = curve.critical
    assert code == "PD" and 0.1 < curve.level[index] < 0.5
    at_point = ModalSystem(
        stiffness=system.stiffness,
        damping=system.damping + curve.level[index] * change["damping"],
        quadratic=system.quadratic,
        cubic_damping=system.cubic_damping,
    )
    orbit = curve.orbit(index)
    rate = motion(at_point, orbit.omega, 0.0, 0.0)
    exact = multipliers(rate, state(orbit, 2), orbit.period)
    assert np.abs(exact + 1).min() < DIFFERENCES


def test_buckling_and_snapping_are_told_from_oscillation():
    arch = ModalSystem(
        stiffness=[1.0],
        damping=[0.1],
        quadratic=[[[-1.5]]],
        cubic=[[[[0.5]]]],
        drives=[Drive(0, direct=[1.0])],
    )
    found = rest_states(arch, (0.0, 0.5))
    q = 1 - 1 / np.sqrt(3)  # q - 1.5 q^2 + 0.5 q^3 is largest there
    (point,) = found.special_points
    assert (point.type, point.omega) == ("LP", 0.0)
    assert point.level == pytest.approx(q - 1.5 * q**2 + 0.5 * q**3, rel=LOCATED)
    assert point.state == pytest.approx([q], rel=1e-5)
    straight = ModalSystem(stiffness=[1.0], damping=[0.1], cubic=[[[[0.5]]]])
    (point,) = rest_states(straight, (0.0, 2.0), {"stiffness": [[-1.0]]}).special_points
    assert (point.type, point.level) == ("BP", pytest.approx(1.0, abs=LOCATED))
    with pytest.raises(ContinuationError, match='found type .BP.; allowed "HB"'):
        limit_cycles(straight, point, (0.0, 2.0), {"stiffness": [[-1.0]]})


def test_a_heated_film_leaves_its_place_before_it_oscillates():
    """A constant power moves the state at rest; the Hopf point is that about the new place."""
    states = FirstOrder(RELAXATION, squares=[[[-0.5]]], force=[[1.0]])
    system = photothermal(0.0, states=states, drives=[Drive(0, direct=[1.0])])
    found = rest_states(system, (0.0, 3.0))
    (point,) = found.special_points
    q, heat = point.state
    assert heat == pytest.approx(-0.5 * q**2 / RELAXATION, rel=LOCATED)
    assert point.level == pytest.approx(q + 0.5 * q**3 - heat, rel=LOCATED)
    stiffness, feed = 1 + 1.5 * q**2, -q
    roots = np.roots(
        [
            1,
            DAMPING + RELAXATION,
            stiffness + DAMPING * RELAXATION,
            stiffness * RELAXATION - feed,
        ]
    )
    assert np.abs(roots.real).min() < LOCATED
    curve = limit_cycles(system, point, (0.0, 1.5 * point.level))
    orbit = curve.orbit(-1)
    driven = photothermal(0.0, states=states, drives=[Drive(0, direct=[float(curve.level[-1])])])
    start = state(orbit, 1)
    end = after(motion(driven, 1.0, 1.0, 0.0), start, orbit.period)
    assert np.abs(end - start).max() < CLOSED * np.abs(start).max()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: rest_states(s, (1.0, 0.0)), "level: found"),
        (lambda s: rest_states(s, (0.0, 1.0), "mass"), "parameter: found 'mass'"),
        (lambda s: rest_states(s, (0.0, 1.0), s, direct=1.0), "drives: found one that oscillates"),
        (
            lambda s: rest_states(s, (0.0, 1.0), ModalSystem(stiffness=[1.0] * 2, damping=1.0)),
            "parameter: damping of shape",
        ),
        (
            lambda s: limit_cycles(
                s, RestPoint("HB", 5.0, 1.0, np.zeros(1), np.ones(1)), (0.0, 1.0)
            ),
            "level: range",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(call, message):
    system = ModalSystem(stiffness=[1.0], damping=[0.1], direct=[1.0])
    with pytest.raises(ContinuationError, match=message):
        call(system)


def test_a_driven_self_excited_film_has_its_torus_bifurcations():
    """The drive captures the oscillation of the photothermal film, or it does not: at NS points."""
    diagram = explore(photothermal(0.5, direct=[1.0]), (0.9, 1.3), 0.02, depth=0)
    assert diagram.points("NS") and diagram.branches[0].stable.any()
    assert not diagram.branches[0].stable.all()
