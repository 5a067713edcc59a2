"""Systems that once found faults: symmetry classes, dense tensors, strong drive."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from nanorom.continuation import (
    Branch,
    ModalSystem,
    PeriodicOrbit,
    SpecialPoint,
    explore,
)
from nanorom.continuation.orbits.bifurcations import BRANCHING, TORUS
from nanorom.continuation.points.samples import _may_meet

FEW_POINTS = 100  # a loop of some ten series steps; one of tiny steps has a thousand and more
AT_A_POINT = 1e-6  # of the circle: a point of the branch that is a special point


def two_classes() -> ModalSystem:
    """A driven mode and one of another symmetry class, which moves from its instability on."""
    vectors = np.array([[1.0, 0.0], [0.0, 1.2], [0.6, 0.8], [0.6, -0.8]])
    cubic = np.einsum("mi,mj,mk,ml->ijkl", vectors, vectors, vectors, vectors)
    cubic[np.abs(cubic) < 1e-12] = 0.0  # exactly even in the second mode
    frequencies = np.array([1.0, 1.7])
    return ModalSystem(
        damping=frequencies / 100,
        stiffness=frequencies**2,
        cubic=cubic,
        direct=[1.0, 0.0],
        parametric=[0.2, 1.0],
    )


def test_doubled_branch_of_another_symmetry_class_is_followed_in_few_steps() -> None:
    diagram = explore(two_classes(), (3.0, 3.8), direct=0.05, parametric=0.12)
    one, two = diagram.points("PD", branch=0)
    (doubled,) = (b for b in diagram.branches if b.period_multiple == 2)
    assert doubled.ending == "bifurcation"
    assert {round(w, 6) for w in doubled.omega[[0, -1]]} == {round(p.omega, 6) for p in (one, two)}
    assert len(doubled) < FEW_POINTS


def dense(frequencies: list[float], seed: int, quality: float, quadratic: float) -> ModalSystem:
    """Dense tensors and full parametric drive; the cubic force is that of a random potential."""
    random, size = np.random.default_rng(seed), len(frequencies)
    one = random.standard_normal((2 * size, size)) / np.sqrt(size)
    cubic = np.einsum("mi,mj,mk,ml->ijkl", one, one, one, one)
    two = random.standard_normal((size, size))
    stiffness = random.standard_normal((size, size))
    return ModalSystem(
        damping=np.array(frequencies) / quality,
        stiffness=np.square(frequencies),
        quadratic=quadratic * np.einsum("mi,mj,mk->ijk", two, two, two) / size,
        cubic=cubic / cubic[0, 0, 0, 0],
        direct=np.append(1.0, random.standard_normal(size - 1)),
        parametric=(stiffness + stiffness.T) / 2,
    )


STRONG = {  # system, range, direct and parametric level
    "2:1 resonance": (dense([1, 2.02], 3, 100.0, 0.3), (0.8, 2.3), 0.02, 0.0),
    "3:1 resonance": (dense([1, 3.05], 4, 100.0, 0.0), (0.8, 3.4), 0.05, 0.0),
    "tongues": (dense([1, 1.4, 2.3], 2, 130.0, 0.0), (1.4, 2.8), 0.01, 0.06),
    "tongues and tori": (dense([1, 1.3, 2.1, 2.9], 4, 40.0, 0.2), (0.7, 2.2), 0.1, 0.1),
}


@pytest.mark.parametrize("name", STRONG)
def test_multipliers_cross_the_unit_circle_at_the_listed_points_only(name) -> None:
    """Nothing missed, nothing spurious: between two points of a branch the number of multipliers
    outside, of those real ones beyond 1 and of those beyond -1, change by what is listed between.
    """
    diagram = explore(*STRONG[name])
    assert diagram.special_points
    for number, branch in enumerate(diagram.branches):
        listed = between(branch, diagram.points(branch=number))
        for k, kinds in enumerate(listed):
            ends = branch.multipliers[k : k + 2]
            if np.abs(np.abs(ends) - 1).min() < AT_A_POINT:
                continue
            (one, two), (plus, minus, outside) = map(outside_of, ends), counts(kinds)
            assert (two[0] - one[0] - plus) % 2 == 0, (name, number, k, kinds)
            assert (two[1] - one[1] - minus) % 2 == 0, (name, number, k, kinds)
            assert abs(two[2] - one[2]) <= outside, (name, number, k, kinds)
            if not plus and not minus:
                assert (abs(two[2] - one[2]) - outside) % 4 == 0, (name, number, k, kinds)


def between(branch: Branch, points: list[SpecialPoint]) -> list[list[str]]:
    """The types of the special points between each two neighbouring points of a branch."""

    def place(orbit: PeriodicOrbit) -> np.ndarray:
        return np.concatenate([[orbit.omega], orbit(0.0), orbit.velocity(0.0)])

    places = np.array([place(branch.orbit(k)) for k in range(len(branch))])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    found: list[list[str]] = [[] for _ in steps]
    for point in points:
        away = np.linalg.norm(places - place(point.orbit), axis=1)
        found[int(np.argmin(away[:-1] + away[1:] - steps))].append(point.type)
    return found


def outside_of(multipliers: np.ndarray) -> tuple[int, int, int]:
    real = multipliers.real[np.abs(multipliers.imag) < 1e-9]
    return (real > 1).sum(), (real < -1).sum(), (np.abs(multipliers) > 1).sum()


def counts(kinds: list[str]) -> tuple[int, int, int]:
    """How many points are at 1 and at -1, and how many multipliers may cross the circle in all."""
    plus, minus = sum(kind in ("LP", "BP") for kind in kinds), kinds.count("PD")
    return plus, minus, plus + minus + 2 * kinds.count("NS")


def test_torus_point_between_real_pairs_is_not_taken_for_a_neutral_saddle() -> None:
    """Real pair outside -> complex pair crossing the circle -> real pair inside, in one step."""
    before, after = np.array([31.5, -1.3, -1.03, 0.4]) + 0j, np.array([30, -0.9, -0.98, 0.4]) + 0j
    assert not TORUS.condition.is_spurious(before, after)
    assert TORUS.condition.is_spurious(np.array([1.2, 0.9]) + 0j, np.array([1.2, 0.8]) + 0j)


def test_critical_functions_are_smooth_where_two_multipliers_meet() -> None:
    """A pair that turns real next to 1: the critical multiplier has a root's slope, its product
    none.
    """
    parameter = np.linspace(-1e-3, 1e-3, 9)
    pairs = [np.roots([1.0, -2.0 - 1e-4, 1.0 + 1e-4 + a]) for a in parameter]  # (mu - 1)^2 ...
    far = np.array([0.3 + 0.4j, 0.3 - 0.4j])
    unit = BRANCHING.condition.critical(symmetric=False)
    values = [unit(np.append(pair, far), 1.0) for pair in pairs]
    np.testing.assert_allclose(np.array(values) / values[-1], parameter / 1e-3, atol=1e-9)
    torus = TORUS.condition.critical(symmetric=False)
    growth = [torus(np.append(pair, far), 1.0) for pair in pairs]
    np.testing.assert_allclose(growth, np.log1p(1e-4 + parameter), atol=1e-9)


def test_both_halves_of_a_branch_that_crosses_its_parent_are_followed() -> None:
    """A quadratic force makes the branches off rest cross it: they leave it to either side."""
    system = ModalSystem(
        damping=0.02, stiffness=1.0, quadratic=[[[0.6]]], cubic=[[[[1.0]]]], parametric=[1.0]
    )
    diagram = explore(system, (0.8, 1.2), parametric=0.35)
    ends = sorted(point.omega for point in diagram.points("BP", branch=0))
    assert len(ends) == 2
    small, large = sorted(diagram.branches[1:], key=lambda branch: branch.amplitude.max())
    assert large.amplitude.max() > 5 * small.amplitude.max()
    for branch in (small, large):
        assert branch.ending == "bifurcation"
        np.testing.assert_allclose(sorted(branch.omega[[0, -1]]), ends, rtol=1e-4)


def two_to_one(seed: int) -> ModalSystem:
    """Near a 2:1 resonance, with a potential that neither hardens nor softens throughout."""
    random, frequencies = np.random.default_rng([977, seed]), np.array([1.0, 2.01])
    vectors = random.laplace(size=(6, 2)) / np.sqrt(6)
    signs = np.where(random.random(6) < 0.7, 1.0, -1.0)
    cubic = np.einsum("m,mi,mj,mk,ml->ijkl", signs, *[vectors] * 4)
    for i in range(2):
        cubic[i, i, i, i] = abs(cubic[i, i, i, i]) * (1 if random.random() < 0.7 else -1) + 0.05
    others = random.laplace(size=(4, 2)) / 2
    stiffness = random.uniform(-1, 1, (2, 2))
    stiffness = (stiffness + stiffness.T) / 2
    stiffness[0, 0] = 1.0
    force = random.uniform(-1, 1, 2)
    force[0] = 1.0
    return ModalSystem(
        damping=frequencies / (80 * random.uniform(0.5, 1.5, 2)),
        stiffness=frequencies**2,
        quadratic=0.4 * np.einsum("mi,mj,mk->ijk", *[others] * 3),
        cubic=cubic / abs(cubic[0, 0, 0, 0]),
        direct=force,
        parametric=stiffness,
    )


def test_doubled_branches_go_all_the_way_from_one_period_doubling_to_the_other() -> None:
    """Each once: Newton's method from beside a bifurcation may end elsewhere on a branch."""
    diagram = explore(two_to_one(11), (0.8, 2.4), direct=0.015, parametric=0.01)
    flips = [p.omega for p in diagram.points("PD") if p.period_multiple == 1]
    doubled = [b for b in diagram.branches if b.period_multiple == 2]
    assert len(flips) == 6 and len(doubled) == 3
    ends = np.sort([b.omega[[0, -1]] for b in doubled], axis=None)
    np.testing.assert_allclose(ends, np.sort(flips), atol=1e-5)


