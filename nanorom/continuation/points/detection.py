"""Special points of a path: detection without stepping over pairs, and location.

Kinds and their test functions are those of `orbits.bifurcations`; folds are roots of a
polynomial in every step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from nanorom.continuation.branches.path import Path, Place
from nanorom.continuation.orbits.bifurcations import Kind, crossed, outside, turning
from nanorom.continuation.orbits.coordinates import pairs
from nanorom.continuation.points.crossings import crossings
from nanorom.continuation.points.samples import Samples
from nanorom.continuation.points.tongues import bottom, dips
from nanorom.types import Array

ROUNDS = 8
MOST_POINTS = 1200  # at which adding points ends, unless the first ones are that many
DEEP = 0.7  # log of a dip between two samples that deserves a point of its own
GOOD_ESTIMATE = 3e-3  # of a multiplier at an interpolated root, which then needs no search
BESIDE_OTHERS = 0.2  # of 1/Q: a multiplier so near is the critical one, not one of all the others
BY_IMPOSTOR = 0.1  # of its distance: a neutral saddle, nearer than that, is what was located
ROOT_TOLERANCE = 0.1  # of a located root; polishing and shooting decide
ESTIMATES = (
    4  # of one root: each squares the error of the last, or the search is one by exact values
)
LOCATED = 1e-7  # of an interval: multipliers change by thousands within one
ESTIMATED = 1e-3  # of an interval: interpolated roots
ROUND_OFF = 1e-12  # of a place within a step
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

    bracket: kind and points around a place that is estimated only; multiplicity: how many
    multipliers (or pairs) are critical at once.
    """

    kind: Kind
    place: Place
    bracket: tuple[Kind, Place, Place] | None = None
    multiplicity: int = 1


