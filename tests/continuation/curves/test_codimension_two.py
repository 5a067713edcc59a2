"""Bifurcations of codimension two: where two systems without coupling have theirs at once, where
slow flows have them, and with multipliers of an independent integration.
"""

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore, locus
from nanorom.continuation.curves.codimension_two import NAMES
from tests.continuation.independent import motion, multipliers
from tests.continuation.systems import duffing

LOSS = 0.02  # damping of modes of frequencies about 1
CRITICAL = 1e-6  # of multipliers, by an integration in time
DOUBLE = 1e-3  # of two that meet: a root of that
SLOW = 2e-3  # of frequencies, of a slow flow to its first order


def combination(second: float, **more: object) -> ModalSystem:
    """Two modes whose sum is pumped, at rest."""
    return ModalSystem(
        damping=[LOSS, LOSS],
        stiffness=[1.0, second**2],
        parametric=[[0.0, 1.0], [1.0, 0.0]],
        **more,
    )


def exact(system, omega, level, direct=0.0):
    """Multipliers at rest by time integration."""
    rate = motion(system, omega, direct, level)
    return multipliers(rate, np.zeros(2 * system.size), 2 * np.pi / omega)


@pytest.mark.parametrize(
    ("code", "second", "part", "pull"), [("R3", 2.01, 1 / 3, 2.0), ("R4", 3.01, 1 / 4, 1.0)]
)
def test_strong_resonances_are_where_a_slow_flow_has_them(code, second, part, pull):
    """Damped alike, both modes are pulled alike: (1 + d/2) / (1 + second + d) is the part."""
    system = combination(second)
    total, level = 1 + second, 3.2 * LOSS * np.sqrt(second)
    start = explore(system, (total - 0.1, total + 0.1), parametric=level, depth=0).points("NS")[0]
    span = {"omega": (total - 0.06, total + 0.06), "level": (1e-3, 2 * level)}
    curve = locus(system, start, 0.0, level, parameter="parametric", steps=40, **span)
    (point,) = [found for found in curve.codimension_two if found.type == code]
    away = pull * (second - round(second))  # d, of the mode's distance from 2 and from 3
    assert abs(point.omega - total - away) < SLOW
    found = exact(system, point.omega, point.level)
    turn = np.exp(2j * np.pi * part)
    assert np.abs(found - turn).min() < CRITICAL
    assert point.name == NAMES[code] == f"1:{round(1 / part)} resonance"
    assert curve.omega[point.index] == point.omega


@pytest.mark.parametrize("seed", range(1))
def test_two_pairs_meet_where_two_systems_have_theirs(seed):
    """Four modes in two pairs of random frequencies, each pumped at its sum; no coupling."""
    rng = np.random.default_rng(seed)
    frequencies = np.array([1.0, 1.7, 1.2, 1.5]) + 0.004 * rng.standard_normal(4)
    pump = np.zeros((4, 4))
    pump[0, 1] = pump[1, 0] = 1.0
    pump[2, 3] = pump[3, 2] = 1.0
    loss = LOSS * rng.uniform(0.8, 1.2, 4)
    system = ModalSystem(damping=loss, stiffness=frequencies**2, parametric=pump)
    start = explore(system, (2.5, 2.9), parametric=0.12, depth=0).points("NS")[0]
    span = {"omega": (2.5, 2.9), "level": (1e-3, 0.2)}
    curve = locus(system, start, 0.0, 0.12, parameter="parametric", steps=25, **span)
    points = [found for found in curve.codimension_two if found.type == "NSNS"]
    assert points
    for point in points:
        for some in (slice(0, 2), slice(2, 4)):
            alone = ModalSystem(
                damping=loss[some],
                stiffness=frequencies[some] ** 2,
                parametric=pump[some, some],
            )
            sizes = np.abs(exact(alone, point.omega, point.level))
            assert abs(sizes.max() - 1) < CRITICAL