def softening() -> ModalSystem:
    """Two modes close together and a third; derivatives of the potential by their indices."""
    quadratic = "000 -12 001 -5 002 6 011 29 012 -15 022 3 111 -107 112 47 122 -16 222 7"
    cubic = (
        "0000 -100 0001 13 0002 -9 0011 -11 0012 -2 0022 -5 0111 23 0112 1 0122 3 0222 1 "
        "1111 -75 1112 1 1122 -5 1222 -2 2222 -1"
    )
    tensors = []
    for text in (quadratic, cubic):
        items = text.split()
        tensor = np.zeros((3,) * len(items[0]))
        for indices, hundredths in zip(items[::2], items[1::2]):
            for order in permutations(int(i) for i in indices):
                tensor[order] = int(hundredths) / 100
        tensors.append(tensor)
    return ModalSystem(
        damping=[0.0033, 0.0034, 0.0063],
        stiffness=[1.0, 1.07, 3.58],
        quadratic=tensors[0],
        cubic=tensors[1],
        direct=[1.0, -0.44, -0.6],
        parametric=[1.0, 2.28, -1.3],
    )


def test_branch_that_passes_by_a_bifurcation_is_not_taken_for_the_one_that_begins_there() -> None:
    """A closed loop of doubled orbits comes near a period doubling whose own orbits are small."""
    diagram = explore(softening(), (1.5, 2.6), direct=0.0047, parametric=0.036)
    flips = [p.omega for p in diagram.points("PD", branch=0)]
    doubled = [b for b in diagram.branches if b.period_multiple == 2]
    assert len(flips) == 4 and [b.ending for b in doubled] == ["bifurcation"] * 2
    ends = np.sort([b.omega[[0, -1]] for b in doubled], axis=None)
    np.testing.assert_allclose(ends, np.sort(flips), atol=1e-5)


