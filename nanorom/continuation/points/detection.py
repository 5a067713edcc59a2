"""Special points of a path: detection without stepping over pairs, and location.

The conditions and their test functions are those of `orbits.bifurcations`; folds are roots of a
polynomial in every step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from nanorom.continuation.branches.path import Path, Place
from nanorom.continuation.orbits.bifurcations import (
    CROSSED,
    FOLD,
    REAL,
    Condition,
    Kind,
    conditions,
    crossed_kind,
    outside,
    test_function,
)
from nanorom.continuation.orbits.coordinates import pairs
from nanorom.continuation.orbits.pairs import Index
from nanorom.continuation.points.crossings import crossings
from nanorom.continuation.points.tongues import bottom, dips
from nanorom.types import Array, Numbers

ROUNDS = 8
MOST_POINTS = 1200  # at which adding points ends, unless the first ones are that many
STENCIL = 6  # points of an interpolation
DEEP = 0.7  # log of a dip between two samples that deserves a point of its own
SAMPLES = 4  # interpolated subdivisions between two points
LEVELS = 3  # of subdivision where multipliers may meet
LEAVE_ONE_OUT = 0.05  # of a multiplier, or of 1 within the circle
INSIDE = 0.5  # modulus of multipliers that will not soon be critical
GOOD_ESTIMATE = 3e-3  # of a multiplier at an interpolated root, which then needs no search
ROOT_TOLERANCE = 0.1  # of a located root; polishing and shooting decide
LOCATED = 1e-7  # of an interval: multipliers change by thousands within one
ESTIMATED = 1e-3  # of an interval: interpolated roots
ROUND_OFF = 1e-12  # of a place within a step
APART = 1e-6  # of an average step: places closer than that are one
NEARLY_EQUAL = 1e-3  # squared frequencies, relative: their multipliers may cross together
IN_TONGUE = 1e-2  # of the damping, to which ends of tongues are located
MANY = 0.2  # of the points: so many poor ones are mended before anything else is looked for
LOGS, STEEP = 600.0, 50.0  # logarithms whose exponentials are still numbers, and of use
LEAST_GAIN = 0.3  # of a sample, by which the vertex of a parabola must lie below it
AT_SAMPLE = 1e-3  # of a stencil: a vertex so close to the middle sample is no news
GRID = 64  # places of a vertex in a stencil, so that round-off does not move the point
WITHIN = 0.9  # of the way to the neighbours


@dataclass(frozen=True)
class Detected:
    """A special point of a path, before it is polished and confirmed.

    bracket: condition and points around a place that is estimated only; multiplicity: how many
    multipliers (or pairs) are critical at once.
    """

    kind: Kind
    place: Place
    bracket: tuple[Condition, Place, Place] | None = None
    multiplicity: int = 1


class Detector:
    """Finds the special points of one path; the points it evaluates on the way become points of the
    branch.

    Monodromy matrices are known at some points and are analytic between them, so their
    interpolation tells where a test function may change sign or dip; only there they are evaluated
    again. A leave-one-out test adds points where the interpolation is not good enough.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        size = 2 * path.tracer.system.size
        self.couples = path.floquet.pairs(path.tracer.support)
        self.places: list[Place] = []
        self.positions = np.empty(0)
        self.maps = np.empty((0, path.entries))
        self.eigenvalues = np.empty((0, size), dtype=complex)
        self.paired = bool(pairs(path.tracer.system, NEARLY_EQUAL))
        self.conditions = conditions(path.tracer.system.size)
        self._between: dict[tuple[float, float], tuple[Array, Array, Array]] = {}
        self._left_out: dict[tuple[float, ...], float] = {}
        self._insert(path.initial_places())

    def find(self) -> list[Detected]:
        """All special points in order along the path."""
        most = max(3 * len(self.places), MOST_POINTS)
        for _ in range(ROUNDS):
            if len(self.places) > most:  # multipliers beyond interpolation: exact points must do
                break
            wanted = self._unresolved()
            wanted += self._suspicious() if len(wanted) < MANY * len(self.places) else []
            if not self._insert(wanted):
                break
        if self.path.tracer.accuracy.tongues:
            self._insert(self._in_tongues(), apart=ROUND_OFF)
        found = self._folds()
        for condition in self.conditions:
            found += self._roots(condition)
        found += self._uncounted(found)
        return sorted(found, key=lambda point: self.path.position(point.place))

    def _uncounted(self, found: list[Detected]) -> list[Detected]:
        """What crosses the circle between neighbours beside the points found there."""
        counts = outside(self.eigenvalues)
        places = np.array([self.path.position(point.place) for point in found])
        missed: list[Detected] = []
        for i in range(len(counts) - 1):
            ends = float(self.positions[i]), float(self.positions[i + 1])
            inside = np.flatnonzero((places >= ends[0]) & (places <= ends[1]))
            crossed = sum(found[j].kind.multipliers for j in inside)
            change = abs(counts[i + 1] - counts[i])
            if change > crossed or (crossed and self.paired):
                values = self.eigenvalues[i], self.eigenvalues[i + 1]
                others = crossings(self.path, ends, values, np.sort(places[inside]))
                missed += [Detected(kind, place, multiplicity=m) for kind, place, m in others]
        return missed

    def _in_tongues(self) -> list[Place]:
        """Points inside tongues that are too narrow for any sampling."""
        samples, eigenvalues, slopes = self._interpolated()
        wanted: list[float] = []
        for condition in self.conditions:

            def value(position: float, condition: Condition = condition) -> tuple[float, float]:
                place = self.path.place(position)
                values = self.path.maps([place])[1]
                slope = np.array([self.path.rate_slope(place)])
                signs, logs = test_function(condition, values, slope, self.couples)
                return float(signs[0]), float(logs[0])

            signs, logs = test_function(condition, eigenvalues, slopes, self.couples)
            for i in dips(signs, logs):
                place = bottom(value, samples[i - 1 : i + 2])
                if place is not None:
                    wanted.append(place)
        return [self.path.place(position) for position in wanted]

    def _insert(self, places: list[Place], apart: float = APART) -> bool:
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
        self.maps = np.concatenate([self.maps, maps])[order]
        self.eigenvalues = np.concatenate([self.eigenvalues, eigenvalues])[order]
        self.places = [everything[i] for i in order]
        return True

    def _unresolved(self) -> list[Place]:
        """Points between neighbours where leaving one point out shows a poor interpolation."""
        s, count = self.positions, len(self.positions)
        stencils = [near[near != i] for i, near in enumerate(_stencils(s, STENCIL + 1))]
        keys = [(s[i], *s[near]) for i, near in enumerate(stencils)]
        fresh = [i for i in range(count) if keys[i] not in self._left_out]
        if fresh:
            maps = [
                _lagrange(s[near], s[i : i + 1])[0] @ self.maps[near]
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

    def _suspicious(self) -> list[Place]:
        """Points next to sign changes and dips of the interpolated test functions."""
        samples, eigenvalues, slopes = self._interpolated()
        exact = np.isin(samples, self.positions)
        number = np.cumsum(exact)  # of the interval that begins at a sample
        wanted: list[float] = []
        for condition in self.conditions:
            signs, logs = test_function(condition, eigenvalues, slopes, self.couples)
            changes = np.flatnonzero(signs[1:] != signs[:-1])
            # one between two points is a root to be located, more of them want points between
            interval, count = np.unique(number[changes], return_counts=True)
            for i in changes[np.isin(number[changes], interval[count > 1])]:
                wanted += [samples[i], samples[i + 1]]
            inner = np.arange(1, len(samples) - 1)
            dips = inner[(logs[inner] < logs[inner - 1]) & (logs[inner] < logs[inner + 1])]
            for i in dips:
                if signs[i - 1] == signs[i] == signs[i + 1]:
                    vertex = _vertex(samples[i - 1 : i + 2], logs[i - 1 : i + 2])
                    if vertex is not None:
                        wanted.append(vertex)
                    elif not exact[i] and logs[i] < min(logs[i - 1], logs[i + 1]) - DEEP:
                        wanted.append(samples[i])
        return [self.path.place(position) for position in wanted]

    def _interpolated(self) -> tuple[Array, Array, Array]:
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
        result = np.empty((*places.shape, self.maps.shape[1]))
        for i in np.unique(numbers):
            rows = numbers == i
            near = _stencil(self.positions, i + 0.5, STENCIL)
            weights = _lagrange(self.positions[near], places[rows].ravel())
            result[rows] = (weights @ self.maps[near]).reshape(-1, *result.shape[1:])
        return result.reshape(-1, result.shape[-1])

    def _folds(self) -> list[Detected]:
        found = []
        for number, step in enumerate(self.path.steps):
            found += [Detected(FOLD, Place(number, a)) for a in step.folds(step.start, step.length)]
        return found

    def _roots(self, condition: Condition) -> list[Detected]:
        slopes = self.path.rate_slopes(self.positions)
        signs, _ = test_function(condition, self.eigenvalues, slopes, self.couples)
        found = []
        for i in np.flatnonzero(signs[1:] != signs[:-1]):
            if condition == "circle" and _neutral(*self.eigenvalues[i : i + 2]):
                continue
            ends = self.places[i], self.places[i + 1]
            point = None
            # in a narrow tongue an estimate may lead to its other end
            if not self.path.tracer.accuracy.tongues:
                point = self._classify(condition, self._estimate(condition, i), GOOD_ESTIMATE)
            if point is not None:
                point = replace(point, bracket=(condition, *ends))
            else:
                point = self._located(condition, *ends)
            if point is not None:
                found.append(point)
        return found

    def located(self, detected: Detected) -> Detected | None:
        """The same point from exact multipliers, if it was an estimate."""
        return None if detected.bracket is None else self._located(*detected.bracket)

    def _located(self, condition: Condition, low: Place, high: Place) -> Detected | None:
        place = self._locate(condition, low, high)
        return self._classify(condition, place, ROOT_TOLERANCE) if place else None

    def _estimate(self, condition: Condition, number: int) -> Place:
        """Where the interpolated test function is zero after a point: exact at the points, it has
        their signs.
        """
        s = self.positions
        near = _stencil(s, number + 0.5, STENCIL)

        def value(position: float) -> float:
            weights = _lagrange(s[near], np.array([position]))[0]
            eigenvalues = self.path.eigenvalues((weights @ self.maps[near])[None])
            slope = self.path.rate_slope(self.path.place(position))
            signs, logs = test_function(condition, eigenvalues, np.array([slope]), self.couples)
            return float(signs[0] * np.exp(np.clip(logs[0], -LOGS, LOGS)))

        low, high = s[number], s[number + 1]
        try:
            return self.path.place(brentq(value, low, high, xtol=ESTIMATED * (high - low)))
        except ValueError:  # round-off: a point is itself the zero
            return self.path.place(low)

    def _locate(self, condition: Condition, low: Place, high: Place) -> Place | None:
        step = low.step
        last = high.a if high.step == step else self.path.steps[step].length
        reference: float | None = None

        def value(a: float) -> float:
            nonlocal reference
            place = Place(step, a)
            eigenvalues = self.path.maps([place])[1]
            slope = np.array([self.path.rate_slope(place)])
            signs, logs = test_function(condition, eigenvalues, slope, self.couples)
            if reference is None:
                reference = float(logs[0])
            return float(signs[0] * np.exp(np.clip(logs[0] - reference, -LOGS, LOGS)))

        closest = min(LOCATED * (last - low.a), IN_TONGUE * self.path.tracer.accuracy.loss)
        try:
            return Place(step, float(brentq(value, low.a, last, xtol=closest, rtol=ROUND_OFF)))
        except ValueError:
            return None

    def _classify(self, condition: Condition, place: Place, tolerance: float) -> Detected | None:
        """The kind of a root, or nothing where the test function vanishes for another reason (a
        real pair with product one is a neutral saddle, not a torus).
        """
        eigenvalues = self.path.maps([place])[1][0]
        close = CROSSED[condition].distance(eigenvalues) < tolerance
        return Detected(crossed_kind(condition, self.path.symmetric), place) if close else None


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
    gaps = np.abs(eigenvalues[:, :, None] - predicted[:, None, :]).min(axis=2)
    return np.asarray(np.where(sizes > INSIDE, gaps / np.maximum(1.0, sizes), 0.0).max(axis=1))


def _may_meet(before: Array, after: Array, turn: Array, couples: tuple[Index, Index]) -> Array:
    """Whether two eigenvalues may meet and pass the unit circle between samples (n, 2L), while the
    fastest turns by `turn` (n,).

    From inside the circle they leave it only after they met; while they pass each other at a speed
    v, by d at most where (mu_i - mu_j)^2 = v^2 s^2 - 4 d^2, so that they stay joined for 4 d / v.
    """
    # to the nearest: of two that change places it says nothing, but they turn
    moved = np.abs(before[:, :, None] - after[:, None, :]).min(axis=2) + turn[:, None]
    first, second = couples
    moved = moved[:, first] + moved[:, second]
    gaps = np.abs(before[:, first] - before[:, second])
    size = np.minimum(np.abs(before[:, first]), np.abs(before[:, second]))
    meeting = (gaps < moved) & (moved > 4 * np.abs(1 - size)) & (size > INSIDE)
    return np.asarray(meeting.any(axis=1))


def _lagrange(nodes: Array, positions: Array) -> Array:
    """Weights (positions, nodes) of polynomial interpolation."""
    diagonal = np.eye(len(nodes), dtype=bool)
    gaps = np.where(diagonal, 1.0, nodes[:, None] - nodes[None, :])
    ratios = (positions[:, None] - nodes)[:, None, :] / gaps
    return np.asarray(np.where(diagonal, 1.0, ratios).prod(axis=2))


def _neutral(before: Array, after: Array) -> bool:
    """Whether real pairs with product one alone make the torus function change sign."""

    def split(values: Array) -> tuple[int, int, int]:
        # a real pair may turn complex, cross the circle and be real again
        complex_ones, outside = np.abs(values.imag) > REAL, np.abs(values) > 1
        return complex_ones.sum(), (complex_ones & outside).sum(), outside.sum()

    return split(before) == split(after)


def _vertex(positions: Array, logs: Array) -> float | None:
    """Where a parabola through three values has its minimum, if that is worth another point."""
    values = np.exp(np.clip(logs - logs[1], -STEEP, STEEP))
    left, right = positions[0] - positions[1], positions[2] - positions[1]
    bend = ((values[2] - 1) / right - (values[0] - 1) / left) / (right - left)
    slope = (values[2] - 1) / right - bend * right
    if bend <= 0:
        return None
    vertex = -slope / (2 * bend)
    gain = slope**2 / (4 * bend)
    if gain < LEAST_GAIN or abs(vertex) < AT_SAMPLE * (right - left):
        return None
    # on a grid, so that round-off does not move the point
    vertex = float(np.round(GRID * vertex / (right - left)) / GRID * (right - left))
    vertex = float(np.clip(vertex, WITHIN * left, WITHIN * right))
    return float(positions[1] + vertex)
