"""Branches continued by multiple shooting where harmonic balance would need too many harmonics.

Unknowns are the states at the starts of M segments of the period and the drive frequency; each
segment is one Taylor step (`shooting`). Pseudo-arclength continuation with the tangent as border;
special points are zeros of test functions along the way, found by bisection on the branch itself.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
from scipy.sparse import bmat, csc_matrix
from scipy.sparse.linalg import splu

from nanorom.continuation.branches.march import STRAIGHT, Advance, March, StepControl
from nanorom.continuation.orbits.bifurcations import CONFIRMED, KINDS, Kind
from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.orbits.product import product_eigenvalues
from nanorom.continuation.orbits.shooting import Shooting
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

FIRST_STEP, LEAST_STEP, LARGEST_STEP = 0.01, 1e-7, 0.05  # of the size of the orbit
NEWTON_STEPS, EASY_STEPS = 8, 3
CONVERGED, ROUND_OFF = 1e-11, 1e-9  # of the unknowns: Newton's last change, and the best it can be
STAGNANT = 0.3  # of the change before: as small as round-off in strongly unstable orbits lets it be
ASTRAY = 0.5  # of the unknowns: a change that leads nowhere
TAYLOR_ERROR = 1e-13  # last terms of a segment beyond which there must be more segments
SAMPLES = 24  # per segment
SHARP = 1e-11  # of a step, to which special points are located
NEGLIGIBLE = 1e-13  # harmonics below, relative to the largest, are left out
LOCATING = 60  # rounds, of which bisection alone would need fewer
LEAST_PART = 0.02  # of an interval cut off by a round, lest regula falsi creeps
SLOW = 0.5  # of an interval: a round that left more must not be followed by another such
ASIDE = (1.0, 0.7, 1.3, 0.4)  # times the place looked for, where Newton's method fails at it
WITHIN = 0.99  # of an interval
CLOSED = 0.1  # of a step: how far from it the first point may lie on a branch that closes
BETWEEN = 1e-2  # of an amplitude: most that a parabola may add to the largest sample
BY_FREQUENCY = 1e-5  # of it: differences whose truncation and round-off balance
ALONG = 1e-6  # arc length, to carry the tangent over to other segments
LEAST_TIME = 1e-12  # of a segment: a Taylor step of no length has no scale
TINY = 1e-300  # of a zero orbit


@attrs.define(eq=False)
class Point:
    """States at the starts of the segments (M, 2L), drive frequency, and the direction in which the
    branch goes on; multipliers (2L,).
    """

    nodes: Array
    omega: float
    tangent: Array
    multipliers: Array


Special = tuple[Kind, Point]


@attrs.frozen(eq=False)
class Stretch:
    """A step of a branch: its ends, the special points between them, and whether the end is still
    inside the range.
    """

    start: Point
    end: Point
    special: list[Special] = attrs.Factory(list)
    inside: bool = True


class Takeover:
    """A branch of period `period_multiple` drive periods, by shooting."""

    def __init__(self, system: ScaledSystem, period_multiple: int) -> None:
        self.system, self.period_multiple = system, period_multiple
        self.shooting = Shooting(system)
        self.stepper = self.shooting.stepper

    def follow(
        self,
        before: Orbit,
        last: Orbit,
        rates: tuple[float, float],
        steps: int,
        is_end: Callable[[Orbit], bool],
    ) -> tuple[list[Point], list[Special], str]:
        """Points after `last` in the direction from `before`, special points, and why it ends.

        is_end : whether an orbit at a fold or branch point is the end of a bifurcating branch.
        """
        nodes = self.shooting._nodes(last)[0]
        earlier = self._at_nodes(before, len(nodes))
        direction = self._unknowns(nodes, last.omega) - self._unknowns(earlier, before.omega)
        try:
            here = self._correct(nodes, last.omega, direction)
        except ContinuationError:  # nor by shooting: it ends where its harmonics did
            return [], [], "harmonics"
        points: list[Point] = []
        special: list[Special] = []
        control = StepControl(FIRST_STEP, LEAST_STEP, LARGEST_STEP, steps)
        march = March(self._stretch(rates), Stretch(here, here), control)
        for _, stretch in march:
            there = stretch.end
            for kind, point in stretch.special:
                if kind.at_ends and is_end(self.orbit(point)):
                    return [*points, point], special, "bifurcation"
            special += stretch.special
            points.append(there)
            if points[1:] and self._passes(stretch.start, there, here):
                return points, special, "closed"
            if not stretch.inside:
                return points, special, "range"
        return points, special, march.ending

    def _stretch(self, rates: tuple[float, float]) -> Advance[Stretch]:
        """How the branch goes on inside a range of rates."""
        low, high = (rate * self.period_multiple for rate in rates)

        def advance(before: Stretch, step: float) -> tuple[Stretch, bool]:
            here = self._refine(before.end)
            there, iterations = self._step(here, step)
            inside = low <= there.omega <= high
            if not inside:
                limit = low if there.omega < low else high
                there = self._locate(here, step, lambda point: point.omega - limit)
            stretch = Stretch(here, there, self._special(here, there), inside)
            return stretch, iterations <= EASY_STEPS

        return advance

    def orbit(self, point: Point) -> Orbit:
        """The Fourier coefficients of a point, as many as it has above round-off."""
        values = self._samples(point)[:, : self.system.size]
        n = len(values)
        spectrum = np.fft.rfft(values, axis=0) / n
        sizes = np.abs(spectrum[1 : (n - 1) // 2]).max(axis=1)
        keep = np.flatnonzero(sizes > NEGLIGIBLE * max(np.abs(spectrum).max(), TINY))
        count = int(keep[-1]) + 1 if len(keep) else 1
        coefficients = np.zeros((2 * count + 1, self.system.size))
        coefficients[0] = spectrum[0].real
        coefficients[1::2] = 2 * spectrum[1 : count + 1].real
        coefficients[2::2] = -2 * spectrum[1 : count + 1].imag
        return Orbit(coefficients, point.omega / self.period_multiple, self.period_multiple)

    def amplitudes(self, point: Point) -> Array:
        """max |q_r| over the period in the coordinates and units of the model, (L,)."""
        samples, size = self._samples(point), self.system.size
        q, v = self.system.given(samples[:, :size]), self.system.given(samples[:, size:])
        best = np.abs(q).argmax(axis=0)
        modes = np.arange(size)
        found = np.abs(q[best, modes])
        spacing = 2 * np.pi * self.period_multiple / point.omega / len(samples)
        bend = (v[(best + 1) % len(q), modes] - v[best - 1, modes]) / (2 * spacing)
        speed = v[best, modes]
        gain = np.divide(
            speed**2, -2 * bend * np.sign(q[best, modes]), where=bend != 0, out=np.zeros(size)
        )
        return np.asarray(found + np.clip(gain, 0.0, BETWEEN * found))

    # one step ----------------------------------------------------------------------------------

    def _step(self, here: Point, step: float) -> tuple[Point, int]:
        length = step * self._size(here)
        guess = self._unknowns(here.nodes, here.omega) + length * here.tangent
        nodes, omega = self._split(guess)
        if omega <= 0:
            raise ContinuationError("the frequency would be negative")
        there = self._correct(nodes, omega, here.tangent)
        if here.tangent @ there.tangent < STRAIGHT:
            raise ContinuationError("the branch turns too fast for the step")
        return there, self._iterations

    def _passes(self, here: Point, there: Point, first: Point) -> bool:
        """Whether the branch comes back to its first point between two others."""
        if len(first.nodes) != len(there.nodes) or len(here.nodes) != len(there.nodes):
            return False
        start, end, back = (self._unknowns(p.nodes, p.omega) for p in (here, there, first))
        chord = end - start
        along = float((back - start) @ chord / (chord @ chord))
        aside = float(np.linalg.norm(back - start - along * chord))
        return 0 <= along <= 1 and aside < CLOSED * float(np.linalg.norm(chord))

    def _size(self, here: Point) -> float:
        return max(1.0, float(np.linalg.norm(self._unknowns(here.nodes, 0.0))))

    def _unknowns(self, nodes: Array, omega: float) -> Array:
        return np.append(nodes.ravel() / np.sqrt(len(nodes)), omega)

    def _split(self, unknowns: Array) -> tuple[Array, float]:
        nodes = unknowns[:-1].reshape(-1, 2 * self.system.size)
        return nodes * np.sqrt(len(nodes)), float(unknowns[-1])

    def _correct(self, nodes: Array, omega: float, border: Array) -> Point:
        """Newton's method in the plane through the guess that is normal to the border."""
        border = border / np.linalg.norm(border)
        unknowns = self._unknowns(nodes, omega)
        right = np.zeros(len(unknowns))
        right[-1] = 1.0
        before = np.inf
        for iteration in range(NEWTON_STEPS):
            nodes, omega = self._split(unknowns)
            gaps, maps, slope = self._gaps(nodes, omega)
            factors = self._factors(maps, slope, border)
            change = factors.solve(np.append(-gaps.ravel() / np.sqrt(len(nodes)), 0.0))
            unknowns = unknowns + change
            scale = max(1.0, float(np.abs(unknowns).max()))
            if not np.all(np.isfinite(change)) or np.linalg.norm(change) > ASTRAY * scale:
                break
            size = float(np.linalg.norm(change)) / scale
            stagnant = size < ROUND_OFF and size > STAGNANT * before
            before = size
            if size < CONVERGED or stagnant:
                self._iterations = iteration
                tangent = factors.solve(right)
                nodes, omega = self._split(unknowns)
                return Point(
                    nodes, omega, tangent / np.linalg.norm(tangent), product_eigenvalues(maps)
                )
        raise ContinuationError("shooting does not converge along the branch")

    def _gaps(self, nodes: Array, omega: float) -> tuple[Array, Array, Array]:
        """Gaps (M, 2L) between segments, maps (M, 2L, 2L), derivative (M, 2L) by frequency."""
        ends, maps = self._ends(nodes, omega, True)
        assert maps is not None
        small = BY_FREQUENCY * omega
        slope = (self._ends(nodes, omega + small)[0] - self._ends(nodes, omega - small)[0]) / (
            2 * small
        )
        return ends - np.roll(nodes, -1, axis=0), maps, slope

    def _ends(
        self, nodes: Array, omega: float, variation: bool = False
    ) -> tuple[Array, Array | None]:
        count = len(nodes)
        duration = np.full(count, 2 * np.pi * self.period_multiple / omega / count)
        ends, maps, self._error = self.stepper.step(
            nodes, np.full(count, omega), self._phases(count), duration, variation
        )
        return ends, maps

    def _phases(self, count: int) -> Array:
        return np.asarray(2 * np.pi * self.period_multiple / count * np.arange(count))

    def _factors(self, maps: Array, slope: Array, border: Array):  # type: ignore[no-untyped-def]
        """Factors of the Jacobian of the gaps, bordered."""
        count, width, _ = maps.shape
        rows = np.arange(count * width).reshape(count, width)
        row = np.broadcast_to(rows[:, :, None], maps.shape)
        column = np.broadcast_to(rows[:, None, :], maps.shape)
        size = count * width
        block = csc_matrix((maps.ravel(), (row.ravel(), column.ravel())), (size, size))
        shift = csc_matrix((np.ones(size), (rows.ravel(), np.roll(rows, -1, axis=0).ravel())))
        matrix = bmat(
            [
                [block - shift, slope.reshape(-1, 1) / np.sqrt(count)],
                [border[None, :-1], border[-1:][None]],
            ],
            format="csc",
        )
        try:
            return splu(matrix)
        except RuntimeError:  # SciPy's word for a singular matrix
            raise ContinuationError("the branch cannot be corrected by shooting") from None

    # segments ----------------------------------------------------------------------------------

    def _refine(self, here: Point) -> Point:
        """The same point on more segments, if the Taylor series ask for them."""
        self._ends(here.nodes, here.omega)
        if self._error < TAYLOR_ERROR:
            return here
        count = int(1.4 * len(here.nodes)) + 1
        nodes = self._at(here.nodes, here.omega, np.arange(count) / count)
        ahead = self._unknowns(here.nodes, here.omega) + ALONG * here.tangent
        moved, omega = self._split(ahead)
        ahead = self._unknowns(self._at(moved, omega, np.arange(count) / count), omega)
        direction = ahead - self._unknowns(nodes, here.omega)
        return self._refine(self._correct(nodes, here.omega, direction))

    def _at(self, nodes: Array, omega: float, fractions: Array) -> Array:
        """States (n, 2L) at fractions (n,) of the period."""
        count = len(nodes)
        place = fractions * count
        segment = np.minimum(place.astype(int), count - 1)
        duration = 2 * np.pi * self.period_multiple / omega / count
        rest = np.maximum(place - segment, LEAST_TIME) * duration
        return self.stepper.step(
            nodes[segment],
            np.full(len(segment), omega),
            self._phases(count)[segment],
            rest,
            variation=False,
        )[0]

    def _samples(self, point: Point) -> Array:
        n = SAMPLES * len(point.nodes)
        return self._at(point.nodes, point.omega, np.arange(n) / n)

    def _at_nodes(self, orbit: Orbit, count: int) -> Array:
        table = fourier_matrix(
            2 * np.pi / count * np.arange(count), (len(orbit.coefficients) - 1) // 2
        )
        speed = orbit.rate * (table @ differentiate(orbit.coefficients))
        return np.concatenate([table @ orbit.coefficients, speed], axis=1)

    # special points ----------------------------------------------------------------------------

    def _special(self, here: Point, there: Point) -> list[Special]:
        """Special points between two neighbours."""
        if here.nodes.shape != there.nodes.shape:
            return []
        length = float(
            (self._unknowns(there.nodes, there.omega) - self._unknowns(here.nodes, here.omega))
            @ here.tangent
        )
        step = length / self._size(here)
        folds = here.tangent[-1] * there.tangent[-1] < 0
        found = []
        for kind in KINDS.values():
            # at a fold, a multiplier is 1 as well
            wanted = folds if kind.turns else not (folds and kind.condition.by_slope)
            test = _test(kind)
            if wanted and test(here) * test(there) < 0:
                found.append((kind, self._locate(here, step, test)))
        return [
            (kind, point) for kind, point in found if kind.distance(point.multipliers) < CONFIRMED
        ]

    def _locate(self, here: Point, step: float, test: Callable[[Point], float]) -> Point:
        """The point within a step at which the test function is zero."""
        low, high = 0.0, step
        ends = [here, self._step(here, step)[0]]
        values = [test(end) for end in ends]
        for _ in range(LOCATING):
            # regula falsi, and bisection where it creeps
            weight = values[0] / (values[0] - values[1])
            weight = min(max(weight, LEAST_PART), 1 - LEAST_PART)
            found = self._near(here, low, high, weight)
            if found is None:
                break
            place, middle = found
            value = test(middle)
            if value == 0 or high - low < SHARP * step:
                return middle
            side = 0 if value * values[0] > 0 else 1
            shrunk = (high - place if side == 0 else place - low) / (high - low)
            low, high = (place, high) if side == 0 else (low, place)
            ends[side], values[side] = middle, value
            if shrunk > SLOW:
                values[1 - side] /= 2
        return self._between(ends[0], ends[1], test)

    def _near(
        self, here: Point, low: float, high: float, weight: float
    ) -> tuple[float, Point] | None:
        """A point of the step, near a fraction of an interval: at a branch point there is none."""
        for change in ASIDE:
            place = low + min(change * weight, WITHIN) * (high - low)
            try:
                return place, self._step(here, place)[0]
            except ContinuationError:
                continue  # a little farther from the branch point it may exist
        return None

    def _between(self, first: Point, second: Point, test: Callable[[Point], float]) -> Point:
        """The zero on the chord of two neighbours: where the Jacobian is singular."""
        values = test(first), test(second)
        weight = values[0] / (values[0] - values[1])
        ends = [self._unknowns(point.nodes, point.omega) for point in (first, second)]
        nodes, omega = self._split(ends[0] + weight * (ends[1] - ends[0]))
        maps = self._gaps(nodes, omega)[1]
        return Point(nodes, omega, first.tangent, product_eigenvalues(maps))


def _test(kind: Kind) -> Callable[[Point], float]:
    if kind.turns:
        return lambda point: float(point.tangent[-1])
    return lambda point: kind.condition.crossing(point.multipliers)
