"""Resonances as functions of tension, bending stiffness and mass: what identification fits."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from nanorom.types import Array


@attrs.frozen(eq=False)
class Lines:
    """Computed resonances: frequency (n,) Hz, label (n,), gradient (n, 4).

    The gradient is in Hz per unit of T_x, T_y (N/m), D (N m) and rho h (kg/m^2).
    """

    frequency: Array
    label: tuple[str, ...]
    gradient: Array

    @classmethod
    def of(cls, squares: Array, slopes: Array, label: Sequence[str], areal_mass: float) -> Lines:
        """From omega^2 (n,) and its slopes (n, 3) with T_x, T_y, D, in SI units.

        omega^2 goes with 1/(rho h).
        """
        frequency = np.sqrt(squares) / (2 * np.pi)
        slopes = np.column_stack([slopes, -squares / areal_mass])
        return cls(frequency, tuple(label), slopes / (8 * np.pi**2 * frequency[:, None]))


Spectrum = Callable[[float, float, float, float, int], Lines]  # T_x, T_y, D, rho h, count


@attrs.frozen(eq=False)
class RitzClass:
    """Modes of one class of symmetry in a basis of b shapes of unit mass.

    parts: (3, b, b) of the stiffness per T_x, T_y, D: eigenvalues of their sum are
    omega^2 rho h; known: (b, s) shapes that have a name, of unit mass; name: (s,) theirs.
    """

    parts: Array
    known: Array
    name: tuple[str, ...]


@attrs.frozen(eq=False)
class RitzSpectrum:
    """The lowest resonances by Ritz' method in a basis of modes of the film itself.

    A thousand times faster than their finite elements: frequencies are upper bounds, right to
    1e-6 and better between the parameters from which the basis is.  A mode is named after the
    one of the basis that it resembles most.
    """

    classes: tuple[RitzClass, ...]

    def __call__(
        self, tension_x: float, tension_y: float, bending: float, areal_mass: float, count: int
    ) -> Lines:
        """The ``count`` lowest resonances: T_x, T_y in N/m, D in N m, rho h in kg/m^2."""
        weights = np.array([tension_x, tension_y, bending]) / areal_mass
        found = [self._lowest(own, weights, count) for own in self.classes]
        squares = np.concatenate([values for values, _, _ in found])
        order = np.argsort(squares, kind="stable")[:count]
        slopes = np.concatenate([slopes for _, slopes, _ in found])[order] / areal_mass
        names = [name for _, _, names in found for name in names]
        return Lines.of(squares[order], slopes, [names[i] for i in order], areal_mass)

    @staticmethod
    def _lowest(own: RitzClass, weights: Array, count: int) -> tuple[Array, Array, list[str]]:
        values, vectors = np.linalg.eigh(np.tensordot(weights, own.parts, 1))
        values, vectors = values[:count], vectors[:, :count]
        slopes = np.einsum("dai,ai->id", own.parts @ vectors, vectors)
        nearest = np.abs(vectors.T @ own.known).argmax(axis=1)
        return values, slopes, [own.name[i] for i in nearest]
