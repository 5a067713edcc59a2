"""Curves of special points against slow flows, and against diagrams of other levels and systems."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore, locus
from tests.continuation.systems import duffing, from_monomials

QUALITY = 180.0
CURVE = 1e-9
LEVELS = (0.95, 1.1)  # by that of the point


def test_parametric_tongue_opens_at_two_over_quality() -> None:
    """Damped Mathieu equation near 2 omega_0: threshold gamma = 2/Q to leading order in 1/Q."""
    system = duffing(QUALITY)
    diagram = explore(system, (1.9, 2.1), parametric=0.013, depth=0)
    (one, two) = diagram.points("PD")
    curve = locus(
        system, one, 0.0, 0.013, omega=(1.9, 2.1), level=(1e-3, 0.03), parameter="parametric"
    )
    assert curve.level.min() == pytest.approx(2 / QUALITY, rel=1e-3)
    # the curve goes round the bottom of the tongue to the other period doubling
    gaps = np.hypot(curve.omega - two.omega, curve.level - 0.013)
    assert gaps.min() < 5e-3


def test_cusp_of_the_duffing_folds() -> None:
    """Slow flow: F^2 = 8 delta^3 / (3 sqrt(3) kappa), F = beta/2, delta = 1/(2Q), kappa = 3/8."""
    system = duffing(QUALITY)
    fold = explore(system, (0.8, 1.5), direct=0.005).points("LP")[0]
    curve = locus(system, fold, 0.005, 0.0, omega=(0.8, 1.4), level=(1e-4, 0.008))
    # kappa)
    expected = np.sqrt(4 * 8 / (3 * np.sqrt(3) * 3 / 8) / (2 * QUALITY) ** 3)
    assert curve.level.min() == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("kind", ["LP", "PD"])
def test_locus_meets_the_diagrams_of_other_levels(kind) -> None:
    system = from_monomials("p2")
    start = explore(system, (1.9, 2.5), direct=0.004, parametric=0.016, depth=0)
    curve = locus(
        system,
        start.points(kind)[0],
        0.004,
        0.016,
        omega=(1.9, 2.6),
        level=(0.7, 1.4),
        parameter="both",
        steps=12,
    )
    index = len(curve.omega) // 3
    factor = float(curve.level[index])
    other = explore(system, (1.9, 2.6), direct=0.004 * factor, parametric=0.016 * factor, depth=0)
    assert min(abs(p.omega - curve.omega[index]) for p in other.points(kind)) < CURVE


def test_a_curve_without_turns_passes_levels_where_one_with_them_does() -> None:
    """Newton's matrix is kept there while changes fall, and null vectors are corrected by it."""
    system = from_monomials("p2")
    fold = explore(system, (1.9, 2.5), direct=0.004, parametric=0.016, depth=0).points("LP")[0]
    crossed = []
    for turns in (True, False):
        curve = locus(
            system,
            fold,
            0.004,
            0.016,
            omega=(1.9, 2.6),
            level=(0.7, 1.4),
            parameter="both",
            steps=12,
            turns=turns,
            codimension_two=False,
            at=LEVELS,
        )
        found = [np.abs(curve.level - level) < CURVE for level in LEVELS]
        crossed.append([np.sort(curve.omega[some]) for some in found])
    assert sum(map(len, crossed[0])) > 0
    for one, two in zip(*crossed):
        assert np.abs(one - two).max(initial=0.0) < CURVE


def three_modes(damping=1.0, stiffness=1.0, cubic=0.0) -> ModalSystem:
    """Everything at once; factors on the damping and stiffness of the second mode, and an addition
    to one cubic coefficient.
    """
    random, frequencies = np.random.default_rng(5), np.array([1.0, 1.35, 2.3])
    vectors = random.standard_normal((6, 3)) / np.sqrt(3)
    tensor = np.einsum("mi,mj,mk,ml->ijkl", vectors, vectors, vectors, vectors)
    tensor /= tensor[0, 0, 0, 0]
    others, parametric = random.standard_normal((2, 3, 3))
    parametric = (parametric + parametric.T) / 2
    parametric[0, 0] = 1.0
    force = np.append(1.0, random.standard_normal(3)[1:])
    friction = 0.1 * tensor + 0.02 * random.standard_normal((3,) * 4)
    tensor[0, 0, 0, 0] += cubic
    return ModalSystem(
        damping=frequencies / 60 * [1, damping, 1],
        stiffness=frequencies**2 * [1, stiffness, 1],
        quadratic=0.2 / 3 * np.einsum("mi,mj,mk->ijk", others, others, others),
        cubic=tensor,
        direct=force,
        parametric=parametric,
        cubic_damping=friction,
    )


