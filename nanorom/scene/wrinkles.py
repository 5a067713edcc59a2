"""Films that are not quite flat, or not quite evenly stretched: random fields of a given width."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import attrs
import numpy as np

from nanorom.scene import fields as v
from nanorom.types import Array

KEY = "plate.initial_shape"
TENSION_KEY = "tension.variation"
WAVES = 400  # plane waves: values at a place are normal and covariances right to 1/sqrt(WAVES)


def _correlation(key: str) -> Any:
    about = "length l of its correlation exp(-d^2/(2 l^2))"
    metadata = v.quantity(f"{key}.correlation", "m", about=about)
    return attrs.field(converter=v.as_quantity, metadata=metadata)


def _seed(key: str) -> Any:
    metadata = v.integer(f"{key}.seed", 0, 2**32 - 1, about="of the random numbers")
    return attrs.field(default=0, metadata=metadata)


@attrs.frozen(field_transformer=v.readers)
class Wrinkles:
    """A Gaussian random field of height (m), the same on every mesh for a seed.

    Heights have the standard deviation ``amplitude`` and, at a distance d, the correlation
    exp(-d^2/(2 correlation^2)): a sum of plane waves whose wave vectors are normal (Rahimi and
    Recht, Advances in Neural Information Processing Systems 20, 2007).
    """

    amplitude: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(f"{KEY}.amplitude", "m", about="standard deviation of the height"),
    )
    correlation: float = _correlation(KEY)
    seed: int = _seed(KEY)

    def values(self, points: Array) -> Array:
        """Height (n,) in m at points (n, 2) in m."""
        return random_field(self, points)


@attrs.frozen(field_transformer=v.readers)
class Unevenness:
    """A Gaussian random field of tension (N/m) beside the film's, before it relaxes.

    The same in every direction; amplitude, correlation and seed are as of `Wrinkles`.
    """

    amplitude: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(
            f"{TENSION_KEY}.amplitude", "N/m", about="standard deviation, before it relaxes"
        ),
    )
    correlation: float = _correlation(TENSION_KEY)
    seed: int = _seed(TENSION_KEY)

    def values(self, points: Array) -> Array:
        """Tension (n,) in N/m at points (n, 2) in m."""
        return random_field(self, points)


def random_field(field: Wrinkles | Unevenness, points: Array) -> Array:
    """Values (n,) at points (n, 2) in m."""
    vectors, phases = _waves(field.seed)
    angles = points @ vectors.T / field.correlation + phases
    return np.asarray(field.amplitude * np.sqrt(2 / WAVES) * np.cos(angles).sum(axis=1))


@lru_cache(maxsize=4)
def _waves(seed: int) -> tuple[Array, Array]:
    """Wave vectors (n, 2) by the correlation length and phases (n,)."""
    random = np.random.default_rng(seed)
    return random.standard_normal((WAVES, 2)), 2 * np.pi * random.random(WAVES)
