"""Systems with symmetry: pairs of equal frequency, identical oscillators, rings, rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import Branch, Diagram, ModalSystem, explore
from nanorom.continuation.diagrams import explore as exploring
from nanorom.continuation.orbits.coordinates import generators, sign_symmetries, with_symmetries

SAME = 1e-8  # relative: places that a symmetry makes equal
INTEGRATED = 1e-8  # of an orbit, after a period of time integration


def isotropic(size: int = 2) -> np.ndarray:
    """The cubic force |q|^2 q."""
    cubic = np.zeros((size,) * 4)
    for r in range(size):
        for j in range(size):
            for place in ((r, r, j, j), (r, j, r, j), (r, j, j, r)):
                cubic[place] += 1 / 3
    return cubic


def springs(size: int) -> np.ndarray:
    """The cubic force q_r^3."""
    cubic = np.zeros((size,) * 4)
    cubic[(np.arange(size),) * 4] = 1.0
    return cubic


def pair(split: float = 0.0, angle: float = 0.0) -> ModalSystem:
    return ModalSystem(
        damping=0.01,
        stiffness=[1.0, 1.0 + split],
        cubic=isotropic(),
        direct=[np.cos(angle), np.sin(angle)],
        parametric=np.eye(2),
    )


def coupled(size: int, coupling: float) -> ModalSystem:
    """Identical oscillators on a line (two) or a ring, driven alike."""
    stiffness = np.eye(size)
    for i in range(size if size > 2 else 1):
        ends = np.zeros(size)
        ends[i], ends[(i + 1) % size] = 1.0, -1.0
        stiffness += coupling * np.outer(ends, ends)
    return ModalSystem(damping=0.01, stiffness=stiffness, cubic=springs(size), direct=np.ones(size))


def check_orbits(system: ModalSystem, diagram: Diagram, branch: Branch) -> None:
    """Some orbits of a branch close under time integration, which knows nothing of harmonics."""
    for number in np.linspace(0, len(branch) - 1, 4).astype(int):
        orbit = branch.orbit(int(number))
        start = np.concatenate([orbit(0.0), orbit.velocity(0.0)])

        def right_side(t, y, omega=orbit.omega):
            q, v = y[: system.size], y[system.size :]
            drive = np.cos(omega * t) * (
                diagram.direct * system.direct + diagram.parametric * system.parametric @ q
            )
            force = system.stiffness @ q + system.cubic @ q @ q @ q
            return np.concatenate([v, drive - force - system.damping @ v])

        span = (0.0, orbit.period)
        end = solve_ivp(right_side, span, start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        assert np.abs(end - start).max() < INTEGRATED * max(np.abs(start).max(), 1.0)


def places(diagram: Diagram, kind: str) -> list[float]:
    return sorted(point.omega for point in diagram.points(kind))


def test_doublings_of_an_exact_pair_are_those_of_one_mode_and_lead_to_a_family():
    one = explore(
        ModalSystem(damping=0.01, stiffness=[1.0], cubic=[[[[1.0]]]], parametric=[1.0]),
        (1.9, 2.1),
        0.0,
        0.05,
    )
    for angle in (0.0, 0.3):
        system = pair(angle=angle)
        two = explore(system, (1.9, 2.1), 0.0, 0.05)
        np.testing.assert_allclose(places(two, "PD"), places(one, "PD"), rtol=SAME)
        assert [point.multiplicity for point in two.points("PD")] == [2, 2]
        assert [branch.family for branch in two.branches] == [False, True, True]
        assert [branch.wave for branch in two.branches[1:]] == ["standing", "standing"]
        for branch, alone in zip(two.branches[1:], one.branches[1:]):
            check_orbits(system, two, branch)
            assert np.linalg.norm(branch.amplitude[-1]) == pytest.approx(
                alone.amplitude[-1, 0], rel=1e-2
            )  # they end within a step of the same frequency
        assert not two.unexplored


@pytest.mark.parametrize("split", [1e-9, 1e-8, 1e-7, 1e-6, 1e-5])
def test_doublings_of_a_nearly_equal_pair_are_all_told(split):
    diagram = explore(pair(split), (1.9, 2.1), 0.0, 0.05, depth=0)
    assert sum(point.multiplicity for point in diagram.points("PD")) == 4


def test_what_a_drive_at_any_angle_leads_to_is_the_same_turned():
    reference = explore(pair(), (0.9, 1.3), 0.02)
    assert "travelling" in [branch.wave for branch in reference.branches]
    for angle in np.radians([10, 30, 45, 90, 123]):
        system = pair(angle=angle)
        diagram = explore(system, (0.9, 1.3), 0.02)
        assert len(diagram.branches) == len(reference.branches)
        for kind in ("LP", "BP", "NS", "PD"):
            np.testing.assert_allclose(places(diagram, kind), places(reference, kind), rtol=SAME)
        check_orbits(system, diagram, diagram.branches[-1])


def test_identical_oscillators_part_at_both_branch_points():
    system = coupled(2, 0.02)
    diagram = explore(system, (0.9, 1.6), 0.02)
    np.testing.assert_allclose(places(diagram, "BP"), [1.062660650, 1.101259296], rtol=SAME)
    (branch,) = [branch for branch in diagram.branches if branch.origin is not None]
    ends = [branch.omega[0], branch.omega[-1]]
    np.testing.assert_allclose(sorted(ends), places(diagram, "BP"), rtol=1e-3)
    check_orbits(system, diagram, branch)
    assert not diagram.unexplored


def test_a_branch_that_crosses_inside_the_support_is_the_one_found_by_signs(monkeypatch):
    """Normal coordinates turn the exchange of two oscillators into a sign; without them the null
    vector lies among the parent's unknowns, and another way leads to the same branch.
    """
    system = coupled(2, 0.02)
    by_signs = explore(system, (0.9, 1.6), 0.02)
    monkeypatch.setattr(exploring, "with_symmetries", lambda scaled: scaled)
    inside = explore(system, (0.9, 1.6), 0.02)
    assert len(inside.branches) == len(by_signs.branches) == 2
    for kind in ("LP", "BP", "NS", "PD"):
        np.testing.assert_allclose(places(inside, kind), places(by_signs, kind), rtol=SAME)


def test_a_ring_of_three_parts_along_its_axes():
    system = coupled(3, 0.03)
    diagram = explore(system, (0.9, 1.6), 0.02)
    assert [point.multiplicity for point in diagram.points("BP", 0)] == [2, 2]
    ones = [branch for branch in diagram.branches if branch.origin is not None]
    assert len(ones) == 2  # the bifurcation is transcritical: one on either side
    for branch in ones:
        check_orbits(system, diagram, branch)


def test_coordinates_show_symmetries_that_the_given_ones_hide():
    random = np.random.default_rng(5)
    for size in (2, 3, 4):
        plain = coupled(size, 0.05).scaled(0.02)
        assert sign_symmetries(with_symmetries(plain)) > sign_symmetries(plain)
    turn = np.linalg.qr(random.standard_normal((2, 2)))[0]
    drive = turn @ [1.0, 0.0]
    turned = ModalSystem(damping=0.01, stiffness=np.eye(2), cubic=isotropic(), direct=drive)
    assert sign_symmetries(with_symmetries(turned.scaled(0.1))) == 2
    assert with_symmetries(pair().scaled(0.1)).shapes is None


def test_rotations_are_found_where_there_are_any():
    free = pair().scaled(0.0, 0.1)
    assert len(generators(free)) == 1
    assert not generators(pair().scaled(0.1, 0.1))
    square = ModalSystem(damping=0.01, stiffness=np.eye(2), cubic=springs(2), parametric=np.eye(2))
    assert not generators(square.scaled(0.0, 0.1))
    four = ModalSystem(
        damping=0.01,
        stiffness=[1.0, 1.0, 2.5, 2.5],
        cubic=isotropic(4),
        parametric=np.eye(4),
    )
    assert len(generators(four.scaled(0.0, 0.1))) == 2