def beside_a_fold(pump, frequencies) -> ModalSystem:
    """A forced oscillator with folds, and modes without coupling to it that are pumped."""
    size = 1 + len(frequencies)
    cubic, parametric = np.zeros((size,) * 4), np.zeros((size, size))
    cubic[0, 0, 0, 0], parametric[1:, 1:] = 1.0, pump
    return ModalSystem(
        damping=[1 / 30, *[LOSS] * len(frequencies)],
        stiffness=[1.0, *np.square(frequencies)],
        cubic=cubic,
        direct=[0.1, *[0.0] * len(frequencies)],
        parametric=parametric,
    )


@pytest.mark.parametrize(
    ("code", "pump", "frequencies"),
    [("LPNS", [[0.0, 1.0], [1.0, 0.0]], (0.5, 0.8)), ("LPPD", [[1.0]], (0.65,))],
)
def test_a_fold_meets_what_another_system_has(code, pump, frequencies):
    system = beside_a_fold(np.array(pump), frequencies)
    level = 0.5
    start = max(
        explore(system, (1.1, 1.7), direct=level, parametric=0.0, depth=0).points("LP"),
        key=lambda point: point.omega,
    )
    more = {"direct": np.array([0.1, *[0.0] * len(frequencies)])}
    more["parametric"] = system.parametric
    span = {"omega": (0.8, 2.0), "level": (-0.2, 0.6)}
    curve = locus(system, start, level, 0.0, parameter=more, steps=40, **span)
    points = [found for found in curve.codimension_two if found.type == code]
    assert points
    for point in points:
        alone = ModalSystem(
            damping=[LOSS] * len(frequencies), stiffness=np.square(frequencies), parametric=pump
        )
        sizes = exact(alone, point.omega, point.level)
        assert abs(np.abs(sizes).max() - 1) < CRITICAL
        other = explore(duffing(30.0), (0.9, 1.9), direct=0.1 * (level + point.level), depth=0)
        assert min(abs(p.omega - point.omega) for p in other.points("LP")) < CRITICAL


def test_doublings_meet_at_two_multipliers_of_minus_one():
    pump = np.random.default_rng(0).standard_normal((2, 2))
    system = ModalSystem(
        damping=[LOSS, 2 * LOSS], stiffness=[1.0, 1.02**2], parametric=pump + pump.T
    )
    start = explore(system, (1.9, 2.05), parametric=0.15, depth=0).points("PD")[0]
    span = {"omega": (1.9, 2.1), "level": (0.09, 0.2)}
    curve = locus(system, start, 0.0, 0.15, parameter="parametric", steps=30, **span)
    (point,) = [found for found in curve.codimension_two if found.type == "R2"]
    found = exact(system, point.omega, point.level)
    assert (np.sort(np.abs(found + 1))[:2] < DOUBLE).all()
    assert abs(found[np.argsort(np.abs(found + 1))[:2]].sum() + 2) < CRITICAL


def test_a_doubling_is_generalised_at_the_bottom_of_the_tongue():
    """Slow flow of the damped Mathieu-Duffing equation: at twice the frequency and at 2 / Q;
    below it doubled orbits begin stable, above it unstable.
    """
    system = duffing(20.0)
    diagram = explore(system, (1.9, 2.1), parametric=0.11)
    first, last = sorted(diagram.points("PD"), key=lambda point: point.omega)
    span = {"omega": (1.9, 2.1), "level": (0.01, 0.12)}
    curve = locus(system, first, 0.0, 0.11, parameter="parametric", steps=15, **span)
    (point,) = [found for found in curve.codimension_two if found.type == "GPD"]
    assert abs(point.omega - 2) < SLOW and abs(point.level - 0.1) < SLOW
    doubled = [branch for branch in diagram.branches if branch.period_multiple == 2]
    for end, stable in ((first, True), (last, False)):
        begins = [
            bool(branch.stable[place])
            for branch in doubled
            for place in np.flatnonzero(np.abs(branch.omega - end.omega) < 2e-3)
            if branch.amplitude[place].max() < 0.1
        ]
        assert begins and all(value == stable for value in begins)
