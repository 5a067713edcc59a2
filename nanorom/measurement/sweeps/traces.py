"""From measured traces to peaks: directions, levels, noise, and which rows belong to which peak."""

from __future__ import annotations

import re

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import find_peaks, medfilt

from nanorom.errors import SceneError
from nanorom.measurement.data import MeasuredResponse, Trace
from nanorom.scene.units import to_si

LEAST_ROWS = 12  # of a trace, within a peak
PROMINENT = 6.0  # times the noise of a logarithm
LEAST_PROMINENCE = np.log(1.5)
GRID = 4000  # frequencies, at most, at which traces are averaged
GAUSSIAN = 1.4826  # standard deviation by the median of absolute values
LOCAL = 41  # rows whose noise is that of one place
SMOOTH = 5  # samples of the median that is looked for peaks
_NUMBER = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*)")


def directed(measured: MeasuredResponse) -> list[Trace]:
    """Traces in the order of a sweep, each up or down.

    A trace without a direction has that of its rows, and is two if it turns once.
    """
    found = []
    for trace in measured.linear().traces:
        for part in [trace] if trace.direction else _runs(trace):
            rising = part.direction == "up"
            order = np.argsort(part.frequency if rising else -part.frequency, kind="stable")
            found.append(_rows(part, order))
    return found


def _runs(trace: Trace) -> list[Trace]:
    """A trace of no direction cut where it turns."""
    steps = np.sign(np.diff(trace.frequency))
    turns = np.flatnonzero(steps[1:] * steps[:-1] < 0) + 1
    if len(turns) != 1:  # one way, or in no order at all
        down = steps.sum() < 0
        return [attrs.evolve(trace, direction="down" if down else "up")]
    ways = np.split(np.arange(len(trace.frequency)), turns + 1)
    return [
        attrs.evolve(_rows(trace, way), direction="up" if steps[way[0]] > 0 else "down")
        for way in ways
    ]


def _rows(trace: Trace, rows: NDArray[np.intp]) -> Trace:
    phase = None if trace.phase is None else trace.phase[rows]
    return attrs.evolve(
        trace, frequency=trace.frequency[rows], amplitude=trace.amplitude[rows], phase=phase
    )


def between(trace: Trace, low: float, high: float) -> Trace:
    """The rows of a trace between two frequencies in Hz."""
    return _rows(trace, np.flatnonzero((trace.frequency >= low) & (trace.frequency <= high)))


def level_ratio(level: str) -> float | None:
    """Amplitude of the drive at a level in its own unit, "-10 dBm", "5 mV"; None if not told."""
    match = _NUMBER.fullmatch(level)
    if match is None:
        return None
    value, unit = float(match[1]), match[2].strip()
    if unit.lower().startswith("db"):
        return float(10 ** (value / 20))
    for kind in ("V", "Pa", "N", "N/m", "m"):
        try:
            return to_si(f"{value} {unit}", kind, "level") if unit else value
        except SceneError:  # of another dimension, or unknown
            continue
    return None


def windows(traces: list[Trace]) -> list[tuple[float, float, float]]:
    """Low end, place and high end in Hz of every peak of traces that are averaged."""
    low = min(float(trace.frequency.min()) for trace in traces)
    high = max(float(trace.frequency.max()) for trace in traces)
    most = max(len(trace.frequency) for trace in traces)
    places = np.linspace(low, high, min(GRID, 2 * most))
    rows, noise = [], []
    for trace in traces:
        order = np.argsort(trace.frequency)
        floor = np.maximum(trace.amplitude[order], 1e-6 * trace.amplitude.max())
        logarithm = np.log(floor)
        local = median_filter(np.abs(np.diff(logarithm, append=logarithm[-1])), LOCAL)
        noise.append(np.interp(places, trace.frequency[order], local))
        own = np.interp(places, trace.frequency[order], logarithm, left=np.nan, right=np.nan)
        rows.append(own - np.median(logarithm))
    seen = np.isfinite(rows)  # nothing where no trace is: between ranges that were swept
    mean = np.where(seen, rows, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    mean[~seen.any(axis=0)] = mean[seen.any(axis=0)].min()
    mean = medfilt(np.pad(mean, SMOOTH, mode="edge"), SMOOTH)[SMOOTH:-SMOOTH]
    spread = PROMINENT * GAUSSIAN / np.sqrt(2 * len(traces)) * np.mean(noise, axis=0)
    padded = np.concatenate([[mean.min() - 1], mean, [mean.min() - 1]])  # a peak may be at an end
    found, told = find_peaks(padded, prominence=LEAST_PROMINENCE)
    found = np.clip(found - 1, 0, len(mean) - 1)
    found = found[told["prominences"] > spread[found]]
    cuts = [0, *(a + int(mean[a:b].argmin()) for a, b in zip(found, found[1:])), len(mean) - 1]
    if len(found) == 0:
        return []
    return [
        (float(places[a]), float(places[peak]), float(places[b]))
        for a, peak, b in zip(cuts, found, cuts[1:])
    ]
