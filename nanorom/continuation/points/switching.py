"""Branches that bifurcate: first orbits, the way back to the bifurcation, and where they end."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.continuation.branches.rational import real_roots
from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.continuation.orbits.harmonics import (
    Support,
    close_support,
    full_support,
    resize,
)
from nanorom.continuation.orbits.orbit import Orbit, same_orbit
from nanorom.continuation.points.directions import fixed_space, shortened, stretched
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings
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
NEAR_STOP = 1e-4  # of orbit and rate: as near as the crossing of two branches can be had
RETURNED = 1e-3  # of the deviation from the fixed space at the start of a step


@attrs.frozen(eq=False)
class Start:
    """The first orbit of a branch that bifurcates, its direction (2H + 1, L), and the steps before
    it: none if the first step itself reaches back, None if nothing leads back.
    """

    orbit: Orbit
    direction: Array
    before: list[Series] | None
    rate: float = 0.0  # change from the bifurcation
    distance: float = 0.0

    def is_image(self, other: Start, system: ScaledSystem) -> bool:
        """Whether a symmetry that the model's amplitudes do not show turns it into another one."""
        if self.distance != other.distance or not _alike(self.rate, other.rate):
            return False
        one, two = (
            np.linalg.norm(system.given(start.orbit.coefficients), axis=0)
            for start in (self, other)
        )
        return bool(np.abs(one - two).max() < IMAGES * np.abs(one).max())


class Bifurcation:
    """A branch that leaves another one in a direction (2H + 1, L) out of the parent's support: it
    breaks a symmetry.
    """

    rate = 0.0  # that goes with the direction

    def __init__(
        self,
        system: ScaledSystem,
        parent: Support,
        orbit: Orbit,
        kind: Kind,
        direction: Array,
        settings: Settings,
    ) -> None:
        factor = kind.period_factor
        self.doubles = factor > 1
        self.orbit = stretched(orbit, factor)
        inherited = parent.stretch(factor)
        self.fixed = fixed_space(system, parent, orbit, kind)
        # of the orbits that keep the symmetry, in their own period
        self.shorter = parent if factor == 1 else full_support(system, orbit.period_multiple)
        self.factor = factor
        self.direction = direction
        numbers = (np.arange(len(self.direction)) + 1) // 2
        table = inherited.table.copy()
        present = np.abs(self.direction) > ABSENT * np.abs(self.direction).max()
        for residue in range(table.shape[1]):
            table[:, residue] |= present[numbers % table.shape[1] == residue].any(axis=0)
        self.support = close_support(system, Support(table))
        self.tracer = Tracer(system, self.support, self.orbit.period_multiple, settings)

    def starts(self, rates: tuple[float, float]) -> list[Start]:
        """Orbits a little off the bifurcation and the directions in which the branches go on.

        One stands for both halves of a pitchfork, which are images of each other (of a period
        doubling: the same a period later); there are two where the branch crosses its parent.
        Newton's method may end on another branch that passes by, as one that does not lead back to
        the bifurcation shows; it is taken if there is no other.
        """
        passing: Start | None = None
        for distance in DISTANCES:
            orbit = self._start(1.0, distance)
            if orbit is None:
                continue
            first = self._connected(orbit, 1.0, rates, distance)
            if first.before is None:
                passing = passing or first
                continue
            other = None if self.doubles else self._start(-1.0, distance)
            if other is None or _alike(first.rate, other.rate - self.orbit.rate):
                return [first]
            return [first, self._connected(other, -1.0, rates, distance)]
        if passing is None:
            raise ContinuationError("the bifurcating branch could not be started")
        return [passing]

    def _connected(
        self, orbit: Orbit, sign: float, rates: tuple[float, float], distance: float
    ) -> Start:
        """An orbit with the steps that lead from the bifurcation to it."""
        direction = sign * self.direction
        start = Start(orbit, direction, None, orbit.rate - self.orbit.rate, distance)
        for series in self.tracer.follow(orbit, direction, rates):
            if self.begin(series):
                return attrs.evolve(start, before=[])
            break
        steps: list[Series] = []
        for series in self.tracer.follow(orbit, -direction, rates):
            end = self.back(series)
            steps.append(series)
            if end is not None:
                series.length = end
                before = [step.reversed() for step in reversed(steps)]
                return attrs.evolve(start, before=before)
            if len(steps) == MOST_STEPS_BACK:
                break
        return start

    def _start(self, sign: float, distance: float) -> Orbit | None:
        """The orbit of the branch at a distance from the bifurcation, on one side of it."""
        parent, step = self.orbit, sign * distance
        guess = Orbit(
            parent.coefficients + step * self.direction,
            parent.rate + step * self.rate,
            parent.period_multiple,
        )
        try:
            orbit, balance = self.tracer.solve(guess, self._border)
        except ContinuationError:  # at another distance there may be one; else `starts` raises
            return None
        harmonics = (len(orbit.coefficients) - 1) // 2
        change = orbit.coefficients - resize(parent.coefficients, harmonics)
        basis = balance.basis
        along = float(
            basis.pack(basis.compress(self.direction)) @ basis.pack(basis.compress(change))
        )
        along += self.rate * (orbit.rate - parent.rate)
        off = abs(along - step) > REACHED * distance
        # the same distance in this direction may be had elsewhere, far along this or another branch
        moved = max(float(np.linalg.norm(change)), abs(orbit.rate - parent.rate))
        return None if off or moved > NEAR * distance else orbit

    def _border(self, balance: HarmonicBalance) -> Array:
        direction = balance.basis.pack(balance.basis.compress(self.direction))
        return np.append(direction, self.rate)

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

    def symmetric(self, orbit: Orbit) -> Orbit:
        """The orbit without what breaks the symmetry, in its own period."""
        harmonics = (len(orbit.coefficients) - 1) // 2
        kept = np.where(self.fixed.rows_mask(harmonics), orbit.coefficients, 0.0)
        return shortened(Orbit(kept, orbit.rate, orbit.period_multiple), self.factor)

    def back(self, series: Series) -> float | None:
        """Where the branch comes back to the bifurcation it starts at."""
        return self.end(series)

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


