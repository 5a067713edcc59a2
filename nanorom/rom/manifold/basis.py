"""The linear motions in which a manifold is computed: damped modes as pairs of complex ones."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.linalg import eigh

from nanorom.errors import ModelError
from nanorom.types import Array, Numbers

DIAGONAL = 1e-8  # of a matrix by its diagonal: couplings below are round-off of a reduction
DEFECTIVE = 1e-8  # relative: a pair of rates that are no two


@attrs.frozen(eq=False)
class Basis:
    """Complex modal coordinates u (2L,) of (q, q') and their rates: u' = rates u + inverse f.

    rates (2L,): mode by mode with positive imaginary parts, then their conjugates; shapes (L, 2L):
    q = shapes u, q' = shapes (rates u); inverse (2L, L): u by what accelerates q.
    """

    rates: Numbers
    shapes: Numbers
    inverse: Numbers

    @property
    def size(self) -> int:
        """Number of modes L."""
        return len(self.shapes)

    @property
    def speeds(self) -> Numbers:
        """(L, 2L): q' by u."""
        return np.asarray(self.shapes * self.rates)


def basis(mass: Array, damping: Array, stiffness: Array) -> Basis:
    """The basis of M q'' + C q' + K q = 0, modes by coordinate where the matrices are diagonal, by
    frequency else.

    The shapes have their largest entry 1/2, so that q = |z| cos for u = z / |z| of a mode: |u| is
    an amplitude.  Raises ModelError where a mode does not oscillate.
    """
    shapes, squares = _undamped(mass, stiffness)
    loss = shapes.T @ damping @ shapes
    if _diagonal(loss, np.sqrt(np.abs(squares))):
        rates = _roots(np.diag(loss), squares)
        speeds = shapes * rates
    else:
        rates, shapes, speeds = _damped(shapes, squares, loss)
    scale = 2 * shapes[np.abs(shapes).argmax(axis=0), np.arange(len(rates))]
    shapes, speeds = shapes / scale, speeds / scale
    full = np.block([[shapes, shapes.conj()], [speeds, speeds.conj()]])
    inverse = np.linalg.solve(full, np.eye(2 * len(rates)))[:, len(rates) :]
    return Basis(
        np.concatenate([rates, rates.conj()]),
        np.concatenate([shapes, shapes.conj()], axis=1),
        inverse @ np.linalg.inv(mass),
    )


def _undamped(mass: Array, stiffness: Array) -> tuple[Array, Array]:
    """Shapes (L, L) of unit mass as columns, and squared frequencies (L,)."""
    if _diagonal(mass, np.sqrt(np.diag(mass))) and _diagonal(
        stiffness, np.sqrt(np.abs(np.diag(stiffness)))
    ):
        # a pair of equal frequency keeps its axes, which round-off would turn
        return np.diag(np.diag(mass) ** -0.5), np.diag(stiffness) / np.diag(mass)
    squares, shapes = eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
    return shapes, squares


def _diagonal(matrix: Array, scale: Array) -> bool:
    """Whether what couples coordinates is round-off, by sizes of the coordinates."""
    scale = np.where(scale > 0, scale, 1.0)
    relative = np.abs(matrix) / scale[:, None] / scale
    off = relative - np.diag(np.diag(relative))
    return bool(off.max() <= DIAGONAL * max(np.diag(relative).max(), DIAGONAL))


def _roots(loss: Array, squares: Array) -> Numbers:
    rest = squares - loss**2 / 4
    if np.any(rest <= DEFECTIVE * np.abs(squares)):
        mode = int(np.flatnonzero(rest <= DEFECTIVE * np.abs(squares))[0]) + 1
        raise ModelError(
            f"manifold: mode {mode} does not oscillate (damping beyond its critical value, or no "
            "positive stiffness); leave it out"
        )
    return np.asarray(-loss / 2 + 1j * np.sqrt(rest))


def _damped(shapes: Array, squares: Array, loss: Array) -> tuple[Numbers, Numbers, Numbers]:
    """Rates, shapes and speeds where damping couples the modes."""
    size = len(squares)
    zero, one = np.zeros((size, size)), np.eye(size)
    values, vectors = np.linalg.eig(np.block([[zero, one], [-np.diag(squares), -loss]]))
    chosen = np.flatnonzero(values.imag > DEFECTIVE * np.abs(values))
    if len(chosen) != size:
        raise ModelError("manifold: a mode is damped so much that it does not oscillate")
    chosen = chosen[np.argsort(np.abs(values[chosen]), kind="stable")]
    rates = values[chosen]
    return rates, shapes @ vectors[:size, chosen], shapes @ vectors[size:, chosen]
