"""The drive raised from rest at a fixed frequency, round the folds on the way.

Beyond a fold a larger drive has no orbit nearby, and Newton's method leads nowhere. The curve of
orbits and levels goes round it and, where nothing bounds the response, on to any level: strongly
driven below their resonance, systems pass many superharmonic resonances on the way. It is followed
by pseudo-arclength in (orbit, level).
"""

from __future__ import annotations

from dataclasses import replace

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.continuation.branches.march import STRAIGHT, March, StepControl
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.scaled import ARRAYS
from nanorom.errors import ContinuationError
from nanorom.types import Array

FIRST, LEAST_STEP, LARGEST_STEP = 1e-2, 1e-6, 0.2  # arc length, by the size of the unknowns
MOST_STEPS = 600  # twice what a drive of 500 times the stiffness takes
NEWTON, NEWTON_STEPS, EASY_STEPS = 1e-8, 8, 4  # of the unknowns: last change
AT_LEVEL = 1e-6  # of a step, to which the level is met; the orbit is corrected there
UNRESOLVED = 1e-4  # of an orbit: last harmonics at which those allowed do not suffice
FIRST_HARMONICS = 5


@attrs.frozen(eq=False)
class _Place:
    """An orbit and its level in the unknowns z (n + 1,) of a balance, and the curve's tangent."""

    balance: HarmonicBalance
    z: Array
    tangent: Array


class Rise:
    """Orbits of one frequency by the level of the drive, of which the system has one."""

    def __init__(self, tracer: Tracer, omega: float) -> None:
        self.tracer, self.rate = tracer, omega / tracer.period_multiple
        system = tracer.system
        drives = ("force", "parametric")
        self.free = replace(system, **{n: 0 * getattr(system, n) for n in drives})
        self.drive = replace(
            system, **{n: 0 * getattr(system, n) for n in ARRAYS if n not in drives}
        )
        self._balances: dict[int, tuple[HarmonicBalance, HarmonicBalance]] = {}

    def orbit(self) -> Orbit:
        """The first orbit that the curve from rest meets at level 1.

        Raises ContinuationError if it does not lead there.
        """
        harmonics = next(h for h in self.tracer.ladder if h >= FIRST_HARMONICS)
        balance = self.tracer.balance(harmonics)
        axis = np.append(np.zeros(balance.basis.size), 1.0)
        z, tangent, _ = self._correct(balance, np.zeros_like(axis), axis)
        start = _Place(balance, z, tangent)
        march = March(
            self._advance, start, StepControl(FIRST, LEAST_STEP, LARGEST_STEP, MOST_STEPS)
        )
        reached = 0.0
        for here, there in march:
            if there.z[-1] >= 1.0:
                return self._at_level(here, there)
            reached = float(there.z[-1])
        why = {
            "end": f"more than {self.tracer.ladder[-1]} harmonics are needed",
            "steps": f"more than {MOST_STEPS} steps are needed",
        }.get(march.ending, "the curve of orbits is lost")
        raise ContinuationError(
            f"the drive is too strong: raised to {reached:.3g} of its level, {why}"
        )

    def _advance(self, here: _Place, length: float) -> tuple[_Place, bool] | None:
        here = self._adapted(here)
        basis = here.balance.basis
        tail = self.tracer.tail(here.balance, basis.unpack(here.z[:-1]))
        if basis.harmonics == self.tracer.ladder[-1] and tail > UNRESOLVED:
            return None
        there, steps = self._moved(here, length * (1.0 + float(np.abs(here.z).max())))
        if there.tangent @ here.tangent < STRAIGHT:
            raise ContinuationError("the response turns too fast for the step in level")
        return there, steps <= EASY_STEPS

    def _moved(self, here: _Place, length: float) -> tuple[_Place, int]:
        z = here.z + length * here.tangent
        z, tangent, steps = self._correct(here.balance, z, here.tangent)
        return _Place(here.balance, z, tangent), steps

    def _at_level(self, here: _Place, there: _Place) -> Orbit:
        if here.balance is not there.balance:
            here = self._transferred(here, there.balance)
        length = float((there.z - here.z) @ here.tangent)

        def missing(a: float) -> float:
            return float(self._moved(here, a)[0].z[-1]) - 1.0

        place, _ = self._moved(here, brentq(missing, 0.0, length, xtol=AT_LEVEL * length))
        basis = place.balance.basis
        full = basis.expand(basis.unpack(place.z[:-1]), self.tracer.system.size)
        return Orbit(full, self.rate, self.tracer.period_multiple)

    def _adapted(self, here: _Place) -> _Place:
        """The place on as many harmonics as it deserves."""
        balance = here.balance
        wanted = self.tracer.adapt(balance, balance.basis.unpack(here.z[:-1]))
        if wanted == balance.basis.harmonics:
            return here
        return self._transferred(here, self.tracer.balance(wanted))

    def _transferred(self, here: _Place, other: HarmonicBalance) -> _Place:
        old = here.balance
        x, tangent = self.tracer.transfer(old, other, old.basis.unpack(here.z[:-1]), here.tangent)
        return _Place(other, np.append(other.basis.pack(x), here.z[-1]), tangent)

    def _pair(self, balance: HarmonicBalance) -> tuple[HarmonicBalance, HarmonicBalance]:
        """The balance without drive, and what the drive adds per level."""
        basis = balance.basis
        if basis.harmonics not in self._balances:
            pair = HarmonicBalance(self.free, basis), HarmonicBalance(self.drive, basis, False)
            self._balances[basis.harmonics] = pair
        return self._balances[basis.harmonics]

    def _correct(
        self, balance: HarmonicBalance, z: Array, border: Array
    ) -> tuple[Array, Array, int]:
        """Newton's method orthogonal to the border, the tangent and the number of corrections."""
        basis, n = balance.basis, balance.basis.size
        free, drive = self._pair(balance)
        right = np.zeros((n + 1, 2))  # for the change, and for the tangent
        right[-1, 1] = 1.0
        matrix = np.empty((n + 1, n + 1))
        matrix[n] = border
        for step in range(NEWTON_STEPS):
            x, level = basis.unpack(z[:n]), float(z[n])
            added = basis.pack(drive.residual(x, self.rate))
            matrix[:n, :n] = free.jacobian_t(x, self.rate).T
            matrix[:n, :n] += level * drive.jacobian_t(x, self.rate).T
            matrix[:n, n] = added
            right[:n, 0] = -basis.pack(free.residual(x, self.rate)) - level * added
            try:
                change, direction = np.linalg.solve(matrix, right).T
            except np.linalg.LinAlgError:  # singular: as one that does not converge
                break
            z = z + change
            if not np.all(np.isfinite(z)):
                break
            if np.abs(change).max() < NEWTON * max(1.0, float(np.abs(z).max())):
                return z, direction / np.linalg.norm(direction), step + 1
        raise ContinuationError("no orbit near at this level")
