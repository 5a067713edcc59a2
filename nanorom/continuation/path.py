"""A traced branch with its multipliers at chosen points: the object on which special points are found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .floquet import FloquetSolver
from .harmonics import differentiate, fourier_matrix
from .series import Series
from .system import Array
from .trace import Orbit, Tracer

PHASE_SPACING = 0.5  # rad that the fastest mode may gain per period between two points


@dataclass(frozen=True)
class Place:
    """A point of a path: step number and parameter inside the step."""

    step: int
    a: float


class Path:
    """Steps of one branch in order, and the maps (period or half period) evaluated on it so far."""

    def __init__(self, tracer: Tracer, floquet: FloquetSolver, steps: list[Series]) -> None:
        self.tracer, self.floquet, self.steps = tracer, floquet, steps
        self.symmetric = tracer.support.symmetric
        lengths = [step.length - step.start for step in steps]
        self.offsets = np.concatenate([[0.0], np.cumsum(lengths)])

    def position(self, place: Place) -> float:
        """Distance from the start of the path."""
        return float(self.offsets[place.step] + place.a - self.steps[place.step].start)

    def place(self, position: float) -> Place:
        step = int(np.clip(np.searchsorted(self.offsets, position) - 1, 0, len(self.steps) - 1))
        return Place(step, float(position - self.offsets[step] + self.steps[step].start))

    def orbit(self, place: Place) -> Orbit:
        return self.tracer.orbit(self.steps[place.step], place.a)

    def rate_slope(self, place: Place) -> float:
        return self.steps[place.step].rate_slope(place.a)

    def initial_places(self) -> list[Place]:
        """Both ends of every step and as many points inside as the phases of the multipliers ask for."""
        places = []
        margin = 1e-3 * (self.steps[0].length - self.steps[0].start)
        for number, step in enumerate(self.steps):
            first, last = step.start, step.length
            if number == 0:
                places.append(Place(0, first + margin))
            periods = 2 * np.pi / np.array([step.rate(first), step.rate(last)])
            count = max(2, int(np.ceil(abs(periods[1] - periods[0]) * self.floquet.fastest / PHASE_SPACING)))
            places += [Place(number, first + (last - first) * i / count) for i in range(1, count + 1)]
        return places

    def maps_eigenvalues(self, places: list[Place]) -> Array:
        """Eigenvalues (n, 2L) of the half-period map if the path is symmetric, else of the period map."""
        orbits = [self.orbit(place) for place in places]
        result = np.empty((len(places), 2 * self.tracer.system.size), dtype=complex)
        sizes = np.array([len(orbit.coefficients) for orbit in orbits])
        for size in np.unique(sizes):
            members = np.flatnonzero(sizes == size)
            maps = self.floquet.monodromy(
                np.stack([orbits[i].coefficients for i in members]),
                np.array([orbits[i].rate for i in members]),
                self.tracer.period_multiple,
                self.tracer.support,
            )
            result[members] = np.linalg.eigvals(maps)
        return result


def orbit_state(orbit: Orbit) -> Array:
    """(q, q') at forcing phase 0, (2L,)."""
    values = fourier_matrix(np.array(0.0), (len(orbit.coefficients) - 1) // 2)
    return np.concatenate([values @ orbit.coefficients, orbit.rate * (values @ differentiate(orbit.coefficients))])


def orbit_amplitudes(coefficients: Array) -> Array:
    """max |q_r| over a period of each orbit; coefficients (n, 2H + 1, L), result (n, L)."""
    harmonics = (coefficients.shape[1] - 1) // 2
    count = 8 * harmonics + 8
    angles = 2 * np.pi / count * np.arange(count)
    values = np.abs(fourier_matrix(angles, harmonics) @ coefficients)
    best = values.max(axis=1)
    where = angles[values.argmax(axis=1)]
    slope = np.stack([differentiate(c) for c in coefficients])
    bend = np.stack([differentiate(c) for c in slope])
    for _ in range(3):
        table = fourier_matrix(where, harmonics)
        first = np.einsum("nlf,nfl->nl", table, slope)
        second = np.einsum("nlf,nfl->nl", table, bend)
        move = np.divide(-first, second, out=np.zeros_like(first), where=second != 0)
        where = where + np.clip(move, -2 * np.pi / count, 2 * np.pi / count)
    refined = np.abs(np.einsum("nlf,nfl->nl", fourier_matrix(where, harmonics), coefficients))
    return np.maximum(best, refined)
