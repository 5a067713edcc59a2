"""Virtual work of simple forces on a strip whose deflection does not vary across it."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import SceneError
from nanorom.fem.models.beam import BeamModes
from nanorom.rom.patterns import ModalWork
from nanorom.scene.patterns.pattern import Areal
from nanorom.types import Array

NODES = 24  # of Gauss' rule on a panel no longer than a pattern's size: 1e-14 of a Gaussian
REACH = 1e-9  # of the length or the width: a point so far beside the strip is on its edge


@attrs.frozen(eq=False)
class StripWork(ModalWork):
    """Virtual work on modes of a beam, (L,) places of them, that is ``width`` wide."""

    modes: BeamModes
    index: NDArray[np.int64]
    width: float

    def uniform(self, pressure: float = 1.0) -> Array:
        return pressure * self.width * self.modes.area[self.index]

    def areal(self, pattern: Areal) -> Array:
        along, across = pattern.centre
        length, reach, size = self.modes.beam.length, pattern.reach, pattern.size
        half, wave = length / 2, length / self.modes.functions
        x, measure = _rule((-half, half), (along - reach, along + reach), min(size, wave))
        half = self.width / 2
        y, weights = _rule((-half, half), (across - reach, across + reach), size)
        points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        pressed = pattern.density(points).reshape(len(x), len(y)) @ weights
        pattern.check_meets(float(measure @ pressed))
        return np.asarray(self._shapes(x) @ (measure * pressed))

    def points(self, places: Array, weights: Array, key: str) -> Array:
        sides = np.array([self.modes.beam.length, self.width])
        if (np.abs(places) > (0.5 + REACH) * sides).any():
            raise SceneError(f"{key}: it is not on the film")
        return np.asarray(self._shapes(places[:, 0]) @ weights)

    def inertia(self, acceleration: float = 1.0) -> Array:
        return -acceleration * self.modes.beam.mass_per_length * self.modes.area[self.index]

    def stretch(self, tension: float = 1.0) -> Array:
        return -tension * self.width * self.modes.slope[np.ix_(self.index, self.index)]

    def _shapes(self, x: Array) -> Array:
        """Shapes (L, n) at places measured from the middle."""
        half = self.modes.beam.length / 2
        return self.modes.shapes(np.clip(x, -half, half) + half)[self.index]


def _rule(
    within: tuple[float, float], wanted: tuple[float, float], panel: float
) -> tuple[Array, Array]:
    """Points (n,) and weights (n,) of Gauss' rule on panels of what two intervals share."""
    low, high = max(within[0], wanted[0]), min(within[1], wanted[1])
    if high <= low:
        return np.empty(0), np.empty(0)
    edges = np.linspace(low, high, int(np.ceil((high - low) / panel)) + 1)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = np.diff(edges) / 2
    points = (edges[:-1] + half)[:, None] + half[:, None] * nodes
    return points.ravel(), (half[:, None] * weights).ravel()
