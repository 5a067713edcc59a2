"""Curves of periodic orbits in the plane of frequency and a parameter, by pseudo-arclength.

A kind of curve says which equations its points solve; following them, adapting the harmonics, and
locating turns of the parameter and given levels is the same for all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Protocol

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.continuation.branches.accuracy import least_loss
from nanorom.continuation.branches.march import STRAIGHT, March, StepControl
from nanorom.continuation.orbits.harmonics import (
    HARMONIC_LADDER,
    Basis,
    Support,
    own_support,
)
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

NEWTON = 1e-9  # of the unknowns: the last change of Newton's method
SQUARED = 1e-2  # of the tolerance: a last change that leaves an error much smaller than it
BESIDE_DAMPING = 1e-3  # of the damping, 1/Q: what may be left out of an orbit
TURN = 1e-9  # of a step, to which a turn of the parameter is located
NEWTON_STEPS, EASY_STEPS = 8, 4
NEWTON_CHORDS = 20  # of both kinds
FALLING = 0.3  # of the change before: less, and the matrix is still good
FIRST = 0.1  # of the largest step
LEAST_STEP = 1e-7  # arc length, in units of the unknowns
SHORT = 1e-5  # arc length below which the curve may turn as it likes: a cusp
BESIDE = 0.25  # of a step: how far its end may be off the tangent, as an arc's that turns so far
BENT = 0.2  # of a step: how far its middle may be off the chord
LAST_ROWS = 4  # of the coefficients: cosine and sine of the last two harmonics


class Equations(Protocol):
    """What the points of a curve solve, for unknowns z = (x, rate, level, ...) on a basis."""

    @property
    def basis(self) -> Basis: ...

    def system(self, z: Array) -> tuple[Array, Array]:
        """Residual (n - 1,) and Jacobian (n - 1, n) for n unknowns."""

    def residual(self, z: Array) -> Array | None:
        """That of `system`, near where it was asked last, if it is to be had for less."""

    def solve(self, matrix: Array, right: Array) -> Array:
        """The solution (n, k) of the last Jacobian with a border (n, n) for right sides (n, k)."""


@attrs.frozen(eq=False)
class Place:
    """A point of a curve in the unknowns z of its equations, and its tangent."""

    balance: Equations
    support: Support
    z: Array
    tangent: Array


@attrs.frozen(eq=False)
class Point:
    """A point of a curve in scaled units: coefficients (2H + 1, L) of all modes, rate = omega by
    the period multiple, level, further unknowns, whether the level turns back, and the type of the
    bifurcation if it is one.
    """

    full: Array
    rate: float
    level: float
    more: tuple[float, ...] = ()
    turn: bool = False
    code: str = ""


@attrs.define(eq=False, kw_only=True)
class Curve(ABC):
    """Pseudo-arclength continuation of orbits of the system origin + level * change, in scaled
    units.

    limits : of the drive frequency and of the level
    tolerance : size of the last harmonics, relative to the orbit
    at : levels at which points are located
    turning : whether turns of the level are, too, for which tangents are to have all digits
    """

    origin: ScaledSystem
    change: ScaledSystem
    multiple: int
    limits: tuple[tuple[float, float], tuple[float, float]]
    tolerance: float
    at: Sequence[float] = ()
    turning: bool = True
    small_force: float = attrs.field(init=False)  # of the orbit, beside that of the damping

    @small_force.default
    def _of_damping(self) -> float:
        return BESIDE_DAMPING * least_loss(self.origin.plus(self.change, 1.0))

    @abstractmethod
    def equations(self, support: Support, harmonics: int) -> Equations:
        """The equations on a number of harmonics."""

    def _support(self, full: Array) -> Support:
        """Modes and harmonics of the orbit and of what the parameter adds to them."""
        everything = self.origin.pattern(self.change)
        return own_support(everything, full, self.multiple)

    def follow(
        self,
        first: Point,
        sign: float,
        steps: int,
        largest: float,
        direction: Array | None = None,
    ) -> list[Point]:
        """Points from the first one in one direction; sign: of the change of the level, or of that
        along a direction (2H + 1, L) of the coefficients, in which the first one stays where it is.
        """
        start = self.place(first, direction)
        start = attrs.evolve(start, tangent=sign * start.tangent)
        points = [self._unpack(start)]
        control = StepControl(FIRST * largest, LEAST_STEP, largest, steps)
        for here, there in March(self._advance, start, control):
            points += self._between(here, there)
            points.append(self._unpack(there))
            if not self._inside(points[-1]):
                break
        return points

    def place(self, first: Point, direction: Array | None = None) -> Place:
        """The first point, corrected at its level, or across a direction of the coefficients, along
        which the tangent leads; raises ContinuationError.
        """
        support = self._support(first.full)
        balance = self._balance(support, self._harmonics(first.full))
        border = np.zeros(balance.basis.size + 2 + len(first.more))
        border[balance.basis.size + 1] = 1.0
        if direction is not None:
            border = self._pack(balance, Point(direction, 0.0, 0.0, (0.0,) * len(first.more)))
        z, tangent, _ = self._correct(balance, self._pack(balance, first), border)
        return Place(balance, support, z, tangent * (1.0 if tangent @ border >= 0 else -1.0))

    def _harmonics(self, full: Array) -> int:
        """How many of an orbit's harmonics are not small."""
        sizes = np.abs(full).max(axis=1)
        large = np.flatnonzero(sizes > self.tolerance * sizes.max(initial=0.0))
        return max(int((large.max(initial=0) + 1) // 2), self.origin.tones * self.multiple)

    def _advance(self, here: Place, length: float) -> tuple[Place, bool]:
        here = self._adapt(here)
        there = here.z + length * here.tangent
        z, tangent, steps = self._correct(
            here.balance, there, here.tangent, chords=not self.turning
        )
        aside = np.linalg.norm(z - there) > BESIDE * length
        if (aside or tangent @ here.tangent < STRAIGHT) and length > SHORT:
            raise ContinuationError("the curve turns too fast for the step")
        return attrs.evolve(here, z=z, tangent=tangent), steps <= (
            EASY_STEPS if self.turning else 1
        )

    def _between(self, here: Place, there: Place) -> list[Point]:
        """The points within a step at which the parameter turns back or has a level asked for."""
        balance = there.balance
        before = here if here.balance is balance else self._moved(here, balance)
        level = balance.basis.size + 1
        turning = None
        if self.turning:
            turning = self._located(before, there, lambda place: float(place.tangent[level]))
        found = []
        for one, two in ((before, turning or there), (turning, there)):
            if one is None:
                break
            if one is turning:
                found.append(attrs.evolve(self._unpack(one), turn=True))
            for value in sorted(self.at, reverse=bool(one.z[level] > two.z[level])):
                place = self._at_level(one, two, value)
                found += [] if place is None else [self._unpack(place)]
        return found

    def _at_level(self, before: Place, there: Place, value: float) -> Place | None:
        """The point within a step that has a level, if it is between those of its ends."""
        level = before.balance.basis.size + 1
        ends = before.z[level] - value, there.z[level] - value
        if ends[0] * ends[1] >= 0:
            return None
        z = before.z + ends[0] / (ends[0] - ends[1]) * (there.z - before.z)
        z[level] = value
        border = np.eye(len(z))[level]
        try:
            found, tangent, _ = self._correct(before.balance, z, border, chords=not self.turning)
        except ContinuationError:  # located by bisection below
            found, tangent = np.full_like(z, np.inf), z
        if np.linalg.norm(found - z) < BENT * np.linalg.norm(there.z - before.z):
            return attrs.evolve(before, z=found, tangent=tangent)
        return self._located(before, there, lambda place: float(place.z[level]) - value)

    def _located(
        self, before: Place, there: Place, function: Callable[[Place], float]
    ) -> Place | None:
        """Where a function of the points of a step vanishes, if its sign changes."""
        if function(before) * function(there) >= 0:
            return None
        length = float((there.z - before.z) @ before.tangent)

        def place(a: float) -> Place:
            z = before.z + a * before.tangent
            z, tangent, _ = self._correct(before.balance, z, before.tangent)
            return attrs.evolve(before, z=z, tangent=tangent)

        try:
            return place(brentq(lambda a: function(place(a)), 0.0, length, xtol=TURN * length))
        except (ContinuationError, ValueError):  # not to be had exactly: the nearer end
            return min(before, there, key=lambda end: abs(function(end)))

    @property
    def _solved(self) -> float:
        """Of the unknowns: the last change of Newton's method, which the next one would square."""
        return max(NEWTON, min(SQUARED * self.tolerance, self.small_force))

    def _inside(self, point: Point) -> bool:
        (low, high), (least, most) = self.limits
        return low <= point.rate * self.multiple <= high and least <= point.level <= most

    def _balance(self, support: Support, harmonics: int) -> Equations:
        known = [h for h in HARMONIC_LADDER if h >= harmonics]
        return self.equations(support, known[0] if known else HARMONIC_LADDER[-1])

    def _adapt(self, here: Place) -> Place:
        """More harmonics where the last ones are not small."""
        sizes = np.abs(self._unpack(here).full).max(axis=1)
        harmonics = here.balance.basis.harmonics
        if (
            sizes[-LAST_ROWS:].max() <= self.tolerance * sizes.max()
            or harmonics >= HARMONIC_LADDER[-1]
        ):
            return here
        return self._moved(here, self._balance(here.support, harmonics + 1))

    def _moved(self, here: Place, larger: Equations) -> Place:
        """A place with its tangent on another number of harmonics."""
        basis, n = here.balance.basis, here.balance.basis.size
        step = basis.expand(basis.unpack(here.tangent[:n]), self.origin.size)
        moved = larger.basis.pack(larger.basis.compress(step))
        tangent = np.concatenate([moved, here.tangent[n:]])
        z = self._pack(larger, self._unpack(here))
        return attrs.evolve(here, balance=larger, z=z, tangent=tangent)

    def _pack(self, balance: Equations, point: Point) -> Array:
        x = balance.basis.pack(balance.basis.compress(point.full))
        return np.concatenate([x, [point.rate, point.level], point.more])

    def _unpack(self, place: Place) -> Point:
        basis, z, n = place.balance.basis, place.z, place.balance.basis.size
        full = basis.expand(basis.unpack(z[:n]), self.origin.size)
        return Point(full, float(z[n]), float(z[n + 1]), tuple(z[n + 2 :].tolist()))

    def _correct(
        self, balance: Equations, z: Array, border: Array, chords: bool = False
    ) -> tuple[Array, Array, int]:
        """Newton's method orthogonal to a border, the tangent, and the number of corrections.

        chords : whether a matrix is kept while changes fall fast, and the tangent is that of it
        """
        right = np.zeros((len(z), 2))  # for the change, and for the tangent
        right[-1, 1] = 1.0
        matrix, last, first, corrections = None, np.inf, np.inf, 0
        for _ in range(NEWTON_CHORDS if chords else NEWTON_STEPS):
            residual = balance.residual(z) if matrix is not None else None
            if residual is None:
                residual, jacobian = balance.system(z)
                matrix, last = np.vstack([jacobian, border]), np.inf
                corrections += 1
            right[:-1, 0] = -residual
            try:
                change, direction = balance.solve(matrix, right).T
            except np.linalg.LinAlgError:  # singular: as one that does not converge
                break
            size = float(np.abs(change).max())
            if size > FALLING * last:  # with a new matrix from here
                matrix = None
                continue
            if chords and last == np.inf:
                if size > first:  # a shorter step costs less than to see whether it comes back
                    break
                first = size
            z = z + change
            if not np.all(np.isfinite(z)) or z[balance.basis.size] <= 0:
                break
            if size < self._solved * max(1.0, np.abs(z).max()):
                return z, direction / np.linalg.norm(direction), corrections
            matrix, last = matrix if chords else None, size
        raise ContinuationError("the curve cannot be corrected")
