"""Diagrams do not depend on units; bad input is met with one clear line."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import (
    ModalSystem,
    backbone,
    explore,
    explore_levels,
    locus,
    states,
    sweep,
)
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing

SAME = 1e-10


@pytest.mark.parametrize(
    ("omega", "direct", "parametric"),
    [((0.8, 1.5), 0.005, 0.0), ((0.5, 2.0), 0.02, 0.0), ((0.6, 3.0), 0.05, 0.1)],
)
@pytest.mark.parametrize("hertz", [1.0, 7.7e7, 1e8])
@pytest.mark.parametrize("metre", [1.0, 1e-9])
def test_duffing_diagram_is_the_same_in_all_units(hertz, metre, omega, direct, parametric) -> None:
    """All of it: round-off may not even move a point along its branch."""
    rate, mass = 2 * np.pi * hertz, 3e-17
    physical = ModalSystem(
        mass=[mass],
        damping=[mass * rate / 180],
        stiffness=[mass * rate**2],
        cubic=[[[[mass * rate**2 / metre**2]]]],
        direct=[mass * rate**2 * metre],
        parametric=[mass * rate**2],
    )
    plain = explore(duffing(), omega, direct, parametric)
    other = explore(physical, (omega[0] * rate, omega[1] * rate), direct, parametric)
    assert len(plain.branches) == len(other.branches)
    for one, two in zip(plain.branches, other.branches):
        np.testing.assert_allclose(two.omega / rate, one.omega, rtol=SAME)
        np.testing.assert_allclose(two.amplitude / metre, one.amplitude, rtol=SAME)
        np.testing.assert_allclose(two.multipliers, one.multipliers, atol=SAME)
    assert [p.type for p in plain.special_points] == [p.type for p in other.special_points]
    for a, b in zip(plain.special_points, other.special_points):
        assert abs(b.omega / rate - a.omega) < SAME


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stiffness": [np.nan]}, "stiffness.*NaN"),
        ({"cubic": [[[[np.nan]]]]}, "cubic.*NaN"),
        ({"stiffness": [-1.0]}, "natural frequency"),
        ({"stiffness": [0.0]}, "natural frequency"),
        ({"damping": [0.0]}, "damping.*zero or negative"),
        ({"damping": [-0.1]}, "damping.*zero or negative"),
        ({"damping": None}, "damping.*missing"),
        ({"mass": [0.0]}, "mass.*positive"),
        ({"direct": [1.0, 2.0]}, "direct.*shape"),
        ({"cubic": [1.0]}, "cubic.*shape"),
        ({"quadratic": "x"}, "quadratic.*real numbers"),
        ({"stiffness": [], "damping": []}, "stiffness: no mode"),
    ],
)
def test_bad_system_is_refused_with_a_clear_message(changes, message) -> None:
    with pytest.raises(ContinuationError, match=message):
        duffing(**changes)


@pytest.mark.parametrize("omega", [(0.0, 1.0), (-1.0, 1.0), (1.5, 0.8), (np.nan, 1.0), (1.0,), 1.0])
def test_bad_range_is_refused(omega) -> None:
    with pytest.raises(ContinuationError, match="omega"):
        explore(duffing(), omega, direct=0.005)


@pytest.mark.parametrize(
    "option",
    [{"harmonics": 1}, {"tolerance": 0}, {"reach": 0.0}, {"steps": 0}, {"depth": -1}],
    ids=lambda option: next(iter(option)),
)
def test_bad_options_are_refused(option) -> None:
    with pytest.raises(ContinuationError, match=f"{next(iter(option))}: found .* expected"):
        explore(duffing(), (0.8, 1.5), direct=0.005, **option)


def test_linear_system_has_a_tongue_but_no_branch_in_it() -> None:
    """Mathieu: above the threshold the motion grows without bound at one frequency."""
    diagram = explore(duffing(cubic=None), (1.8, 2.2), direct=0.1, parametric=0.1)
    assert [point.type for point in diagram.special_points] == ["PD", "PD"]
    assert len(diagram.branches) == 1


def test_start_that_cannot_be_reached_is_told_with_a_remedy() -> None:
    with pytest.raises(ContinuationError, match="no periodic orbit.*start the range farther"):
        explore(duffing(), (0.99, 1.01), direct=1e9)


def test_undamped_system_has_a_backbone_but_no_response() -> None:
    system = duffing(damping=0.0, damped=False)
    assert backbone(system, amplitude=0.1).omega[-1] > 1.0
    for follow in (explore, lambda *a, **k: list(states(*a, **k))):
        with pytest.raises(ContinuationError, match="damping.*zero or negative"):
            follow(system, (0.8, 1.5), direct=0.005)


def test_bad_levels_and_frequencies_are_refused() -> None:
    with pytest.raises(ContinuationError, match="omega"):
        backbone(duffing(), omega=(0.0, 1.0))
    with pytest.raises(ContinuationError, match="omega"):
        sweep(duffing(), [1.0, 0.0], direct=0.005)
    fold = explore(duffing(), (0.8, 1.5), direct=0.005).points("LP")[0]
    with pytest.raises(ContinuationError, match="level: range"):
        locus(duffing(), fold, 0.005, 0.0, omega=(0.8, 1.5), level=(0.006, 0.01))
    for level in (np.nan, "a"):
        with pytest.raises(ContinuationError, match="direct"):
            explore(duffing(), (0.8, 1.5), direct=level)
    with pytest.raises(ContinuationError, match="levels: give pairs"):
        explore_levels(duffing(), (0.8, 1.5), [0.1])
    with pytest.raises(ContinuationError, match="state: give"):
        sweep(duffing(), [1.0], direct=0.005, state=np.zeros(3))
