"""Coefficients of orbits that are next to zero are no unknowns, and nothing told depends on it."""

from __future__ import annotations

import gc
import tracemalloc
import weakref

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore
from nanorom.continuation.branches import trace
from nanorom.continuation.branches.start import first_orbit, fixed_rate
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.curves.locus import locus
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.harmonics import full_support
from nanorom.continuation.orbits.pairs import moving_modes
from nanorom.continuation.points import critical
from nanorom.continuation.settings import Settings
from tests.continuation.systems import duffing, random_potential

SAME = 1e-9  # of a frequency: special points with all unknowns and with fewer
ROUND_OFF = 1e-13
AS_LARGE = 3.0  # times the series of a step: what is kept of one
COARSE = 1e-6  # tolerance of orbits at which much is left out
SEEDS = (1, 2, 3)
LITTLE_MORE = 1.5  # of the steps
NEVER, ALWAYS = 10**9, 1  # unknowns from which on some are left out


def _orbit(size: int, seed: int) -> tuple[Tracer, HarmonicBalance, np.ndarray, float]:
    system = random_potential(size, seed, quality=50.0).scaled(0.05, 0.02)
    tracer = Tracer(system, full_support(system, 1), 1, Settings(tolerance=COARSE))
    orbit, balance = tracer.solve(first_orbit(tracer, 1.4), fixed_rate)
    return tracer, balance, balance.basis.compress(orbit.coefficients), orbit.rate


@pytest.mark.parametrize("seed", SEEDS)
def test_the_jacobian_of_some_unknowns_is_part_of_the_whole(seed: int) -> None:
    _, balance, x, rate = _orbit(4, seed)
    random = np.random.default_rng(seed)
    taken = random.random((balance.basis.harmonics + 1, balance.size)) < 0.6
    less = balance.only(taken[balance.basis.number])
    whole = balance.jacobian_t(x, rate)
    chosen = less.basis.unknowns
    assert chosen is not None and 0 < less.basis.size < balance.basis.size
    part = whole[np.ix_(chosen, chosen)]
    np.testing.assert_allclose(less.jacobian_t(x, rate), part, atol=ROUND_OFF * np.abs(whole).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_left_out_is_expected_to_within_a_small_factor(seed: int) -> None:
    _, balance, x, rate = _orbit(4, seed)
    sizes = np.maximum(np.abs(x), np.abs(x)[balance.basis.derivative_row])
    small = (sizes < 1e-3 * sizes.max()) & (sizes > 1e-5 * sizes.max())
    without = np.where(small, 0.0, x)
    expected = balance.expected(without, rate, balance.residual(without, rate))
    assert small.any()
    ratio = expected[small] / sizes[small]
    assert 0.1 < ratio.min() and ratio.max() < 10


def _points(system: ModalSystem, window: tuple[float, float]) -> list[tuple[str, float]]:
    found = explore(system, window, 0.05, 0.1, tolerance=COARSE).special_points
    return sorted((point.type, point.omega) for point in found)


@pytest.mark.parametrize("seed", SEEDS[:2])
def test_special_points_are_the_same_without_small_coefficients(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = random_potential(3, seed, quality=50.0)
    found = []
    for many in (NEVER, ALWAYS):
        monkeypatch.setattr(trace, "MANY_UNKNOWNS", many)
        found.append(_points(system, (0.9, 1.6)))
    whole, less = found
    assert whole and [code for code, _ in less] == [code for code, _ in whole]
    np.testing.assert_allclose([w for _, w in less], [w for _, w in whole], rtol=SAME)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("quality", [50.0, 1e6])
def test_steps_are_as_long_without_small_coefficients(
    quality: float, tolerance: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = random_potential(4, 1, quality=quality).scaled(2.5 / quality, 0.0)
    counts = []
    for many in (NEVER, ALWAYS):
        monkeypatch.setattr(trace, "MANY_UNKNOWNS", many)
        settings = Settings(tolerance=tolerance, series=tolerance)
        tracer = Tracer(system, full_support(system, 1), 1, settings)
        orbit = first_orbit(tracer, 0.9)
        counts.append(sum(1 for _ in tracer.follow(orbit, 1.0, (0.9, 1.3))))
        assert tracer.ending == "range"
    assert counts[1] <= LITTLE_MORE * counts[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_first_orbits_are_the_same_without_small_coefficients(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trace, "MANY_UNKNOWNS", NEVER)
    whole = _orbit(4, seed)[2]
    monkeypatch.setattr(trace, "MANY_UNKNOWNS", ALWAYS)
    less = _orbit(4, seed)[2]
    assert less.shape == whole.shape
    np.testing.assert_allclose(less, whole, atol=COARSE * np.abs(whole).max())


def test_curves_of_folds_are_the_same_without_small_coefficients(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    system = random_potential(3, 1, quality=50.0)
    fold = explore(system, (0.9, 1.6), 0.05).points("LP")[0]
    given = (system, fold, 0.05, 0.0)
    curves = []
    for many in (NEVER, ALWAYS):
        monkeypatch.setattr(critical, "MANY_UNKNOWNS", many)
        curves.append(
            locus(*given, omega=(0.8, 3.0), level=(0.04, 0.08), at=(0.07,), tolerance=COARSE)
        )
    at = [curve.omega[np.abs(curve.level - 0.07) < ROUND_OFF] for curve in curves]
    assert len(at[0]) > 0
    np.testing.assert_allclose(at[1], at[0], rtol=COARSE)


def test_what_is_known_of_a_system_lets_it_go() -> None:
    system = random_potential(3, 1).scaled(0.1, 0.0)
    moving_modes(system, np.arange(3))
    Tracer(system, full_support(system, 1), 1, Settings()).balance(3)
    gone = weakref.ref(system)
    del system
    gc.collect()
    assert gone() is None


def test_a_branch_keeps_no_matrices_of_its_points() -> None:
    """Of forty modes these are a hundred times as large as the branch itself."""
    size = 12
    system = random_potential(size, 1, quality=50.0).scaled(0.05, 0.0)
    tracer = Tracer(system, full_support(system, 1), 1, Settings(tolerance=COARSE))
    orbit = first_orbit(tracer, 0.9)
    tracemalloc.start()
    try:
        kept, sizes = [], []
        for step in tracer.follow(orbit, 1.0, (0.9, 1.3)):
            kept.append(step)
            sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    own = max(step.coefficients.nbytes for step in kept)
    half = len(sizes) // 2
    assert half > 4
    assert (sizes[-1] - sizes[half]) / (len(sizes) - half) < AS_LARGE * own


def test_levels_of_a_system_share_its_tensors() -> None:
    system = duffing()
    one, two = system.scaled(0.1, 0.0), system.scaled(0.3, 0.2)
    assert one.cubic is two.cubic
    alone = duffing().scaled(0.3, 0.2)
    np.testing.assert_array_equal(two.force, alone.force)
    np.testing.assert_array_equal(two.parametric, alone.parametric)