class Crossing(Bifurcation):
    """A branch that crosses another one inside its support: what it breaks is no change of sign.

    direction : null vector of the balance and the rate, normal to the parent
    stops : orbits of other branch points, at which the branch may end
    """

    def __init__(
        self,
        system: ScaledSystem,
        parent: Support,
        orbit: Orbit,
        kind: Kind,
        direction: Array,
        settings: Settings,
        rate: float,
        stops: Sequence[Orbit],
    ) -> None:
        super().__init__(system, parent, orbit, kind, direction, settings)
        self.rate, self.stops = rate, list(stops)

    def outside(self, series: Series) -> Array:
        """Coefficients (order + 1, 1) of the step along the direction, from the branch point on."""
        basis = series.balance.basis
        packed = basis.pack(basis.compress(self.direction))
        origin = float(packed @ basis.pack(basis.compress(self.orbit.coefficients)))
        along = series.coefficients @ packed + self.rate * series.rates
        along[: len(series.denominator)] -= (
            origin + self.rate * self.orbit.rate
        ) * series.denominator
        return np.asarray(along[:, None])

    def end(self, series: Series) -> float | None:
        """Where the branch meets another branch point, if it does: it is crossed there, or, where
        two halves are images of each other, its rate turns.
        """
        places = series.folds(0.0, series.length)
        for stop in self.stops:
            for a in [*places, *series.crossings(stop.rate)]:
                if self._at(self.tracer.orbit(series, a), stop):
                    return a
        return None

    def back(self, series: Series) -> float | None:
        """Where the branch comes back to the branch point it starts at."""
        outside = self.outside(series)
        for root in real_roots(outside @ outside[0], series.length):
            if self._at(self.tracer.orbit(series, root), self.orbit):
                return root
        return None

    def is_end(self, orbit: Orbit, extent: float) -> bool:
        return any(self._at(orbit, stop) for stop in (self.orbit, *self.stops))

    def _at(self, orbit: Orbit, stop: Orbit) -> bool:
        near = abs(orbit.rate - stop.rate) < NEAR_STOP * stop.rate
        return near and same_orbit(orbit, stop, NEAR_STOP)


def _alike(one: float, two: float) -> bool:
    """Whether two changes of frequency are those of images."""
    return abs(one - two) < IMAGES * max(abs(one), abs(two), LEAST_CHANGE)


def real_roots_low(coefficients: Array, length: float) -> float | None:
    """The negative root closest to zero, within one step length."""
    mirrored = coefficients * (-1.0) ** np.arange(len(coefficients))
    roots = real_roots(mirrored, length)
    return -roots[0] if roots else None