@pytest.mark.parametrize("kind", ["LP", "PD", "NS"])
def test_locus_of_a_system_with_nonlinear_damping_meets_other_diagrams(kind) -> None:
    system = three_modes()
    levels, omega = np.array([0.1, 0.25]), (0.9, 2.9)
    start = explore(system, omega, *levels, depth=0).points(kind)[-1]
    curve = locus(system, start, *levels, omega=omega, level=(0.5, 2.0), parameter="both", steps=6)
    index = len(curve.omega) // 3
    assert abs(curve.level[index] - 1) > 0.01
    other = explore(system, omega, *(curve.level[index] * levels), depth=0)
    apart = [abs(p.omega - curve.omega[index]) for p in other.points(kind)]
    assert min(apart) < CURVE


@pytest.mark.parametrize("kind", ["LP", "PD", "NS"])
@pytest.mark.parametrize("name", ["damping", "stiffness", "cubic"])
def test_locus_in_any_parameter_meets_the_diagram_of_the_changed_system(kind, name) -> None:
    system, omega = three_modes(), (0.9, 2.9)
    # the change of the system per unit of the argument of the same name
    changed = three_modes(**{name: 2.0 if name != "cubic" else 1.0})
    parameter = {name: getattr(changed, name) - getattr(system, name)}
    start = explore(system, omega, 0.1, 0.25, depth=0).points(kind)[-1]
    limits = {"omega": omega, "level": (-0.3, 0.3)}
    curve = locus(system, start, 0.1, 0.25, parameter=parameter, steps=8, **limits)
    level = float(curve.level[2])
    assert abs(level) > 0.01
    other = explore(three_modes(**{name: level + (name != "cubic")}), omega, 0.1, 0.25, depth=0)
    assert min(abs(p.omega - curve.omega[2]) for p in other.points(kind)) < CURVE


def test_cusps_and_tips_of_tongues_are_located() -> None:
    """A little above there are two special points, a little below there is none."""
    system = duffing(30.0)
    for kind, levels, parameter, omega in (
        ("LP", (0.03, 0.0), "direct", (0.8, 1.6)),
        ("LP", (0.03, 0.0), "damping", (0.8, 1.6)),
        ("PD", (0.0, 0.1), "parametric", (1.8, 2.2)),
    ):
        point = explore(system, omega, *levels, depth=0).points(kind)[0]
        reach = {"direct": (1e-3, 0.1), "parametric": (1e-3, 0.2), "damping": (0.5, 5.0)}
        curve = locus(
            system, point, *levels, omega=omega, level=reach[parameter], parameter=parameter
        )
        (turn,) = curve.turns
        for side, count in ((1 + 1e-6, 2), (1 - 1e-6, 0)):
            level = float(curve.level[turn]) * (2 - side if parameter == "damping" else side)
            near = duffing(30.0 / level) if parameter == "damping" else system
            there = {"direct": (level, 0.0), "parametric": (0.0, level)}.get(parameter, levels)
            diagram = explore(near, omega, *there, depth=0)
            assert len(diagram.points(kind)) == count
            for p in diagram.points(kind):
                assert p.omega == pytest.approx(curve.omega[turn], abs=1e-3)


def test_loci_of_orbits_that_broke_a_symmetry_are_followed_in_theirs() -> None:
    """Strongly driven Duffing oscillator: orbits with even harmonics, and where they begin."""
    system, omega, drive = duffing(30.0), (0.46, 0.6), 20.0
    start = explore(system, omega, drive)
    for kind, branch in (("BP", 0), ("LP", 1), ("PD", 1)):
        point = start.points(kind, branch)[-1]
        curve = locus(system, point, drive, 0.0, omega=(0.3, 0.8), level=(15.0, 25.0), steps=6)
        level, frequency = float(curve.level[2]), curve.omega[2]
        assert abs(level / drive - 1) > 1e-4
        other = explore(system, omega, level)
        assert min(abs(p.omega - frequency) for p in other.points(kind)) < CURVE
