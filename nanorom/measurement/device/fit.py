"""Least squares of sweeps to the stable stretches that continuation finds, in a device's numbers.

Every step takes the arrays of the device with their derivatives, explores each range of rows at
each level, tells which stretch each row is on, corrects the orbits at the rows and derives them by
the implicit function theorem; folds at which a sweep falls are data of their own.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from nanorom.continuation import ModalSystem, explore
from nanorom.errors import NanoromError
from nanorom.measurement.data import Trace
from nanorom.measurement.device.noise import noise_of
from nanorom.measurement.device.parameters import FARTHEST, Device, Parameters
from nanorom.measurement.device.phases import turned
from nanorom.measurement.device.rows import CHANGE, assigned
from nanorom.measurement.device.stretches import Stretch, stretches
from nanorom.measurement.sweeps.fit import BETWEEN, EARLY, ROBUST
from nanorom.types import Array, Numbers

MARGIN = 2.0  # half widths by which a range is explored beyond its rows
REACH = 1.2  # beyond a range within which branches that leave it come back
TOLERANCE = 1e-6  # of orbits: far below the noise
WAITING = 0.3  # squared deviations for each row beyond the end of a stretch
NOWHERE = 1e6  # of a row on a stretch that does not reach it
STEPS, ROUNDS = 12, 3  # of the descent, and how often the noise is measured anew
HALVINGS = 5
SETTLED = 0.05  # of its standard deviation: a step below it ends the descent
UNDETERMINED = 1e-5  # singular value, relative, of a direction that the data do not tell
LEAST_NOISE = 1e-4  # of an amplitude: what the harmonics left out
FREE = 1e-9


@attrs.frozen(eq=False)
class Measured:
    """A part of a trace within one range: omega (n,) rad/s, amplitude (n,), drive level, place of
    its range; trace: the whole one.
    """

    trace: Trace
    level: float
    place: int


@attrs.frozen(eq=False)
class Evaluation:
    """Differences at some parameters x (p,): residual (m,) by their noise and jacobian (m, p).

    fitted: (n,) of each part, in the unit of the amplitude; angle: (n,) rad; falls: the rows
    before which the part falls, with the fold's frequency in Hz or nan, and whether it was before
    its fold.
    """

    x: Array
    device: Device
    residual: Array
    jacobian: Array
    fitted: list[Array]
    angle: list[Array]
    falls: list[list[tuple[int, float, bool]]]
    penalty: float

    @property
    def cost(self) -> float:
        """Sum of robust squares."""
        return float(robust(self.residual).sum()) + self.penalty


def robust(left: Array) -> Array:
    """Squares that grow only linearly beyond ROBUST deviations."""
    return np.asarray(2 * ROBUST**2 * (np.sqrt(1 + (left / ROBUST) ** 2) - 1))


def weights(left: Array) -> Array:
    """Of squares, whose sum has the slope of the robust one."""
    return np.asarray(1 / np.sqrt(1 + (left / ROBUST) ** 2))


@attrs.define(eq=False)
class DeviceFit:
    """Parts of traces and what is sought of the device that they are of.

    ranges: (low, high) Hz in which each level is explored; noise: (floor, share) of each range, of
    the amplitude's unit and of the amplitude; across: the same of what phases are measured by.
    """

    parameters: Parameters
    parts: list[Measured]
    ranges: list[tuple[float, float]]
    noise: list[tuple[float, float]]
    across: list[tuple[float, float]]
    explored: int = 0
    _last: tuple[bytes, Device, dict[tuple[int, float], list[Stretch]]] | None = None

    @property
    def rows(self) -> int:
        """Of all parts."""
        return sum(len(part.trace.frequency) for part in self.parts)

    # -- differences ------------------------------------------------------------------------------

    def evaluate(self, x: Array, alike: DeviceFit | None = None) -> Evaluation:
        """All differences and their derivatives; raises NanoromError where there is no device.

        alike : a fit of fewer parameters, that has just been evaluated at the same device.
        """
        if alike is not None and alike._last is not None:
            self._last = x.tobytes(), self.parameters.device(x), alike._last[2]
        if self._last is None or self._last[0] != x.tobytes():
            self._last = x.tobytes(), self.parameters.device(x), {}
        _, device, known = self._last
        rows: list[Array] = []
        tables: list[Array] = []
        extra: list[tuple[float, Array]] = []
        fitted, angles, falls, penalty = [], [], [], 0.0
        for part in self.parts:
            key = part.place, part.level
            if key not in known:
                known[key] = self._stretches(device, *key)
            left, table, signal, own, price = self._part(device, part, known[key], extra)
            rows.append(left)
            tables.append(table)
            fitted.append(np.abs(signal))
            angles.append(np.angle(signal))
            falls.append(own)
            penalty += price
        residual = np.concatenate([*rows, [value for value, _ in extra]])
        jacobian = np.concatenate([*tables, *(slope[None] for _, slope in extra)])
        return Evaluation(x, device, residual, jacobian, fitted, angles, falls, penalty)

    def _stretches(self, device: Device, place: int, level: float) -> list[Stretch]:
        terms, (low, high) = device.terms, self.ranges[place]
        middle = 0.5 * (low + high)
        near = int(np.abs(device.frequency - middle).argmin())
        width = MARGIN * float(terms.damping[near]) / (2 * np.pi)
        limits = (
            2 * np.pi * (low - width - device.offset),
            2 * np.pi * (high + width - device.offset),
        )
        system = ModalSystem(
            damping=terms.damping,
            stiffness=terms.stiffness,
            cubic=terms.cubic,
            direct=terms.force,
            cubic_damping=terms.time * terms.cubic if terms.time else None,
        )
        depth = 1 if len(terms.damping) > 1 else 0
        diagram = explore(system, limits, level, depth=depth, tolerance=TOLERANCE, reach=REACH)
        self.explored += 1
        return stretches(terms, level, diagram, limits)

    def _part(
        self,
        device: Device,
        part: Measured,
        found: list[Stretch],
        extra: list[tuple[float, Array]],
    ) -> tuple[Array, Array, Numbers, list[tuple[int, float, bool]], float]:
        """Differences of a part, their derivatives, what is fitted, falls, the price of changes.

        Of amplitudes, then of phases where there are some.
        """
        y, hertz = part.trace.amplitude, part.trace.frequency
        omega = 2 * np.pi * (hertz - device.offset)
        if not found:
            raise NanoromError("no stable motion in a range of rows")
        signals = []
        cost = np.full((len(y), len(found)), NOWHERE)
        for s, stretch in enumerate(found):
            states, _ = stretch.at(omega)
            signal = stretch.equations.signal(states, device.gain) * stretch.equations.unit
            signals.append(signal * np.exp(1j * device.phase[part.place]))
            left = self._misses(part, signals[-1])
            beyond = self._beyond(stretch, omega)
            missed = robust(left).sum(axis=0) + WAITING * beyond
            cost[:, s] = np.where(beyond < NOWHERE, missed, NOWHERE)
        which = assigned(cost)
        values = np.array([signals[s][row] for row, s in enumerate(which)])
        noise = self._noises(part, np.abs(values))
        table = np.zeros((len(noise), len(y), len(device.changes)))
        for s in np.unique(which):
            own = which == s
            slopes = self._slopes(device, found[s], omega[own])
            turning = np.abs(values[own, None]) * device.phases[:, part.place]
            table[:, own] = np.stack([slopes.real, slopes.imag + turning])[: len(noise)]
        falls = self._falls(device, part, found, which, extra)
        changed = int((np.diff(which) != 0).sum())
        left = self._misses(part, values).ravel()
        table = (table / noise[..., None]).reshape(len(left), -1)
        return left, table, values, falls, CHANGE * changed

    @staticmethod
    def _beyond(stretch: Stretch, omega: Array) -> Array:
        """How many rows (n,) beyond its fold a stretch is taken; NOWHERE beyond another end."""
        found = np.zeros(len(omega))
        for end, away in enumerate((stretch.omega[0] - omega, omega - stretch.omega[1])):
            out = away > 0
            if stretch.folds[end] is None and not stretch.open[end]:
                found[out] = NOWHERE
                continue
            order = np.argsort(away[out])
            count = np.empty(len(order))
            count[order] = 1 + np.arange(len(order))
            found[out] = count
        return found

    def _slopes(self, device: Device, stretch: Stretch, omega: Array) -> Numbers:
        """Derivatives (n, p) of rows on a stretch: of amplitudes, and i times those across them."""
        equations, count = stretch.equations, len(device.changes)
        states, rate = stretch.at(omega)
        by_all, by_rate = equations.slopes(states, rate, device.changes)
        beyond = rate * equations.frequency != omega
        for end, state in enumerate(stretch.folds):
            own = beyond & (
                np.abs(rate * equations.frequency - stretch.omega[end])
                < 1e-9 * rate[0] * equations.frequency
            )
            if state is not None and own.any():
                at = state / equations.unit
                fold = equations.fold_slopes(
                    at, stretch.omega[end] / equations.frequency, device.changes
                )
                by_all[own] = np.moveaxis(fold.coefficients, 0, -1)
                by_rate[own] = 0.0
        weight = device.gain
        signal = equations.signal(states, weight)
        unit = np.conj(signal) / np.maximum(np.abs(signal), 1e-300)
        table = np.empty((len(omega), count), dtype=complex)
        for k in range(count):
            moved = equations.signal(by_all[..., k], weight) + equations.signal(
                states, device.gains[k]
            )
            table[:, k] = unit * moved
        slope = unit * equations.signal(by_rate, weight) / equations.frequency
        table -= 2 * np.pi * slope[:, None] * device.offsets
        return np.asarray(table * equations.unit)

    def _falls(
        self,
        device: Device,
        part: Measured,
        found: list[Stretch],
        which: NDArray[np.intp],
        extra: list[tuple[float, Array]],
    ) -> list[tuple[int, float, bool]]:
        """Rows at which a part falls; where it does so at a fold, the fold is a datum."""
        hertz, result = part.trace.frequency, []
        for row in np.flatnonzero(np.diff(which)) + 1:
            stretch, rising = found[which[row - 1]], hertz[row] > hertz[row - 1]
            state = stretch.folds[int(rising)]
            if state is None:
                result.append((int(row), np.nan, False))
                continue
            at = float(stretch.omega[int(rising)])
            place = at / (2 * np.pi) + device.offset
            deviation = BETWEEN * abs(hertz[row] - hertz[row - 1])
            miss = (place - 0.5 * (hertz[row] + hertz[row - 1])) / deviation
            early = bool((miss if rising else -miss) > EARLY)
            result.append((int(row), place, early))
            if not early:
                equations = stretch.equations
                fold = equations.fold_slopes(
                    state / equations.unit, at / equations.frequency, device.changes
                )
                slope = fold.omega / (2 * np.pi) + device.offsets
                extra.append((float(miss), slope / deviation))
        return result

    # -- noise ------------------------------------------------------------------------------------

    def deviation(self, place: int, size: Array, across: bool = False) -> Array:
        """Standard deviation (n,) of amplitudes (n,) in a range, or of phases times these."""
        floor, share = (self.across if across else self.noise)[place]
        return np.asarray(np.sqrt(floor**2 + (share**2 + LEAST_NOISE**2) * size**2))

    def _noises(self, part: Measured, size: Array) -> Array:
        """Deviations (1 or 2, n) of what a part has."""
        kinds = (False,) if part.trace.phase is None else (False, True)
        return np.array([self.deviation(part.place, size, across) for across in kinds])

    def _misses(self, part: Measured, signal: Numbers) -> Array:
        """Differences (1 or 2, n) by their noise."""
        size, data = np.abs(signal), part.trace
        found = [size - data.amplitude]
        if data.phase is not None:
            found.append(size * turned(np.angle(signal) - data.phase))
        return np.asarray(np.array(found) / self._noises(part, size))

    def measure_noise(self, found: Evaluation) -> None:
        """Noise of each range, a constant and a share of the amplitude, from what is left."""
        for place in range(len(self.ranges)):
            own = [i for i, part in enumerate(self.parts) if part.place == place]
            if not own:
                continue
            traces = [self.parts[i].trace for i in own]
            sizes = np.concatenate([found.fitted[i] for i in own])
            data = np.concatenate([trace.amplitude for trace in traces])
            self.noise[place] = noise_of(sizes, np.abs(data - sizes))
            if all(trace.phase is not None for trace in traces):
                angle = np.concatenate([found.angle[i] for i in own])
                told = np.concatenate([np.asarray(trace.phase) for trace in traces])
                self.across[place] = noise_of(sizes, np.abs(sizes * turned(angle - told)))

    # -- descent ----------------------------------------------------------------------------------

    def descend(self, x: Array, rounds: int = ROUNDS) -> Evaluation:
        """From a start to the least robust squares, with the noise that is found on the way."""
        found = self.evaluate(x)
        for _ in range(rounds):
            self.measure_noise(found)
            found, moved = self._least_squares(self.evaluate(found.x))
            if not moved:
                break
        return found

    def _least_squares(self, found: Evaluation) -> tuple[Evaluation, bool]:
        """Gauss-Newton with halved steps; whether it has moved."""
        moved = False
        for _ in range(STEPS):
            step = self.step(found)
            deviations = np.abs(step) / np.maximum(self._spread(found), 1e-300)
            if deviations.max() < SETTLED:
                break
            for _ in range(HALVINGS):
                try:
                    tried = self.evaluate(found.x + step)
                except NanoromError:  # no such device, or no motion that is found
                    tried = None
                if tried is not None and tried.cost < found.cost:
                    break
                step = 0.5 * step
            else:
                break
            gain = found.cost - tried.cost
            found, moved = tried, True
            if gain < SETTLED:
                break
        return found, moved

    def step(self, found: Evaluation) -> Array:
        """Of Gauss and Newton, in the directions that the data tell."""
        root = np.sqrt(weights(found.residual))
        rows, left = found.jacobian * root[:, None], found.residual * root
        sizes = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        u, s, vt = np.linalg.svd(rows / sizes, full_matrices=False)
        kept = s > UNDETERMINED * s[0]
        step = -(vt[kept].T @ ((u.T @ left)[kept] / s[kept])) / sizes
        logs = np.array([p.logarithm for p in self.parameters.sought])
        longest = float(np.abs(step[logs]).max(initial=0.0))
        return np.asarray(step * min(1.0, FARTHEST / max(longest, 1e-300)))

    def promised(self, found: Evaluation) -> float:
        """What the next step would save of the robust squares, to second order."""
        root = np.sqrt(weights(found.residual))
        before, after = found.residual, found.residual + found.jacobian @ self.step(found)
        return float(((root * before) ** 2).sum() - ((root * after) ** 2).sum())

    def _spread(self, found: Evaluation) -> Array:
        return np.asarray(np.sqrt(np.diag(self.covariance(found)[0])))

    def covariance(self, found: Evaluation) -> tuple[Array, Array]:
        """Covariance (p, p) of the told directions, and those that the data do not tell (k, p)."""
        rows, left = found.jacobian, found.residual
        sizes = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        _, s, vt = np.linalg.svd(rows / sizes, full_matrices=False)
        kept = s > UNDETERMINED * s[0]
        # of robust estimates (Huber 1981, Robust Statistics, sec. 7.6)
        pull, slope = weights(left) * left, (1 + (left / ROBUST) ** 2) ** -1.5
        freedom = max(len(left) - int(kept.sum()), 1)
        square = float((pull**2).sum()) / freedom / float(slope.mean()) ** 2
        part = vt[kept] / s[kept, None]
        scale = max(square, FREE) / np.outer(sizes, sizes)
        return np.asarray((part.T @ part) * scale), vt[~kept] / sizes

    def evidence(self, found: Evaluation) -> float:
        """-2 log of the likelihood, and what parameters cost (Schwarz)."""
        spread = sum(
            2 * float(np.log(self._noises(part, y)).sum())
            for part, y in zip(self.parts, found.fitted)
        )
        return found.cost + spread + len(found.x) * float(np.log(self.rows))


def quantile(confidence: float, freedom: int) -> float:
    """Half width of a confidence interval by its standard deviation."""
    return float(stats.t.ppf(0.5 + confidence / 2, max(freedom, 1)))
