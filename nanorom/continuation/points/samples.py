"""Monodromy matrices of a path at some points, and what is interpolated between them.

They are analytic along the path: eigenvalues of interpolated ones tell where multipliers may become
critical, and leaving one point out tells where the interpolation is poor.
"""

from __future__ import annotations

import numpy as np

from nanorom.continuation.arrays import slices
from nanorom.continuation.branches.path import Path, Place
from nanorom.continuation.orbits.pairs import Index
from nanorom.types import Array, Numbers

STENCIL = 6  # points of an interpolation
SAMPLES = 4  # interpolated subdivisions between two points
LEVELS = 3  # of subdivision where multipliers may meet
LEAVE_ONE_OUT = 0.05  # of a multiplier, or of 1 within the circle
INSIDE = 0.5  # modulus of multipliers that will not soon be critical
APART = 1e-6  # of an average step: places closer than that are one


class Samples:
    """Points of a path, in order, whose monodromy matrices are known.

    Attributes
    ----------
    places, positions : of the points; eigenvalues : (n, 2L) of their matrices.
    couples : numbers of the eigenvalues that may meet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.couples = path.floquet.pairs(path.tracer.support)
        self.places: list[Place] = []
        self.positions = np.empty(0)
        self.eigenvalues = np.empty((0, 2 * path.tracer.system.size), dtype=complex)
        self._maps = np.empty((0, path.entries))
        self._between: dict[tuple[float, float], tuple[Array, Array, Array]] = {}
        self._left_out: dict[tuple[float, ...], float] = {}
        self.insert(path.initial_places())

    def __len__(self) -> int:
        return len(self.places)

    def insert(self, places: list[Place], apart: float = APART) -> bool:
        """Evaluate new places, unless they are there already."""
        positions = np.array([self.path.position(place) for place in places])
        fresh: list[int] = []
        least = apart * self.path.offsets[-1] / len(self.path.steps)
        for i in np.argsort(positions, kind="stable"):
            known = np.append(self.positions, positions[fresh])
            if np.abs(known - positions[i]).min(initial=np.inf) > least:
                fresh.append(int(i))
        if not fresh:
            return False
        everything = self.places + [places[i] for i in fresh]
        positions = np.append(self.positions, positions[fresh])
        order = np.argsort(positions, kind="stable")
        maps, eigenvalues = self.path.maps([places[i] for i in fresh])
        self.positions = positions[order]
        self._maps = np.concatenate([self._maps, maps])[order]
        self.eigenvalues = np.concatenate([self.eigenvalues, eigenvalues])[order]
        self.places = [everything[i] for i in order]
        return True

    def only(self, positions: Array) -> None:
        """Keep the points at some of their positions alone."""
        kept = np.flatnonzero(np.isin(self.positions, positions))
        self.places = [self.places[i] for i in kept]
        self.positions, self.eigenvalues = self.positions[kept], self.eigenvalues[kept]
        self._maps = self._maps[kept]

    def unresolved(self) -> list[Place]:
        """Points between neighbours where leaving one point out shows a poor interpolation."""
        s, count = self.positions, len(self.positions)
        stencils = [near[near != i] for i, near in enumerate(_stencils(s, STENCIL + 1))]
        keys = [(s[i], *s[near]) for i, near in enumerate(stencils)]
        fresh = [i for i in range(count) if keys[i] not in self._left_out]
        if fresh:
            maps = [
                _lagrange(s[near], s[i : i + 1])[0] @ self._maps[near]
                for i, near in ((i, stencils[i]) for i in fresh)
            ]
            errors = _apart(self.eigenvalues[fresh], self.path.eigenvalues(np.array(maps)))
            self._left_out.update({keys[i]: error for i, error in zip(fresh, errors)})
        poor = [i for i in range(count) if self._left_out[keys[i]] > LEAVE_ONE_OUT]
        return [
            self.path.place((s[i] + s[j]) / 2)
            for i in poor
            for j in (i - 1, i + 1)
            if 0 <= j < count
        ]

    def between(self) -> tuple[Array, Array, Array]:
        """Positions, eigenvalues and slopes of the rate at the points and at interpolated places
        between them.
        """
        s = self.positions
        fresh = [i for i in range(len(s) - 1) if (s[i], s[i + 1]) not in self._between]
        if fresh:
            self._sample(np.array(fresh))
        between = [self._between[pair] for pair in zip(s[:-1], s[1:])]
        slopes = self.path.rate_slopes(s)
        parts = [(s, self.eigenvalues, slopes), *between]
        positions, eigenvalues, slopes = (np.concatenate(part) for part in zip(*parts))
        order = np.argsort(positions, kind="stable")
        return positions[order], eigenvalues[order], slopes[order]

    def _sample(self, numbers: Array) -> None:
        """Interpolated places after points: more of them where multipliers may meet, leave the
        circle and come back.
        """
        s = self.positions
        # parts of the intervals: which one, start, length, eigenvalues at the start and at the end
        number, start, length = numbers, s[numbers], s[numbers + 1] - s[numbers]
        ends = np.stack([self.eigenvalues[numbers], self.eigenvalues[numbers + 1]], axis=1)
        periods = 2 * np.pi / np.array([self.path.rate(place) for place in self.places])
        turn = np.abs(np.diff(periods))[numbers] * self.path.floquet.fastest
        found: list[tuple[Numbers, Array, Numbers]] = []
        for _ in range(LEVELS):
            length = length / SAMPLES
            places = start[:, None] + length[:, None] * np.arange(1, SAMPLES)
            values = self.path.eigenvalues(self._maps_at(number, places))
            values = values.reshape(*places.shape, -1).astype(complex)
            found.append((number.repeat(SAMPLES - 1), places.ravel(), values))
            chain = np.concatenate([ends[:, :1], values, ends[:, 1:]], axis=1)
            ends = np.stack([chain[:, :-1], chain[:, 1:]], axis=2).reshape(-1, 2, values.shape[-1])
            turn = turn.repeat(SAMPLES) / SAMPLES
            kept = np.flatnonzero(_may_meet(ends[:, 0], ends[:, 1], turn, self.couples))
            if not len(kept):
                break
            start = np.column_stack([start, places]).ravel()[kept]
            number, length = number.repeat(SAMPLES)[kept], length.repeat(SAMPLES)[kept]
            ends, turn = ends[kept], turn[kept]
        number, places = (np.concatenate([part[i] for part in found]) for i in (0, 1))
        values = np.concatenate([part[2].reshape(-1, ends.shape[-1]) for part in found])
        slopes = self.path.rate_slopes(places)
        for i in numbers:
            members = number == i
            self._between[s[i], s[i + 1]] = places[members], values[members], slopes[members]

    def _maps_at(self, numbers: Array, places: Array) -> Array:
        """Interpolated maps at places (n, m), each row after the point of that number."""
        result = np.empty((*places.shape, self._maps.shape[1]))
        for i in np.unique(numbers):
            rows = numbers == i
            near = _stencil(self.positions, i + 0.5, STENCIL)
            weights = _lagrange(self.positions[near], places[rows].ravel())
            result[rows] = (weights @ self._maps[near]).reshape(-1, *result.shape[1:])
        return result.reshape(-1, result.shape[-1])

    def eigenvalues_after(self, number: int, position: float) -> Numbers:
        """Interpolated ones (1, 2L) at a position after a point."""
        near = _stencil(self.positions, number + 0.5, STENCIL)
        weights = _lagrange(self.positions[near], np.array([position]))[0]
        return self.path.eigenvalues((weights @ self._maps[near])[None])


def _stencil(positions: Array, centre: float, count: int) -> Numbers:
    """Indices of `count` neighbouring points around an index (or between two)."""
    count = min(count, len(positions))
    first = int(np.clip(np.ceil(centre - count / 2), 0, len(positions) - count))
    return np.arange(first, first + count)


def _stencils(positions: Array, count: int) -> list[Array]:
    """Indices of the neighbours of every point, itself among them."""
    return [_stencil(positions, i, count) for i in range(len(positions))]


def _apart(eigenvalues: Array, predicted: Array) -> Array:
    """Largest distance (n,) of an eigenvalue from the nearest predicted one, both (n, 2L)."""
    sizes = np.abs(eigenvalues)
    gaps = _nearest(eigenvalues, predicted)
    return np.asarray(np.where(sizes > INSIDE, gaps / np.maximum(1.0, sizes), 0.0).max(axis=1))


def _nearest(values: Array, others: Array) -> Array:
    """Distance (n, 2L) of every value from the nearest of others, both (n, 2L)."""
    found = np.empty(values.shape)
    for some in slices(len(values), values.shape[1] ** 2):
        gaps = np.abs(values[some, :, None] - others[some, None, :])
        np.min(gaps, axis=2, out=found[some])
    return found


def _may_meet(before: Array, after: Array, turn: Array, couples: tuple[Index, Index]) -> Array:
    """Whether two eigenvalues may meet and pass the unit circle between samples (n, 2L), while the
    fastest turns by `turn` (n,).

    From inside the circle they leave it only after they met; while they pass each other at a speed
    v, by d at most where (mu_i - mu_j)^2 = v^2 s^2 - 4 d^2, so that they stay joined for 4 d / v.
    """
    # to the nearest: of two that change places it says nothing, but they turn
    changed = _nearest(before, after) + turn[:, None]
    first, second = couples
    found = np.empty(len(before), dtype=bool)
    for some in slices(len(before), len(first)):
        here = before[some]
        moved = changed[some][:, first] + changed[some][:, second]
        gaps = np.abs(here[:, first] - here[:, second])
        size = np.minimum(np.abs(here[:, first]), np.abs(here[:, second]))
        meeting = (gaps < moved) & (moved > 4 * np.abs(1 - size)) & (size > INSIDE)
        np.any(meeting, axis=1, out=found[some])
    return found


def _lagrange(nodes: Array, positions: Array) -> Array:
    """Weights (positions, nodes) of polynomial interpolation."""
    diagonal = np.eye(len(nodes), dtype=bool)
    gaps = np.where(diagonal, 1.0, nodes[:, None] - nodes[None, :])
    ratios = (positions[:, None] - nodes)[:, None, :] / gaps
    return np.asarray(np.where(diagonal, 1.0, ratios).prod(axis=2))
