"""First orbits: of the base branch (from rest, ramping the drive) and of branches that
bifurcate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nanorom.continuation.branches.rational import real_roots
from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.balance import HarmonicBalance, NewtonFailure
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.continuation.orbits.harmonics import (
    Support,
    basis_for,
    close_support,
    full_support,
    resize,
    stretch,
)
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.settings import Settings
from nanorom.continuation.system import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

MOST_STEPS_BACK = 10  # to a bifurcation from the first orbit found beside it
NEAR = 3.0  # times the distance in the critical direction: farther away is another place
IMAGES = 1e-3  # of the change of frequency, which both halves of a pitchfork have in common
END_EXTENT = 3e-3  # of the largest deviation from the fixed space
DISTANCES = (1e-2, 3e-3, 1e-3, 3e-2, 1e-1, 1e-4)  # from a bifurcation, in the order tried
REACHED = 1e-3  # of the distance wanted: what a first orbit may miss it by
LEAST_CHANGE = 1e-6  # of frequency: a smaller one tells no halves apart
ABSENT = 1e-6  # of the critical direction: coefficients that do not take part
SHIFT = 1e-12  # of the matrix, which is singular at the very point
ITERATIONS = 4  # of the inverse power method: one would do but for an unlucky start
RETURNED = 1e-3  # of the deviation from the fixed space at the start of a step


@dataclass(frozen=True, eq=False)
class Start:
    """The first orbit of a branch that bifurcates, its direction (2H + 1, L), and the steps before
    it: none if the first step itself reaches back, None if nothing leads back.
    """

    orbit: Orbit
    direction: Array
    before: list[Series] | None


class Bifurcation:
    """A branch that leaves another one in a direction that breaks a symmetry of the parent."""

    def __init__(
        self, system: ScaledSystem, parent: Support, orbit: Orbit, kind: Kind, settings: Settings
    ) -> None:
        factor = kind.period_factor
        self.doubles = factor > 1
        self.orbit = Orbit(
            stretch(orbit.coefficients, factor), orbit.rate / factor, orbit.period_multiple * factor
        )
        inherited = parent.stretch(factor)
        # orbits that the broken symmetry leaves alone: of a period doubling, all of half the period
        self.fixed = full_support(system, orbit.period_multiple).stretch(2)
        self.fixed = self.fixed if self.doubles else inherited
        self.direction = self._null_vector(system)
        numbers = (np.arange(len(self.direction)) + 1) // 2
        table = inherited.table.copy()
        present = np.abs(self.direction) > ABSENT * np.abs(self.direction).max()
        for residue in range(table.shape[1]):
            table[:, residue] |= present[numbers % table.shape[1] == residue].any(axis=0)
        self.support = close_support(system, Support(table))
        self.tracer = Tracer(system, self.support, self.orbit.period_multiple, settings)

    def _null_vector(self, system: ScaledSystem) -> Array:
        """The critical direction (2H + 1, L) outside the fixed space, by inverse iteration."""
        p = self.orbit.period_multiple
        harmonics = (len(self.orbit.coefficients) - 1) // 2
        everything = full_support(system, p)
        basis = basis_for(everything, harmonics, p)
        balance = HarmonicBalance(system, basis)
        matrix = balance.jacobian_t(basis.compress(self.orbit.coefficients), self.orbit.rate).T
        outside = np.flatnonzero(~self.fixed.rows_mask(harmonics).ravel())
        if len(outside) == 0:
            raise NewtonFailure("the bifurcating branch has the support of its parent")
        block = matrix[np.ix_(outside, outside)]
        block = block + SHIFT * np.abs(block).max() * np.eye(len(outside))
        vector = np.cos(1.0 + np.arange(len(outside)))  # any start that is not orthogonal
        for _ in range(ITERATIONS):
            vector = np.linalg.solve(block, vector)
            vector /= np.linalg.norm(vector)
        direction = np.zeros(matrix.shape[0])
        direction[outside] = vector
        return direction.reshape(2 * harmonics + 1, system.size)

    def starts(self, rates: tuple[float, float]) -> list[Start]:
        """Orbits a little off the bifurcation and the directions in which the branches go on.

        One stands for both halves of a pitchfork, which are images of each other (of a period
        doubling: the same a period later); there are two where the branch crosses its parent.
        Newton's method may end on another branch that passes by, as one that does not lead back to
        the bifurcation shows; it is taken if there is no other.
        """
        passing: Start | None = None
        for distance in DISTANCES:
            orbit = self._start(self.direction, distance)
            if orbit is None:
                continue
            first = self._connected(orbit, self.direction, rates)
            if first.before is None:
                passing = passing or first
                continue
            other = None if self.doubles else self._start(-self.direction, distance)
            if other is None or self._alike(orbit, other):
                return [first]
            return [first, self._connected(other, -self.direction, rates)]
        if passing is None:
            raise ContinuationError("the bifurcating branch could not be started")
        return [passing]

    def _connected(self, orbit: Orbit, direction: Array, rates: tuple[float, float]) -> Start:
        """An orbit with the steps that lead from the bifurcation to it."""
        for series in self.tracer.follow(orbit, direction, rates):
            if self.begin(series):
                return Start(orbit, direction, [])
            break
        steps: list[Series] = []
        for series in self.tracer.follow(orbit, -direction, rates):
            end = self.end(series)
            steps.append(series)
            if end is not None:
                series.length = end
                return Start(orbit, direction, [step.reversed() for step in reversed(steps)])
            if len(steps) == MOST_STEPS_BACK:
                break
        return Start(orbit, direction, None)

    def _alike(self, first: Orbit, second: Orbit) -> bool:
        one, two = first.rate - self.orbit.rate, second.rate - self.orbit.rate
        return abs(one - two) < IMAGES * max(abs(one), abs(two), LEAST_CHANGE)

    def _start(self, direction: Array, distance: float) -> Orbit | None:
        """The orbit of the branch at a distance from the bifurcation."""
        guess = Orbit(
            self.orbit.coefficients + distance * direction,
            self.orbit.rate,
            self.orbit.period_multiple,
        )
        try:
            orbit, balance = self.tracer.solve(guess, self._border)
        except ContinuationError:
            return None
        packed = [
            balance.basis.pack(balance.basis.compress(part))
            for part in (direction, orbit.coefficients)
        ]
        off = abs(float(packed[0] @ packed[1]) - distance) > REACHED * distance
        # the same distance in this direction may be had elsewhere, far along this or another branch
        harmonics = (len(orbit.coefficients) - 1) // 2
        moved = float(
            np.linalg.norm(orbit.coefficients - resize(self.orbit.coefficients, harmonics))
        )
        moved = max(moved, abs(orbit.rate - self.orbit.rate))
        return None if off or moved > NEAR * distance else orbit

    def _border(self, balance: HarmonicBalance) -> Array:
        direction = balance.basis.pack(balance.basis.compress(self.direction))
        return np.append(direction, 0.0)

    def outside(self, series: Series) -> Array:
        """Coefficients (order + 1, m) of the step in the unknowns outside the fixed space."""
        basis = series.balance.basis
        mask = ~self.fixed.rows_mask(basis.harmonics)[np.ix_(basis.rows, basis.modes)].ravel()
        if basis.unknowns is not None:
            mask = mask[basis.unknowns]
        return np.asarray(series.coefficients[:, mask])

    def begin(self, series: Series) -> bool:
        """Extend the first step back to the bifurcation, if it reaches so far."""
        outside = self.outside(series)
        back = real_roots_low(outside @ outside[0], series.length)
        if back is not None:
            series.start = back
        return back is not None

    def end(self, series: Series) -> float | None:
        """Where the branch returns to the fixed space within the step, if it does."""
        outside = self.outside(series)
        roots = real_roots(outside @ outside[0], series.length)
        # a projection may vanish while the part itself does not
        for root in roots:
            part = root ** np.arange(len(outside)) @ outside
            if np.linalg.norm(part) < RETURNED * np.linalg.norm(outside[0]):
                return root
        return None

    def is_end(self, orbit: Orbit, extent: float) -> bool:
        """Whether an orbit of a branch of this extent is one of its ends.

        There the branch is symmetric about the fixed space, which shows as a fold or a branch
        point that it does not have.
        """
        harmonics = (len(orbit.coefficients) - 1) // 2
        part = np.abs(orbit.coefficients[~self.fixed.rows_mask(harmonics)]).max(initial=0.0)
        return bool(part < END_EXTENT * extent)

    def extent(self, steps: list[Series]) -> float:
        """Largest deviation from the fixed space along the branch."""
        return max(float(np.abs(self.outside(step)[0]).max()) for step in steps)


def real_roots_low(coefficients: Array, length: float) -> float | None:
    """The negative root closest to zero, within one step length."""
    mirrored = coefficients * (-1.0) ** np.arange(len(coefficients))
    roots = real_roots(mirrored, length)
    return -roots[0] if roots else None
