"""The equations of more modes than a model has, at one drive level, and where its own stand.

An orbit of the model is one of the larger equations with the modes outside at rest or, where
quadratic terms push them, in static equilibrium with the model's: as the model itself has it.
"""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.harmonics import (
    Basis,
    Support,
    basis_for,
    close_support,
    fourier_matrix,
)
from nanorom.continuation.orbits.orbit import Orbit, PeriodicOrbit
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import ModalSystem
from nanorom.types import Array

PRESENT = 1e-10  # of the largest coefficient: a harmonic of a mode below that is none
TRUNCATION = 1e-6  # of the map over a period: a multiplier to as many digits as an error needs

Index = NDArray[np.intp]


@attrs.frozen(eq=False)
class Seen:
    """An orbit of the model in the larger equations: coefficients x on a basis, and its rate."""

    balance: HarmonicBalance
    support: Support
    x: Array
    rate: float

    @property
    def basis(self) -> Basis:
        """The harmonics of the modes that take part."""
        return self.balance.basis

    @property
    def modes(self) -> Index:
        """Mode of each unknown (n,)."""
        count, own = self.basis.shape[0], self.basis.modes
        every = np.tile(own, count)
        return every if self.basis.unknowns is None else every[self.basis.unknowns]


class LargerSystem:
    """More modes at one drive level.

    system : of N modes; inside (L,): places of the model's modes among them, in its order.
    """

    def __init__(
        self, system: ModalSystem, inside: Index, direct: float, parametric: float
    ) -> None:
        self.scaled: ScaledSystem = system.scaled(direct, parametric)
        self.inside = np.asarray(inside)
        self.outside = np.setdiff1d(np.arange(self.scaled.size), self.inside)
        self._balances: dict[tuple[bytes, int, int], tuple[HarmonicBalance, Support]] = {}

    @cached_property
    def floquet(self) -> FloquetSolver:
        """Multipliers of all modes."""
        return FloquetSolver(self.scaled, TRUNCATION)

    def rate(self, orbit: PeriodicOrbit) -> float:
        """Scaled rate of an orbit in the user's units."""
        return orbit.omega / orbit.period_multiple / self.scaled.frequency

    def seen(self, orbit: PeriodicOrbit) -> Seen:
        """An orbit of the model, coefficients (2H + 1, L)."""
        full = np.zeros((len(orbit.coefficients), self.scaled.size))
        full[:, self.inside] = orbit.coefficients / self.scaled.amplitude
        if len(self.outside) and self.scaled.quadratic.any():
            full[:, self.outside] = self._pushed(full)
        balance, support = self._balance(full, orbit.period_multiple)
        return Seen(balance, support, balance.basis.compress(full), self.rate(orbit))

    def _pushed(self, full: Array) -> Array:
        """Static deflections (2H + 1, K) of the modes outside under the quadratic force."""
        inside, outside = self.inside, self.outside
        count = 2 * len(full)
        table = fourier_matrix(2 * np.pi / count * np.arange(count), (len(full) - 1) // 2)
        q = table @ full[:, inside]
        push = self.scaled.quadratic[np.ix_(outside, inside, inside)].reshape(len(outside), -1)
        force = (q[:, :, None] * q[:, None, :]).reshape(count, -1) @ push.T
        moved = -np.linalg.solve(self.scaled.stiffness[np.ix_(outside, outside)], force.T).T
        found = table.T @ moved * (2.0 / count)
        found[0] /= 2
        return np.asarray(found)

    def _balance(self, full: Array, period_multiple: int) -> tuple[HarmonicBalance, Support]:
        modulus, harmonics = 2 * period_multiple, (len(full) - 1) // 2
        table = np.zeros((self.scaled.size, modulus), dtype=bool)
        large = np.abs(full) > PRESENT * np.abs(full).max()
        if not large.any():  # at rest: whether its own modes stay there is what is asked
            large[:, self.inside] = True
        for row in range(len(full)):
            for number in ((row + 1) // 2, -((row + 1) // 2)):
                table[large[row], number % modulus] = True
        key = (table.tobytes(), harmonics, period_multiple)
        if key not in self._balances:
            support = close_support(self.scaled, Support(table))
            basis = basis_for(support, harmonics, period_multiple)
            self._balances[key] = HarmonicBalance(self.scaled, basis), support
        return self._balances[key]

    def orbit(self, seen: Seen, x: Array, rate: float) -> Orbit:
        """Coefficients on a basis as an orbit of all modes, scaled."""
        full = seen.basis.expand(x, self.scaled.size)
        return Orbit(full, rate, seen.basis.period_multiple)

    def multipliers(self, seen: Seen, x: Array, rate: float) -> Array:
        """Floquet multipliers (2N,) of an orbit."""
        full = self.orbit(seen, x, rate).coefficients
        p = seen.basis.period_multiple
        found = self.floquet.multipliers(full[None], np.array([rate]), p, seen.support)
        return np.asarray(found[0])
