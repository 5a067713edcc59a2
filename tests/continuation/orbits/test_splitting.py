"""Multipliers by splitting are those of series and of an exponential."""

import numpy as np
import pytest
from scipy.linalg import expm

from nanorom.continuation.orbits.product import product
from nanorom.continuation.orbits.splitting import ORDER, Splitting
from nanorom.continuation.orbits.variation import Variation

SERIES = 1e-14  # truncation of the reference
ESTIMATE = 3.0  # what the error may be of the truncation asked for
SIZE, HARMONICS = 6, 3


def modulated(seed: int, change: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fourier coefficients of two stiffness matrices that change in time, damping, rates."""
    random = np.random.default_rng(seed)
    stiffness = change * random.standard_normal((2, 2 * HARMONICS + 1, SIZE, SIZE))
    stiffness[:, 0] = stiffness[:, 0] + stiffness[:, 0].swapaxes(1, 2)
    stiffness[:, 0] += np.diag(random.uniform(1.0, 20.0, SIZE))
    return stiffness, random.uniform(1e-3, 0.1, SIZE), random.uniform(0.7, 2.0, 2)


@pytest.mark.parametrize("truncation", [1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("seed", range(4))
def test_multipliers_by_splitting_are_as_accurate_as_asked(seed, truncation) -> None:
    stiffness, damping, rates = modulated(seed, 0.3)
    given = stiffness, None, rates, 12, False
    series = Variation(np.diag(damping), np.ones(SIZE), SERIES).propagate(*given)[0].copy()
    maps = series, Splitting(damping, truncation).propagate(*given)[0]
    expected, found = (np.linalg.eigvals(product(some)) for some in maps)
    gaps = np.abs(found[:, :, None] - expected[:, None, :]).min(axis=2)
    assert (gaps < ESTIMATE * truncation * np.maximum(np.abs(found), 1.0)).all()


def test_free_oscillations_are_exact_however_long_the_steps_and_the_damping() -> None:
    """Among them one that is overdamped and one that drifts."""
    damping, squares = np.array([0.1, 5.0, 0.3, 0.2]), np.array([1.0, 2.0, 0.0, 9.0])
    stiffness = np.zeros((1, 1, 4, 4))
    stiffness[0, 0] = np.diag(squares)
    (found,) = product(Splitting(damping, 1e-8).propagate(stiffness, None, np.ones(1), 4, True)[0])
    zero, one = np.zeros((4, 4)), np.eye(4)
    state = np.block([[zero, one], [-np.diag(squares), -np.diag(damping)]])
    np.testing.assert_allclose(found, expm(np.pi * state), atol=1e-12)


def test_errors_fall_with_the_sixth_power_of_the_steps() -> None:
    stiffness, damping, rates = modulated(0, 0.3)
    series = Variation(np.diag(damping), np.ones(SIZE), SERIES)
    expected = product(series.propagate(stiffness, None, rates, 12, False)[0].copy())
    splitting = Splitting(damping, 1e-8)
    errors = [
        np.abs(product(splitting._maps(stiffness, rates, count, False)) - expected).max()
        for count in (40, 80)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(ORDER, abs=0.7)


@pytest.mark.parametrize("needed", np.arange(3.0, 40.0, 0.23))
def test_intervals_grow_until_they_are_enough(monkeypatch, needed) -> None:
    """Also where no more than a fraction of one is lacking."""
    stiffness, damping, rates = modulated(1, 0.3)
    tried = []

    def error(self, stiffness, rates, intervals, half):
        assert tried == [] or intervals > tried[-1]
        tried.append(intervals)
        return self.truncation * (needed / intervals) ** ORDER

    monkeypatch.setattr(Splitting, "_error", error)
    maps, _ = Splitting(damping, 1e-8).propagate(stiffness, None, rates, 4, False)
    assert maps.shape[1] >= needed
