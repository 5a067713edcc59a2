"""Films that are not quite flat: a random shape of a given height and width of its wrinkles."""

from __future__ import annotations

from functools import lru_cache

import attrs
import numpy as np

from nanorom.scene import fields as v
from nanorom.types import Array

KEY = "plate.initial_shape"
WAVES = 400  # plane waves: heights at a place are normal and covariances right to 1/sqrt(WAVES)


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
    correlation: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(
            f"{KEY}.correlation", "m", about="length l of its correlation exp(-d^2/(2 l^2))"
        ),
    )
    seed: int = attrs.field(
        default=0, metadata=v.integer(f"{KEY}.seed", 0, 2**32 - 1, about="of the random numbers")
    )

    def height(self, points: Array) -> Array:
        """Height (n,) in m at points (n, 2) in m."""
        vectors, phases = _waves(self.seed)
        angles = points @ vectors.T / self.correlation + phases
        return np.asarray(self.amplitude * np.sqrt(2 / WAVES) * np.cos(angles).sum(axis=1))


@lru_cache(maxsize=4)
def _waves(seed: int) -> tuple[Array, Array]:
    """Wave vectors (n, 2) by the correlation length and phases (n,)."""
    random = np.random.default_rng(seed)
    return random.standard_normal((WAVES, 2)), 2 * np.pi * random.random(WAVES)