class Detector:
    """Finds the special points of one path; most points that it evaluates on the way become points
    of the branch.

    The interpolation of `samples` tells where a test function may change sign or dip; only there
    monodromy matrices are evaluated again.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.samples = Samples(path)
        self.couples = self.samples.couples
        self.paired = bool(pairs(path.tracer.system, NEARLY_EQUAL))
        self.kinds = crossed(path.tracer.system.size)

    @property
    def places(self) -> list[Place]:
        """Points of the path whose multipliers are known exactly."""
        return self.samples.places

    @property
    def eigenvalues(self) -> Array:
        """Those (n, 2L) of the monodromy matrices there."""
        return self.samples.eigenvalues

    def find(self) -> list[Detected]:
        """All special points in order along the path."""
        samples = self.samples
        most = max(3 * len(samples), MOST_POINTS)
        # where the branch itself has taken all work, exact points must do, too
        self.path.coarse |= self.path.tracer.ending == "work"
        for _ in range(0 if self.path.tracer.ending == "work" else ROUNDS):
            if len(samples) > most:  # multipliers beyond interpolation: exact points must do
                break
            wanted = samples.unresolved()
            wanted += self._suspicious() if len(wanted) < MANY * len(samples) else []
            if not samples.insert(wanted):
                break
        if self.path.tracer.accuracy.tongues:
            samples.insert(self._in_tongues(), apart=ROUND_OFF)
        found, asked = self._folds(), samples.positions
        for kind in self.kinds:
            found += self._roots(kind)
            samples.only(asked)  # where others cross next to a root, it is no place to look from
        found += self._uncounted(found)
        return sorted(found, key=lambda point: self.path.position(point.place))

    def _uncounted(self, found: list[Detected]) -> list[Detected]:
        """What crosses the circle between neighbours beside the points found there."""
        counts = outside(self.samples.eigenvalues)
        places = np.array([self.path.position(point.place) for point in found])
        missed: list[Detected] = []
        for i in range(len(counts) - 1):
            ends = float(self.samples.positions[i]), float(self.samples.positions[i + 1])
            inside = np.flatnonzero((places >= ends[0]) & (places <= ends[1]))
            crossed = sum(found[j].kind.multipliers for j in inside)
            change = abs(counts[i + 1] - counts[i])
            if change > crossed or (crossed and self.paired):
                values = self.samples.eigenvalues[i], self.samples.eigenvalues[i + 1]
                others = crossings(self.path, ends, values, np.sort(places[inside]))
                missed += [Detected(kind, place, multiplicity=m) for kind, place, m in others]
        return missed

    def _in_tongues(self) -> list[Place]:
        """Points inside tongues that are too narrow for any sampling."""
        samples, eigenvalues, slopes = self.samples.between()
        wanted: list[float] = []
        for kind in self.kinds:

            def value(position: float, kind: Kind = kind) -> tuple[float, float]:
                place = self.path.place(position)
                values = self.path.maps([place])[1]
                slope = np.array([self.path.rate_slope(place)])
                signs, logs = kind.condition.test(values, slope, self.couples)
                return float(signs[0]), float(logs[0])

            signs, logs = kind.condition.test(eigenvalues, slopes, self.couples)
            for i in dips(signs, logs):
                place = bottom(value, samples[i - 1 : i + 2])
                if place is not None:
                    wanted.append(place)
        return [self.path.place(position) for position in wanted]

    def _suspicious(self) -> list[Place]:
        """Points next to sign changes and dips of the interpolated test functions."""
        samples, eigenvalues, slopes = self.samples.between()
        exact = np.isin(samples, self.samples.positions)
        number = np.cumsum(exact)  # of the interval that begins at a sample
        wanted: list[float] = []
        for kind in self.kinds:
            signs, logs = kind.condition.test(eigenvalues, slopes, self.couples)
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

    def _folds(self) -> list[Detected]:
        found = []
        for number, step in enumerate(self.path.steps):
            places = [Place(number, a) for a in step.folds(step.start, step.length)]
            found += [Detected(kind, place) for place in places for kind in turning()]
        return found

    def _roots(self, kind: Kind) -> list[Detected]:
        places, positions, eigenvalues = (
            self.samples.places,
            self.samples.positions,
            self.samples.eigenvalues,
        )
        signs = self._signs(kind, eigenvalues, positions)
        found = []
        for i in np.flatnonzero(signs[1:] != signs[:-1]):
            if kind.condition.is_spurious(*eigenvalues[i : i + 2]):
                continue
            ends = places[i], places[i + 1]
            if self.path.tracer.accuracy.tongues or self.paired:
                found += self._beside_others(kind, int(i), *ends)
            else:
                found += self._estimated(kind, float(positions[i]), float(positions[i + 1]))
        return found

    def _beside_others(self, kind: Kind, number: int, low: Place, high: Place) -> list[Detected]:
        """What is between two points where others may be next to it: from exact multipliers, unless
        an estimate serves at once.
        """
        # in a narrow tongue an estimate may lead to its other end
        estimated, point = not self.path.tracer.accuracy.tongues, None
        if estimated:
            point = self._classify(kind, self._estimate(kind, number), GOOD_ESTIMATE)
        point = point or self._located(kind, low, high, self.nearby)
        if point is None:
            return []
        return [replace(point, bracket=(kind, low, high)) if estimated else point]

    def _signs(self, kind: Kind, eigenvalues: Array, positions: Array) -> Array:
        """Of the test function at arc lengths."""
        slopes = self.path.rate_slopes(positions)
        return kind.condition.test(eigenvalues, slopes, self.couples)[0]

    def _estimated(self, kind: Kind, low: float, high: float) -> list[Detected]:
        """What is between two points where the test function changes sign, from interpolation that
        is made better at every estimate.
        """
        samples, ends = self.samples, (self.path.place(low), self.path.place(high))
        for _ in range(ESTIMATES):
            number = int(np.searchsorted(samples.positions, low))
            place = self._estimate(kind, number)
            if not samples.insert([place]):  # a point itself is the zero
                break
            values = samples.eigenvalues[number + 1]
            if self._is_impostor(kind, values):
                return []
            if kind.distance(values) < GOOD_ESTIMATE:
                return [Detected(kind.at(self.path.symmetric), place, (kind, *ends))]
            chosen = slice(number, number + 3)
            signs = self._signs(kind, samples.eigenvalues[chosen], samples.positions[chosen])
            low = float(samples.positions[number + int(signs[0] == signs[1])])
        point = self._located(kind, *ends, self.nearby)
        return [] if point is None else [replace(point, bracket=(kind, *ends))]

    def _is_impostor(self, kind: Kind, eigenvalues: Array) -> bool:
        """Whether the test function vanishes close by for another reason (a real pair with product
        one is a neutral saddle, not a torus).
        """
        impostor = kind.condition.impostor(eigenvalues)
        return impostor < GOOD_ESTIMATE and BY_IMPOSTOR * kind.distance(eigenvalues) > impostor

    def located(self, detected: Detected) -> Detected | None:
        """The same point from exact multipliers, if it was an estimate."""
        return None if detected.bracket is None else self._located(*detected.bracket)

    @property
    def nearby(self) -> float:
        """Distance of a critical multiplier, much less than that of others, that will do at first:
        none where tongues are narrow.
        """
        accuracy = self.path.tracer.accuracy
        return 0.0 if accuracy.tongues else min(GOOD_ESTIMATE, BESIDE_OTHERS * accuracy.loss)

    def _located(self, kind: Kind, low: Place, high: Place, nearby: float = 0.0) -> Detected | None:
        place = self._locate(kind, low, high, nearby)
        return self._classify(kind, place, ROOT_TOLERANCE) if place else None

    def _estimate(self, kind: Kind, number: int) -> Place:
        """Where the interpolated test function is zero after a point: exact at the points, it has
        their signs.
        """

        def value(position: float) -> float:
            eigenvalues = self.samples.eigenvalues_after(number, position)
            slope = self.path.rate_slope(self.path.place(position))
            signs, logs = kind.condition.test(eigenvalues, np.array([slope]), self.couples)
            return float(signs[0] * np.exp(np.clip(logs[0], -LOGS, LOGS)))

        low, high = self.samples.positions[number : number + 2]
        try:
            return self.path.place(brentq(value, low, high, xtol=ESTIMATED * (high - low)))
        except ValueError:  # round-off: a point is itself the zero
            return self.path.place(low)

    def _locate(self, kind: Kind, low: Place, high: Place, nearby: float) -> Place | None:
        step = low.step
        last = high.a if high.step == step else self.path.steps[step].length
        reference: float | None = None

        def value(a: float) -> float:
            nonlocal reference
            place = Place(step, a)
            eigenvalues = self.path.maps([place])[1]
            slope = np.array([self.path.rate_slope(place)])
            signs, logs = kind.condition.test(eigenvalues, slope, self.couples)
            if reference is None:
                reference = float(logs[0])
            distances = kind.distance(eigenvalues[0]), kind.condition.impostor(eigenvalues[0])
            if low.a < a < last and min(distances) < nearby:
                return 0.0  # ends the search
            return float(signs[0] * np.exp(np.clip(logs[0] - reference, -LOGS, LOGS)))

        closest = min(LOCATED * (last - low.a), IN_TONGUE * self.path.tracer.accuracy.loss)
        try:
            return Place(step, float(brentq(value, low.a, last, xtol=closest, rtol=ROUND_OFF)))
        except ValueError:  # round-off: an end is the zero, and `_uncounted` counts what crosses
            return None

    def _classify(self, kind: Kind, place: Place, tolerance: float) -> Detected | None:
        """The kind of a root, or nothing where the test function vanishes for another reason (a
        real pair with product one is a neutral saddle, not a torus).
        """
        eigenvalues = self.path.maps([place])[1][0]
        distance = kind.distance(eigenvalues)
        genuine = BY_IMPOSTOR * distance < kind.condition.impostor(eigenvalues)
        close = distance < tolerance and genuine
        return Detected(kind.at(self.path.symmetric), place) if close else None


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
