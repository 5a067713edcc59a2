"""Closed curves by their values at equidistant angles: interpolation, rotation, derivative.

An odd number 2H + 1 of nodes carries harmonics up to H exactly.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix
from nanorom.types import Array

HARMONICS = (3, 4, 6, 8, 10, 12, 15, 18, 22, 27, 33, 40, 48, 58, 70, 85, 100)


class Circle:
    """The nodes of a closed curve and the linear maps between its values and its harmonics."""

    def __init__(self, harmonics: int) -> None:
        self.harmonics, self.count = harmonics, 2 * harmonics + 1
        self.angles = 2 * np.pi / self.count * np.arange(self.count)
        self.synthesis = fourier_matrix(self.angles, harmonics)
        weights = np.full(self.count, 2.0 / self.count)
        weights[0] = 1.0 / self.count
        self.analysis = np.ascontiguousarray((self.synthesis * weights).T)
        self.derivative = self.synthesis @ differentiate(self.analysis)

    def interpolation(self, angles: Array) -> Array:
        """The matrix (n, N) from the values at the nodes to those at the angles (n,)."""
        return np.asarray(fourier_matrix(angles, self.harmonics) @ self.analysis)

    def rotation(self, angle: float) -> Array:
        """The matrix (N, N) from the values at the nodes to those an angle farther."""
        return self.interpolation(self.angles + angle)

    def sizes(self, values: Array) -> Array:
        """Largest coefficient of each harmonic 0 ... H of a curve with values (N, ...)."""
        largest = np.abs(self.analysis @ values.reshape(self.count, -1)).max(axis=1)
        return np.append(largest[0], np.maximum(largest[1::2], largest[2::2]))

    def tail(self, values: Array) -> float:
        """Size of the last two harmonics relative to the largest of all."""
        sizes = self.sizes(values)
        return float(sizes[-2:].max() / max(sizes.max(), 1e-300))

    def to(self, other: Circle, values: Array) -> Array:
        """The same curve at the nodes of another circle; harmonics that it lacks are cut."""
        common = min(self.harmonics, other.harmonics)
        rows = 2 * common + 1
        coefficients = self.analysis[:rows] @ values.reshape(self.count, -1)
        return np.asarray(other.synthesis[:, :rows] @ coefficients).reshape(
            (other.count, *values.shape[1:])
        )


@lru_cache(maxsize=32)
def circle(harmonics: int) -> Circle:
    """The circle of so many harmonics, built once."""
    return Circle(harmonics)
