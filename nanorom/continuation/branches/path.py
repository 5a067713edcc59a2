"""A traced branch with its multipliers at chosen points: the object on which special points are
found.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.harmonics import turned
from nanorom.continuation.orbits.orbit import SAME_ORBIT, Orbit, orbit_state, same_orbit
from nanorom.continuation.orbits.turns import nearest
from nanorom.types import Array, Numbers

ARC_POINTS = 33
LEAST_POINTS = 60  # on a branch, for a smooth picture; half as many where they cost most
FEW_MODES = 4
TAYLOR_SPACING = 2.0  # lengths of a Taylor series between two points
PHASE_SPACING = 0.5  # rad that the fastest mode may gain per period between two points
MOST_TURNS = 4e5  # rad of the fastest mode, of all points of a system of one mode together
TURNED = 1e-6  # of an orbit: changes by a rotation
NEARBY = 1e-4  # of an orbit that a step is to pass: series are less exact than orbits
MARGIN = 5e-4  # of a step at the ends of a path, where a bifurcation may be


@dataclass(frozen=True)
class Place:
    """A point of a path: step number and parameter inside the step."""

    step: int
    a: float


class Path:
    """Steps of one branch in order, with the arc length along it."""

    def __init__(self, tracer: Tracer, floquet: FloquetSolver, steps: list[Series]) -> None:
        self.tracer, self.floquet, self.steps = tracer, floquet, steps
        self.generators: list[Array] = []  # of rotations that turn its orbits into others
        self.coarse = False  # fewer points than the phases of the multipliers ask for
        self.symmetric = floquet.signs(tracer.support) is not None
        self._arcs = [_arc_length(step) for step in steps]
        self.offsets = np.concatenate([[0.0], np.cumsum([length[-1] for _, length in self._arcs])])
        self._ends = self.offsets.tolist()

    def position(self, place: Place) -> float:
        """Arc length from the start of the path."""
        return float(self.offsets[place.step] + np.interp(place.a, *self._arcs[place.step]))

    def place(self, position: float) -> Place:
        number = min(max(bisect_left(self._ends, position) - 1, 0), len(self.steps) - 1)
        parameter, length = self._arcs[number]
        return Place(number, float(np.interp(position - self.offsets[number], length, parameter)))

    def orbit(self, place: Place) -> Orbit:
        return self.tracer.orbit(self.steps[place.step], place.a)

    def contains(self, orbit: Orbit) -> bool:
        """Whether the path passes through an orbit (or through it a period of the drive later)."""
        return self.passing(orbit, SAME_ORBIT) is not None

    def rate(self, place: Place) -> float:
        return self.steps[place.step].rate(place.a)

    def rate_slope(self, place: Place) -> float:
        return self.steps[place.step].rate_slope(place.a)

    def rate_slopes(self, positions: Array) -> Array:
        """Slopes of the rate (n,) at arc lengths (n,) in order."""
        numbers = np.clip(np.searchsorted(self.offsets, positions) - 1, 0, len(self.steps) - 1)
        slopes = np.empty(len(positions))
        for number in np.unique(numbers):
            members = numbers == number
            parameter, length = self._arcs[number]
            a = np.interp(positions[members] - self.offsets[number], length, parameter)
            slopes[members] = self.steps[number].rate_slopes(a)
        return slopes

    def initial_places(self) -> list[Place]:
        """The expansion points of the steps, the end, and as many points between as the
        multipliers' phases ask for.
        """
        places = []
        for number, (step, count) in enumerate(zip(self.steps, self._counts())):
            first, last = step.start, step.length
            if number == 0:
                first += MARGIN * (last - first)
            places += [Place(number, first + (last - first) * i / count) for i in range(count)]
        last_step = self.steps[-1]
        margin = MARGIN * (last_step.length - last_step.start)
        return places + [Place(len(self.steps) - 1, last_step.length - margin)]

    def _counts(self) -> list[int]:
        """How many points each step is to have; fewer than the phases ask for, if those are so many
        that their periods together would cost too much.
        """
        if self.tracer.ending == "work":
            return [1] * len(self.steps)
        least = LEAST_POINTS if self.tracer.system.size <= FEW_MODES else LEAST_POINTS // 2
        ends = np.array([[step.rate(step.start), step.rate(step.length)] for step in self.steps])
        phases = 2 * np.pi / ends * self.floquet.fastest
        asked = np.abs(phases[:, 1] - phases[:, 0]) / PHASE_SPACING
        most = MOST_TURNS / self.tracer.system.size
        thinned = max(1.0, float((asked * phases.mean(axis=1)).sum()) / most)
        self.coarse = thinned > 1.0
        lengths = [
            (step.length - step.start) / (TAYLOR_SPACING * step.taylor) for step in self.steps
        ]
        smooth = -(-least // len(self.steps))
        return [
            max(1, int(np.ceil(phase / thinned)), smooth, int(np.ceil(length)))
            for phase, length in zip(asked, lengths)
        ]

    def maps(self, places: list[Place]) -> tuple[Array, Array]:
        """Monodromy matrices (n, d), their independent parts flattened, and their eigenvalues (n,
        2L); over half a period, with the symmetry applied, if the path is symmetric.
        """
        orbits = [self.orbit(place) for place in places]
        size = 2 * self.tracer.system.size
        result = np.empty((len(places), self.entries))
        eigenvalues = np.empty((len(places), size), dtype=complex)
        rows = np.array([len(orbit.coefficients) for orbit in orbits])
        for count in np.unique(rows):
            members = np.flatnonzero(rows == count)
            result[members], eigenvalues[members] = self.monodromy(
                [orbits[i] for i in members], self.floquet
            )
        return result, eigenvalues

    @property
    def entries(self) -> int:
        """Number of entries d of the matrices of `maps`."""
        whole = (2 * self.tracer.system.size) ** 2
        return whole if self.generators else self.floquet.entries(self.tracer.support)

    def monodromy(self, orbits: Sequence[Orbit], floquet: FloquetSolver) -> tuple[Array, Numbers]:
        """As `maps`, for orbits of one number of harmonics.

        Where the system can be turned, the multiplier 1 along the family of turned orbits is made 0
        (Wielandt's deflation), lest it hides the others.
        """
        coefficients = np.stack([orbit.coefficients for orbit in orbits])
        rates = np.array([orbit.rate for orbit in orbits])
        given = coefficients, rates, self.tracer.period_multiple, self.tracer.support
        if not self.generators:
            return floquet.maps(*given)
        maps = floquet.monodromy(*given)[0]
        states = np.array([orbit_state(orbit) for orbit in orbits])
        for turn in self.generators:
            along = states @ np.kron(np.eye(2), turn).T
            along /= np.linalg.norm(along, axis=1)[:, None]
            factor = np.einsum("ni,nij,nj->n", along, maps, along)
            maps = maps - factor[:, None, None] * along[:, :, None] * along[:, None, :]
        flat = maps.reshape(len(maps), -1)
        return flat, self.eigenvalues(flat)

    def eigenvalues(self, maps: Array) -> Numbers:
        """Eigenvalues (n, 2L) of matrices (n, d) as `maps` returns them."""
        if not self.generators:
            return self.floquet.eigenvalues(maps, self.tracer.support)
        size = 2 * self.tracer.system.size
        return np.linalg.eigvals(maps.reshape(-1, size, size)).astype(complex)

    def turned_by(self, generators: Sequence[Array]) -> None:
        """Take note of the rotations that turn its orbits into others."""
        middle = self.place(self.offsets[-1] / 2)
        coefficients = self.orbit(middle).coefficients
        size = np.abs(coefficients).max(initial=0.0)
        self.generators = [
            turn for turn in generators if np.abs(coefficients @ turn.T).max() > TURNED * size
        ]

    def passing(self, orbit: Orbit, tolerance: float = NEARBY) -> tuple[Series, float] | None:
        """The step and the place in it at which the path passes through an orbit, or through
        another member of its family.
        """
        if orbit.period_multiple != self.tracer.period_multiple:
            return None
        for step in self.steps:
            for root in step.crossings(orbit.rate):
                own = self.tracer.orbit(step, root)
                if any(same_orbit(own, each, tolerance) for each in self._members(orbit, own)):
                    return step, root
        return None

    def _members(self, orbit: Orbit, own: Orbit) -> Iterator[Orbit]:
        """An orbit, and of its family those nearest to one of the path's at each of its periods."""
        yield orbit
        for shift in range(orbit.period_multiple if self.generators else 0):
            moved = turned(orbit.coefficients, 2 * np.pi * shift / orbit.period_multiple)
            turns = nearest(moved, own.coefficients, self.generators)
            yield replace(orbit, coefficients=turns)


def _arc_length(step: Series) -> tuple[Array, Array]:
    """Equidistant values of the parameter of a step and the arc length from its start."""
    a = np.linspace(step.start, step.length, ARC_POINTS)
    speed = np.linalg.norm(step.derivative(a), axis=1)
    return a, cumulative_trapezoid(speed, a, initial=0.0)