@pytest.mark.parametrize(("drive", "quadratic"), [(0.06, -0.4), (0.05, 0.4)])
def test_fold_and_period_doubling_where_multipliers_rush_by_are_found(drive, quadratic) -> None:
    """At the lowest frequency of a doubled branch, a multiplier falls from some ten to minus some
    ten: through 1 at a fold and, five digits of the frequency later, through -1.
    """
    system = ModalSystem(
        damping=0.005,
        stiffness=1.0,
        quadratic=[[[quadratic]]],
        cubic=[[[[-1.0]]]],
        direct=[1.0],
        parametric=[1.0],
    )
    diagram = explore(system, (1.5, 2.5), direct=0.001, parametric=drive)
    doubled = [b.period_multiple for b in diagram.branches].index(2)
    (fold,) = diagram.points("LP", doubled)
    assert fold.omega == pytest.approx(diagram.branches[doubled].omega.min(), rel=1e-3)
    assert min(abs(p.omega - fold.omega) for p in diagram.points("PD", doubled)) < 1e-4


def test_doubled_branch_ends_at_orbits_of_half_the_period_that_are_not_its_parent() -> None:
    """Rest is the parent; the branches lead to motions of the period of the drive, not past them
    and back.
    """
    cubic, quadratic = np.zeros((2,) * 4), np.zeros((2,) * 3)
    quadratic[1, 1, 1] = -0.01
    for indices, value in {
        "0000": -1.0,
        "0001": 0.89,
        "0011": -0.83,
        "0111": 0.81,
        "1111": -0.83,
    }.items():
        for order in permutations(int(i) for i in indices):
            cubic[order] = value
    system = ModalSystem(
        damping=[0.0173, 0.0179],
        stiffness=[1.0, 1.07],
        quadratic=quadratic,
        cubic=cubic,
        parametric=[1.0, -1.2],
    )
    diagram = explore(system, (2.05, 2.3), parametric=0.233)
    for branch in diagram.branches[1:]:
        assert branch.period_multiple == 2 and branch.ending == "bifurcation"
        first, last = (branch.coefficients[k] for k in (0, -1))
        numbers = (np.arange(len(last)) + 1) // 2
        assert np.abs(last[numbers % 2 == 1]).max() < 1e-3 * np.abs(last).max()
        assert np.abs(last).max() > 100 * np.abs(first).max()  # not rest
    assert len({(p.type, round(p.omega, 8)) for p in diagram.special_points}) == 7


def test_eigenvalues_that_change_places_may_have_left_the_circle() -> None:
    """Two samples of the same set of eigenvalues: only how fast they turn tells that they met."""
    pair = 0.99 * np.exp(1j * np.array([1.0, 1.03]))
    far = 0.3 * np.exp(1j * np.array([0.2, 2.0]))
    values = np.concatenate([pair, pair.conj(), far, far.conj()])[None]
    assert _may_meet(values, values, np.array([0.05]), np.triu_indices(8, 1)).all()
    assert not _may_meet(
        values, values, np.array([0.005]), np.triu_indices(8, 1)
    ).any()  # too slow to leave the circle
    calm = np.where(np.abs(values) > 0.5, 0.7 * values, values)
    assert not _may_meet(calm, calm, np.array([0.05]), np.triu_indices(8, 1)).any()
