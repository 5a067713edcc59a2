"""A Gaussian spot of light."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.scene import fields as v
from nanorom.scene.patterns.pattern import POSITION, Areal
from nanorom.types import Array

REACH = 3.5  # radii from the centre at which the intensity is e^-24


@attrs.frozen
class Spot(Areal):
    """A pressure p exp(-2 d^2/radius^2) at a distance d from ``position``, p its level in Pa.

    position : (x, y) in m; radius : in m, where the intensity is 1/e^2 of the centre's.
    """

    name = "spot"
    unit = "Pa"

    position: tuple[float, float] = attrs.field(metadata=POSITION)
    radius: float = attrs.field(
        metadata=v.quantity(
            "drive.radius", "m", about="of a spot, where its intensity is 1/e^2 of the centre's"
        )
    )

    @property
    def centre(self) -> tuple[float, float]:
        return self.position

    @property
    def size(self) -> float:
        return self.radius

    @property
    def reach(self) -> float:
        return REACH * self.radius

    def density(self, points: Array) -> Array:
        distance = np.sum((points - np.asarray(self.position)) ** 2, axis=-1)
        return np.asarray(np.exp(-2 * distance / self.radius**2))
