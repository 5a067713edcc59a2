"""What each peak of a plain sweep tells without a model of the film.

    q'' + (w0/Q) (1 + e q^2) q' + w0^2 (q + b q^3) = F cos(wt)

in the unit of the amplitude as it was measured: f0 and Q are the film's, b and e are by the square
of that unit.  A fit to all levels and directions together; which terms the data have is chosen by
their evidence (Schwarz, Ann. Stat. 6 (1978) 461, doi:10.1214/aos/1176344136).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np
from scipy import stats

from nanorom.errors import FileError
from nanorom.measurement.data import MeasuredResponse, Trace
from nanorom.measurement.sweeps.fit import SweepFit
from nanorom.measurement.sweeps.traces import LEAST_ROWS, between, directed, windows
from nanorom.types import Array

CONFIDENCE = 0.95
MOST_PEAKS = 30
LEAST_DAMPING = 0.1  # of the linear one at the largest amplitude: where its fit begins
CORRELATED = 5.0  # standard deviations of what noise has: neighbouring differences are alike
NOISE_ROUNDS = 2
TERMS = ((False, False), (True, False), (False, True), (True, True))  # nonlinear loss, background


@attrs.frozen
class Estimate:
    """A value with the half width of its 95 % confidence interval, in the same unit."""

    value: float
    interval: float

    def holds(self, value: float) -> bool:
        """Whether a value, in that unit, is within the interval."""
        return abs(value - self.value) <= self.interval


@attrs.frozen
class Fall:
    """Where a trace leaves its branch: level, direction, and the two rows (2,) in Hz.

    fold: where the fitted branch ends, Hz; early: the trace fell well before.
    """

    level: str
    direction: str
    rows: tuple[float, float]
    fold: float
    early: bool


@attrs.frozen(eq=False, kw_only=True)
class Peak:
    """One resonance.

    frequency: f0, Hz; quality_factor: ratio; linewidth: f0/Q, Hz; duffing: b, nonlinear_damping:
    e, both in 1/unit^2, the last None if the data have none; force: level -> F/w0^2 in the unit,
    what a static drive of that size would move; falls: of all traces that jump; noise: relative,
    of the largest amplitude; traces, fitted: the rows that were used and what the fit has there
    (n,) in the unit; misfit: what is left is more than noise; unit: of the amplitude.
    """

    frequency: Estimate
    quality_factor: Estimate
    linewidth: Estimate
    duffing: Estimate
    nonlinear_damping: Estimate | None
    force: dict[str, Estimate]
    background: bool
    falls: tuple[Fall, ...]
    noise: float
    misfit: bool
    traces: tuple[Trace, ...]
    fitted: tuple[Array, ...]
    unit: str


def find_peaks(
    measured: MeasuredResponse, progress: Callable[[str, int, int], None] | None = None
) -> list[Peak]:
    """Every peak of measured sweeps, by frequency.

    measured : amplitudes against frequency, up or down or both, at one or several levels.

    Raises FileError where there is no peak, or too few rows.
    """
    traces = [t for t in directed(measured) if len(t.frequency) >= LEAST_ROWS]
    if not traces:
        raise FileError(f"measured data: found no sweep of at least {LEAST_ROWS} rows")
    if any(float(trace.amplitude.max()) <= 0 for trace in traces):
        raise FileError("measured data: amplitude: found a sweep without any; allowed: above 0")
    places = windows(traces)
    if len(places) > MOST_PEAKS:
        raise FileError(
            f"measured data: found {len(places)} peaks, which is noise; allowed: {MOST_PEAKS}"
        )
    unit, found = measured.linear().unit, []
    for number, (low, _, high) in enumerate(places):
        if progress is not None:
            progress("peaks", number, len(places))
        own = [between(trace, low, high) for trace in traces]
        own = [trace for trace in own if len(trace.frequency) >= LEAST_ROWS]
        if own:
            found.append(fit_peak(own, unit))
    if not found:
        raise FileError(f"measured data: no peak has {LEAST_ROWS} rows; sweep it more finely")
    return found


def fit_peak(traces: Sequence[Trace], unit: str) -> Peak:
    """The resonance of traces that have one, in a unit of amplitude."""
    names = list(dict.fromkeys(trace.level for trace in traces))
    level = [names.index(trace.level) for trace in traces]
    fit = SweepFit(list(traces), level, False, False)
    p = _refined(fit, fit.descend(fit.start()))
    tried = {TERMS[0]: (fit.evidence(p), fit, p)}
    for terms in TERMS[1:]:
        if all(terms) and min(tried.values(), key=_cost) is tried[TERMS[0]]:
            continue  # neither by itself
        more = SweepFit(list(traces), level, *terms)
        more.noise = fit.noise
        start = np.where((np.arange(len(p)) == 3) & terms[0], LEAST_DAMPING, p)
        end = _refined(more, more.descend(start))
        tried[terms] = more.evidence(end), more, end
    _, fit, p = min(tried.values(), key=_cost)
    return _peak(fit, p, names, unit)


def _cost(tried: tuple[float, SweepFit, Array]) -> float:
    return tried[0]


def _refined(fit: SweepFit, p: Array) -> Array:
    """Parameters (p,) with the noise that is found on the way."""
    for _ in range(NOISE_ROUNDS):
        fit.settle_falls(p)
        fit.measure_noise(p)
        p = fit.descend(p)
    return p


def _peak(fit: SweepFit, p: Array, names: list[str], unit: str) -> Peak:
    """What a fit tells, in Hz and the unit of the amplitude."""
    free, covariance = fit.sought().tolist(), fit.covariance(p)
    quantile = float(stats.t.ppf(0.5 + CONFIDENCE / 2, max(fit.rows - len(free), 1)))

    def told(value: Callable[[Array], float]) -> Estimate:
        slopes = []
        for i in free:
            step = 1e-6 * max(abs(p[i]), 1.0) * (np.arange(len(p)) == i)
            slopes.append((value(p + step) - value(p - step)) / (2 * float(step.sum())))
        slope = np.array(slopes)
        return Estimate(value(p), quantile * float(np.sqrt(slope @ covariance @ slope)))

    def place(p: Array) -> float:
        return fit.scale * float(np.sqrt(fit.resonance(p).square))

    def linewidth(p: Array) -> float:
        return fit.scale * fit.resonance(p).loss

    def cubic(p: Array) -> float:
        own = fit.resonance(p)
        return own.cubic / own.square / fit.size**2

    def damping(p: Array) -> float:
        own = fit.resonance(p)
        return own.damping / own.loss / fit.size**2

    def force(number: int) -> Callable[[Array], float]:
        return lambda p: float(np.exp(p[6 + number])) / fit.resonance(p).square * fit.size

    left = fit.residual(p)[: fit.rows]
    return Peak(
        frequency=told(place),
        linewidth=told(linewidth),
        quality_factor=told(lambda p: place(p) / linewidth(p)),
        duffing=told(cubic),
        nonlinear_damping=told(damping) if fit.nonlinear_loss else None,
        force={name: told(force(number)) for number, name in enumerate(names)},
        background=fit.background,
        falls=_falls(fit, p),
        noise=float(np.median([np.median(noise) for noise in fit.noise])),
        misfit=is_alike(left, [len(trace.frequency) for trace in fit.traces]),
        traces=tuple(fit.traces),
        fitted=_fitted(fit, p, left),
        unit=unit,
    )


def _falls(fit: SweepFit, p: Array) -> tuple[Fall, ...]:
    curves, found = fit.curves(p), []
    for t, trace in enumerate(fit.traces):
        fall, curve = fit.falls[t], curves[fit.level[t]]
        fold = curve.upper if trace.direction == "up" else curve.lower
        if fold is not None and 0 < fall < len(trace.frequency):
            rows = float(trace.frequency[fall - 1]), float(trace.frequency[fall])
            end = fit.scale * float(np.sqrt(fold[0]))
            found.append(Fall(trace.level, trace.direction, rows, end, fit.early[t]))
    return tuple(found)


def _fitted(fit: SweepFit, p: Array, left: Array) -> tuple[Array, ...]:
    ends = np.cumsum([len(trace.frequency) for trace in fit.traces])[:-1]
    return tuple(
        fit.size * (y + part * noise)
        for y, part, noise in zip(fit.heights, np.split(left, ends), fit.noise)
    )


def is_alike(left: Array, lengths: list[int]) -> bool:
    """Whether neighbouring differences are more alike than those of noise."""
    total, count = 0.0, 0
    for part in np.split(np.clip(left, -4, 4), np.cumsum(lengths)[:-1]):
        total += float((part[1:] * part[:-1]).sum())
        count += len(part) - 1
    square = float((np.clip(left, -4, 4) ** 2).mean())
    return bool(total / max(square, 1e-300) > CORRELATED * np.sqrt(count))
