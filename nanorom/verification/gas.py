"""Gas that a film squeezes against a wall, at each harmonic of an orbit.

A harmonic w exp(i omega t) of the film makes a pressure p by Reynolds' equation as
`fem.tensors.squeeze` has it, to first order in w over the gap,

    -lap p + i sigma p = i sigma w,    sigma = 12 mu omega/(P g^2),    p by P/g,

and (P/g) int p v acts against the film.  A reduced model has each mode's own part of this at the
mode's own frequency; here all of the film answers, at the frequency with which it moves.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from nanorom.types import Array

Solve = Callable[[np.ndarray], np.ndarray]  # of complex columns


@attrs.frozen(eq=False)
class ClassGas:
    """The gas of one class of symmetry, film-scaled.

    laplacian, mass (g, g) : of pressures; onto (g, free) : int p w; strength : P/g; squeeze : sigma
    by the frequency; still (g,) : the pressure that gas which cannot flow out has of a film at
    rest, of unit mean square, None where there is none.
    """

    laplacian: sp.csr_matrix
    mass: sp.csr_matrix
    onto: sp.csr_matrix
    strength: float
    squeeze: float
    still: Array | None
    _known: dict[float, Solve] = attrs.field(factory=dict)

    def force(self, columns: Array, rate: float) -> Array:
        """Force (free, 2H + 1) against coefficients of the film (free, 2H + 1) at a rate."""
        found = np.zeros_like(columns)
        if self.still is not None:
            mean = self.still @ (self.onto @ columns[:, 0])
            found[:, 0] = self.onto.T @ (self.still * mean)
        for k, load in self._loads(columns):
            pressure = self._pressure(k * rate, load)
            _put(found, k, self.onto.T @ pressure)
        return self.strength * found

    def by_rate(self, columns: Array, rate: float) -> Array:
        """Derivative of the force by the rate."""
        found = np.zeros_like(columns)
        for k, load in self._loads(columns):
            pressure = self._pressure(k * rate, load)
            steeper = self._solve(k * rate)(1j * k * self.squeeze * (load - self.mass @ pressure))
            _put(found, k, self.onto.T @ steeper)
        return self.strength * found

    def _loads(self, columns: Array) -> list[tuple[int, np.ndarray]]:
        """Harmonics from the first, and int w v of their complex amplitudes."""
        moved = self.onto @ columns
        count = columns.shape[1] // 2
        return [(k, moved[:, 2 * k - 1] - 1j * moved[:, 2 * k]) for k in range(1, count + 1)]

    def _pressure(self, omega: float, load: np.ndarray) -> np.ndarray:
        return self._solve(omega)(1j * self.squeeze * omega * load)

    def _solve(self, omega: float) -> Solve:
        """Solves Reynolds' equation at a frequency; factors are kept for those of one rate."""
        if omega not in self._known:
            if len(self._known) >= MOST_KEPT:
                self._known.clear()
            matrix = self.laplacian + 1j * self.squeeze * omega * self.mass
            self._known[omega] = spl.splu(sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A").solve
        return self._known[omega]


MOST_KEPT = 64  # factors: as many as an orbit has harmonics


def _put(found: Array, k: int, force: np.ndarray) -> None:
    found[:, 2 * k - 1], found[:, 2 * k] = force.real, -force.imag
