"""Random shapes have the height and the correlation that they say, whatever the mesh."""

import numpy as np
import pytest

from nanorom.errors import SceneError
from nanorom.scene.film import Plate
from nanorom.scene.wrinkles import WAVES, Wrinkles

AMPLITUDE, CORRELATION = 2e-9, 0.5e-6
SEEDS = range(600)
SAMPLED = 5 / np.sqrt(len(SEEDS))  # of moments that so many seeds give, at five deviations


def heights(points):
    return np.array([Wrinkles(AMPLITUDE, CORRELATION, seed).values(points) for seed in SEEDS])


def test_heights_are_normal_with_a_gaussian_correlation():
    distance = np.array([0.0, 0.5, 1.0, 2.0]) * CORRELATION
    z = heights(np.column_stack([0.6 * distance, 0.8 * distance])) / AMPLITUDE
    assert z.mean(axis=0) == pytest.approx(0.0, abs=SAMPLED)
    assert z[:, 0] @ z / len(z) == pytest.approx(
        np.exp(-(distance**2) / (2 * CORRELATION**2)), abs=SAMPLED
    )
    assert (z[:, 0] ** 4).mean() == pytest.approx(3.0, abs=3 * np.sqrt(96 / len(z)) + 5 / WAVES)


def test_a_seed_is_one_shape():
    points = np.random.default_rng(3).random((20, 2)) * 5e-6
    one, again = (Wrinkles("2 nm", "0.5 um", 7).values(points) for _ in range(2))
    assert (one == again).all()
    assert (one != Wrinkles("2 nm", "0.5 um", 8).values(points)).all()


@pytest.mark.parametrize(
    ("shape", "told"),
    [
        ({"amplitude": "2 nm"}, r"^plate\.initial_shape\.correlation: missing"),
        ({"amplitude": "2 nm", "correlation": 0}, r"^plate\.initial_shape\.correlation: found 0"),
        (
            {"amplitude": "2 nm", "correlation": "1 um", "seed": 0.5},
            r"^plate\.initial_shape\.seed: found 0\.5",
        ),
        (3, r"^plate\.initial_shape: found 3; allowed: the name of a table .* or \{ amplitude"),
    ],
)
def test_bad_wrinkles_are_told(shape, told):
    with pytest.raises(SceneError, match=told):
        Plate(thickness="10 nm", initial_shape=shape)
