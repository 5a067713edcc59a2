"""Floquet multipliers of an orbit with modes outside the model among those that may grow."""

from __future__ import annotations

import numpy as np

from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.harmonics import full_support
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.verification.driven import DrivenFilm


class Stability:
    """Of orbits of one level of the drive, all named modes of all classes included."""

    def __init__(self, driven: DrivenFilm) -> None:
        self.film = driven.film
        self.scaled = driven.system.scaled(1.0, 1.0)
        self._solver = FloquetSolver(self.scaled)

    def largest(self, orbit: PeriodicOrbit) -> float:
        """Largest modulus of a Floquet multiplier.

        orbit : coefficients (2H + 1, L) of the model's modes, or (2H + 1, N) of all named ones.
        """
        film, p = self.film, orbit.period_multiple
        scaled = film.all_named(orbit.coefficients) / film.scale / self.scaled.amplitude
        rates = np.array([orbit.omega / p * film.units.time / self.scaled.frequency])
        support = full_support(self.scaled, p)
        found = self._solver.multipliers(scaled[None], rates, p, support)
        return float(np.abs(found).max())
