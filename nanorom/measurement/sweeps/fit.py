"""Least squares of one resonance to sweeps up and down at several levels.

Every trace is on the branch from where its sweep begins until a row at which it falls; which row
that is follows from the amplitudes, and the frequencies beside it are data on the fold.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import attrs
import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import least_squares, nnls

from nanorom.measurement.data import Trace
from nanorom.measurement.sweeps.duffing import Curve, Resonance
from nanorom.types import Array, Numbers

ROUNDS, FIRST_ROUNDS = 5, 2  # in which traces fall at other rows
NOISE_ROUNDS = 3
ROBUST = 4.0  # standard deviations from which differences count less than their square
BOUNDED = 12.0  # logarithms of what is found by its start
BETWEEN = 0.5  # distance of rows: how well a fold between two is known
EARLY = 5.0  # of these: a fall before the fold, which then says nothing of it
GAUSSIAN = 1.4826
LEAST_NOISE = 1e-4  # of an amplitude: what one harmonic leaves out
FLATTEST = 1e-10  # of a diagonal: parameters that the data do not determine
QUALITIES = np.geomspace(10, 1e5, 13)
PLACES = np.linspace(-1.2, 1.2, 13)  # starts of f0, between the ends of what is above half the peak
BEST_STARTS = 4
MOST_STEPS = 25
COARSE = 1e-3  # relative, of the squares: starts are only compared
THINNED = 40  # rows of each trace from which the start is found


@attrs.define(eq=False)
class SweepFit:
    """Parameters (p,) of a resonance and its differences from traces.

    traces: in the order of their sweeps; level: (t,) number of each trace's force; nonlinear_loss,
    background: whether e, and a share of the force that is seen without the resonance, are sought.
    Parameters: place of the resonance by the scale, in its half widths; log of g; b; e; real and
    imaginary background; log of each force, all in units of the largest amplitude and the scale.
    """

    traces: list[Trace]
    level: list[int]
    nonlinear_loss: bool
    background: bool
    scale: float = attrs.field(init=False)
    size: float = attrs.field(init=False)
    falls: list[int] = attrs.field(init=False)
    early: list[bool] = attrs.field(init=False)
    precision: float = attrs.field(init=False, default=1e-7)
    noise: list[Array] = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        highest = max(self.traces, key=lambda trace: float(smooth(trace).max()))
        self.size = float(smooth(highest).max())
        self.scale = float(highest.frequency[smooth(highest).argmax()])
        self.falls = [len(trace.frequency) for trace in self.traces]
        self.early = [False] * len(self.traces)
        self.noise = [0.02 * y + 1e-3 * float(y.max()) for y in self.heights]

    @property
    def places(self) -> list[Array]:
        """u (n,) of each trace: frequencies by the scale, squared."""
        return [(trace.frequency / self.scale) ** 2 for trace in self.traces]

    @property
    def heights(self) -> list[Array]:
        """Amplitudes (n,) of each trace by the largest."""
        return [trace.amplitude / self.size for trace in self.traces]

    @property
    def rows(self) -> int:
        """Of all traces."""
        return sum(len(trace.frequency) for trace in self.traces)

    # -- model ------------------------------------------------------------------------------------

    def resonance(self, p: Array) -> Resonance:
        """In units of the scale and the largest amplitude."""
        loss = float(np.exp(p[1]))
        place = 1 + 0.5 * loss * p[0]
        damping = float(p[3]) * loss if self.nonlinear_loss else 0.0
        return Resonance(place**2, loss, float(p[2]) * loss, damping)

    def curves(self, p: Array) -> list[Curve]:
        """The response at each level."""
        own = self.resonance(p)
        forces = np.exp(p[6:])
        return [own.curve(float(force)) for force in forces]

    def heights_at(self, p: Array, curve: Curve, u: Array, rising: bool) -> Array:
        """Amplitude (n,) at u (n,) on one of the branches, with what is seen beside it."""
        found = curve.amplitude(u, rising)
        if self.background:
            found = found + curve.force * (p[4] + 1j * p[5])
        return np.abs(found)

    def residual(self, p: Array) -> Array:
        """Differences by their noise, of amplitudes and then of the places of falls."""
        return self.differences(p)[0]

    def jacobian(self, p: Array) -> Array:
        """Derivatives of the residual with the parameters (p,)."""
        return self.differences(p, slopes=True)[1]

    def differences(self, p: Array, slopes: bool = False) -> tuple[Array, Array]:
        """The residual, and its derivatives if they are asked for."""
        curves, chain = self.curves(p), self._chain(p)
        rows: list[Array] = []
        falls: list[float] = []
        tables: list[Array] = []
        lasts: list[Array] = []
        for t, (u, y) in enumerate(zip(self.places, self.heights)):
            number, rising, fall = self.level[t], self._rising(t), self.falls[t]
            curve, parts = curves[number], []
            for way, some in ((rising, slice(fall)), (not rising, slice(fall, None))):
                found = curve.amplitude(u[some], way)
                seen = found + curve.force * complex(p[4], p[5])
                parts.append(np.abs(seen))
                if slopes:
                    table = self._slopes(p, curve, u[some], found, seen)
                    end = curve.upper if way else curve.lower
                    if end is not None:
                        beyond = u[some] > end[0] if way else u[some] < end[0]
                        table[beyond, :5] = curve.fold_slopes(end)
                    table = table @ chain(number)
                    tables.append(table / self.noise[t][some, None])
            rows.append((np.concatenate(parts) - y) / self.noise[t])
            if 0 < fall < len(u) and not self.early[t]:
                fold = (curve.upper if rising else curve.lower) or curve.top
                deviation = BETWEEN * abs(u[fall] - u[fall - 1])
                falls.append((fold[0] - 0.5 * (u[fall] + u[fall - 1])) / deviation)
                if slopes:
                    moves = curve.gradient(*(np.full(1, float(at)) for at in fold))[2].T
                    last = np.append(moves, np.zeros((1, 2)), axis=1) @ chain(number)
                    lasts.append(last / deviation)
        left = np.concatenate([*rows, np.array(falls)])
        return left, np.concatenate([*tables, *lasts]) if slopes else np.empty((0, len(p)))

    @staticmethod
    def _slopes(p: Array, curve: Curve, u: Array, found: Numbers, seen: Numbers) -> Array:
        """Of |seen| (n, 7) with w0^2, g, b, e, F and the two parts of the background."""
        change = curve.gradient(u, np.asarray(np.abs(found) ** 2, dtype=float))[1]
        change[4] += complex(p[4], p[5])
        unit = np.conj(seen) / np.maximum(np.abs(seen), 1e-300)
        beside = curve.force * np.array([unit.real, -unit.imag])
        return np.concatenate([np.real(unit * change), beside]).T

    def _chain(self, p: Array) -> Callable[[int], Array]:
        """Derivatives of w0^2, g, b, e, F, background (7, p) with the parameters."""
        own, loss = self.resonance(p), float(np.exp(p[1]))
        table = np.zeros((7, len(p)))
        root = np.sqrt(own.square)
        table[0, :2] = root * loss, root * loss * p[0]
        table[1, 1] = loss
        table[2, 1], table[2, 2] = own.cubic, loss
        table[3, 1], table[3, 3] = own.damping, loss if self.nonlinear_loss else 0.0
        table[5, 4] = table[6, 5] = 1.0

        def of_level(number: int) -> Array:
            result = table.copy()
            result[4, 6 + number] = np.exp(p[6 + number])
            return result

        return of_level

    def _rising(self, t: int) -> bool:
        return self.traces[t].direction == "up"

    # -- where traces fall ------------------------------------------------------------------------

    def settle_falls(self, p: Array) -> bool:
        """Take the rows at which the traces fall that fit best; whether none has changed."""
        before, curves = (list(self.falls), list(self.early)), self.curves(p)
        for t, (u, y) in enumerate(zip(self.places, self.heights)):
            curve, rising = curves[self.level[t]], self._rising(t)
            self.falls[t], self.early[t] = len(u), False
            if curve.upper is None or curve.lower is None:
                continue
            first, second = (
                ((self.heights_at(p, curve, u, way) - y) / self.noise[t]) ** 2
                for way in (rising, not rising)
            )
            costs = np.cumsum(np.append(0, first)) + np.append(np.cumsum(second[::-1])[::-1], 0)
            beyond = u < curve.lower[0] if rising else u > curve.upper[0]
            costs[:-1][beyond] = np.inf  # where the second branch is not yet
            self.falls[t] = int(costs.argmin())
        return before[0] == self.falls

    def drop_early(self, p: Array) -> bool:
        """Leave out folds before which a trace has fallen early; whether there are new ones."""
        curves, new = self.curves(p), False
        for t, u in enumerate(self.places):
            fall, rising = self.falls[t], self._rising(t)
            if 0 < fall < len(u) and not self.early[t]:
                curve = curves[self.level[t]]
                fold = curve.upper if rising else curve.lower
                if fold is not None:
                    beyond = (fold[0] - 0.5 * (u[fall] + u[fall - 1])) * (1 if rising else -1)
                    self.early[t] = bool(beyond > EARLY * BETWEEN * abs(u[fall] - u[fall - 1]))
                    new |= self.early[t]
        return new

    # -- fit --------------------------------------------------------------------------------------

    def start(self) -> Array:
        """The best of a grid of places, quality factors and the hardening that then follows.

        The best few are fitted to some of the rows, evenly taken.
        """
        thin = attrs.evolve(self, traces=[thinned(trace) for trace in self.traces])
        thin.scale, thin.size, thin.precision = self.scale, self.size, COARSE
        ends = []
        for p in thin.grid():
            p = thin.descend(p, FIRST_ROUNDS)
            ends.append((float(np.log1p(thin.residual(p) ** 2).sum()), p))
        return min(ends, key=lambda end: end[0])[1]

    def grid(self) -> list[Array]:
        """The starts that fit best, of all."""
        smoothed = [smooth(trace) / self.size for trace in self.traces]
        highest = max(range(len(self.traces)), key=lambda t: float(smoothed[t].max()))
        u, y = self.places[highest], smoothed[highest]
        above = np.sqrt(u[y > 0.5 * y.max()])
        reach = max(float(np.ptp(above)), float(np.abs(np.diff(np.sqrt(u))).min()))
        peaks = [0.0] * (max(self.level) + 1)
        for number, height in zip(self.level, smoothed):
            peaks[number] = max(peaks[number], float(height.max()))
        found = []
        for place, quality in itertools.product(1 + reach * PLACES, QUALITIES):
            loss = 1 / quality
            cubic = 4 / 3 * (1 - place**2)  # the backbone goes through the largest amplitude
            forces = [np.log(max(peak, 1e-6) * loss) for peak in peaks]
            p = np.array([2 * (place - 1) / loss, np.log(loss), cubic / loss, 0, 0, 0, *forces])
            self.settle_falls(p)
            rows = self.residual(p)[: self.rows]
            found.append((float(np.log1p(rows**2).sum()), p))
        found.sort(key=lambda start: start[0])
        return [p for _, p in found[:BEST_STARTS]]

    def sought(self) -> Array:
        """Numbers of the parameters that are fitted."""
        number = 6 + max(self.level) + 1
        left_out = ({3} if not self.nonlinear_loss else set()) | (
            {4, 5} if not self.background else set()
        )
        return np.array([i for i in range(number) if i not in left_out])

    def descend(self, p: Array, rounds: int = ROUNDS) -> Array:
        """From a start to the least squares, the rows of the falls settled on the way."""
        for _ in range(rounds):
            self.settle_falls(p)
            p = self._least_squares(p)
            early = self.drop_early(p)
            if self.settle_falls(p) and not early:
                break
        return p

    def _least_squares(self, p: Array) -> Array:
        free = self.sought()

        def miss(values: Array) -> Array:
            tried = p.copy()
            tried[free] = values
            return self.residual(tried)

        low, high = np.full(len(free), -np.inf), np.full(len(free), np.inf)
        logs = (free == 1) | (free >= 6)
        low[logs], high[logs] = p[free][logs] - BOUNDED, p[free][logs] + BOUNDED
        low[free == 3] = 0.0 if p[3] > 0 else -1e-12  # nonlinear loss, no gain

        def slopes(values: Array) -> Array:
            tried = p.copy()
            tried[free] = values
            return self.jacobian(tried)[:, free]

        options = {"loss": "soft_l1", "f_scale": ROBUST, "x_scale": "jac", "max_nfev": MOST_STEPS}
        options |= {"ftol": self.precision, "xtol": self.precision}
        found = least_squares(miss, p[free], slopes, bounds=(low, high), **options)
        result = p.copy()
        result[free] = found.x
        return result

    def measure_noise(self, p: Array) -> None:
        """Noise of the amplitudes, a constant and a share of them, from what is left.

        By the fitted amplitudes: weights that go with measured ones make the fit too low.
        """
        ends = np.cumsum([len(y) for y in self.heights])[:-1]
        parts = np.split(self.residual(p)[: self.rows], ends)
        misses = [part * noise for part, noise in zip(parts, self.noise)]
        fitted = [y + miss for y, miss in zip(self.heights, misses)]
        sizes, sums = np.concatenate(fitted), np.abs(np.concatenate(misses))
        usual = GAUSSIAN * np.median(sums / (sizes + 0.1))
        floor, share = variance(sizes, np.minimum(sums, 3 * usual * (sizes + 1)))
        self.noise = [np.sqrt(floor + (share + LEAST_NOISE**2) * y**2) for y in fitted]

    def covariance(self, p: Array) -> Array:
        """(q, q) of the sought parameters, scaled by what is left."""
        free = self.sought()
        jacobian, left = self.jacobian(p)[:, free], self.residual(p)
        weight = 1 / np.sqrt(1 + (left / ROBUST) ** 2) ** 0.5
        jacobian = jacobian * weight[:, None]
        sizes = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        scaled = jacobian / sizes
        normal = scaled.T @ scaled + FLATTEST * np.eye(len(free))
        freedom = max(self.rows - len(free), 1)
        variance = float(((weight * left)[: self.rows] ** 2).sum()) / freedom
        return np.asarray(np.linalg.inv(normal) / np.outer(sizes, sizes) * max(variance, 1e-300))

    def evidence(self, p: Array) -> float:
        """-2 log of the likelihood with a noise that is not known, and what parameters cost."""
        left = self.residual(p)
        robust = 2 * ROBUST**2 * (np.sqrt(1 + (left / ROBUST) ** 2) - 1)
        spread = 2 * sum(float(np.log(noise).sum()) for noise in self.noise)
        return float(robust.sum()) + spread + len(self.sought()) * np.log(self.rows)


def smooth(trace: Trace) -> Array:
    """Amplitudes (n,) of a trace without single outliers."""
    return np.asarray(median_filter(trace.amplitude, 3))


def thinned(trace: Trace) -> Trace:
    """At most THINNED rows of a trace, and its largest."""
    count = len(trace.frequency)
    rows = np.linspace(0, count - 1, min(count, THINNED)).astype(int)
    rows = np.unique(np.append(rows, int(smooth(trace).argmax())))
    return attrs.evolve(
        trace, frequency=trace.frequency[rows], amplitude=trace.amplitude[rows], phase=None
    )


def variance(sizes: Array, misses: Array) -> tuple[float, float]:
    """Of a constant noise and of one that goes with the size, from what was missed (n,).

    Least squares of the squares, weighted by what they are expected to be, in a few rounds.
    """
    tables = np.column_stack([np.ones_like(sizes), sizes**2])
    found = np.array([float((misses**2).mean()), 0.0])
    for _ in range(NOISE_ROUNDS):
        weight = 1 / np.maximum(tables @ found, 1e-12)
        found = nnls(tables * weight[:, None], misses**2 * weight)[0]
    return max(float(found[0]), 1e-14), float(found[1])
