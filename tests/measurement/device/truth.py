"""Sweeps of modal models whose truth is known: stable orbits that the continuation finds."""

import numpy as np
from scipy.interpolate import CubicSpline

from nanorom.continuation import explore
from nanorom.continuation.readout import readout
from nanorom.measurement.data import MeasuredResponse, Trace

SAMPLES = 20_001  # of the spline along a branch
TOLERANCE = 1e-8


def sweeps(system, hertz, levels, gain, unit="a.u.", depth=1, directions=("up", "down")):
    """Traces at ranges of frequencies (list of (n,) Hz) and levels (name -> value) of a system,
    whose modes are read with gains (L,).

    A sweep goes on along its stable branch, and from its end to the stable orbit that is nearest.
    """
    found = []
    for rows in hertz:
        for name, level in levels.items():
            omega = 2 * np.pi * rows
            limits = (omega[0] - 0.02 * omega[0], omega[-1] + 0.02 * omega[-1])
            diagram = explore(system, limits, level, depth=depth, tolerance=TOLERANCE)
            curves = [c for branch in diagram.branches for c in _stable(branch, gain)]
            for direction in directions:
                order = slice(None) if direction == "up" else slice(None, None, -1)
                signal = _followed(curves, omega[order])
                size, phase = np.abs(signal), np.angle(signal)
                found.append(Trace(rows[order], size, name, direction, phase))
    return MeasuredResponse(tuple(found), unit)


def noisy(measured, noise, seed, floor=0.0):
    """With noise relative to the amplitude, and a floor relative to the largest of all."""
    random = np.random.default_rng(seed)
    largest = max(trace.amplitude.max() for trace in measured.traces)
    traces = []
    for trace in measured.traces:
        share, rest = random.standard_normal((2, len(trace.amplitude)))
        size = trace.amplitude * (1 + noise * share) + floor * largest * rest
        traces.append(Trace(trace.frequency, np.abs(size), trace.level, trace.direction))
    return MeasuredResponse(tuple(traces), measured.unit)


def quadratures(measured, noise, seed, turn=0.0, sense=1.0):
    """As a lock-in reads them: both with their own noise, relative to the amplitude, and phases
    that the instrument turns by an angle in rad, or counts the other way.
    """
    random = np.random.default_rng(seed)
    traces = []
    for trace in measured.traces:
        x, y = random.standard_normal((2, len(trace.amplitude)))
        signal = trace.amplitude * np.exp(1j * (trace.phase + turn)) * (1 + noise * (x + 1j * y))
        phase = sense * np.angle(signal)
        traces.append(Trace(trace.frequency, abs(signal), trace.level, trace.direction, phase))
    return MeasuredResponse(tuple(traces), measured.unit)


def with_outliers(measured, share, seed, factor=3.0):
    """Some rows replaced by what a disturbed instrument might have read."""
    random = np.random.default_rng(seed)
    traces = []
    for trace in measured.traces:
        size = trace.amplitude.copy()
        hit = random.random(len(size)) < share
        size[hit] *= factor * random.random(int(hit.sum()))
        traces.append(Trace(trace.frequency, size, trace.level, trace.direction, trace.phase))
    return MeasuredResponse(tuple(traces), measured.unit)


def _stable(branch, gain):
    """Curves (omega, complex reading) of the stable stretches of a branch, omega rising."""
    stable = np.asarray(branch.stable, bool)
    table = readout(branch, gain)
    width = np.ptp(branch.omega)
    steps = np.hypot(
        np.diff(table.omega) / width, np.abs(np.diff(table.amplitude)) / table.size.max()
    )
    way = np.append(0, np.cumsum(steps))
    fine = np.linspace(0, way[-1], SAMPLES)
    omega, x, y = CubicSpline(way, np.column_stack([table.omega, table.x, table.y]))(fine).T
    nearest = np.clip(np.searchsorted(way, fine), 1, len(way) - 1)
    inside = stable[nearest - 1] & stable[nearest]
    rising = np.gradient(omega)
    edge = stable[nearest - 1] != stable[nearest]
    kept = inside | (
        edge & (np.sign(rising) == np.sign(rising[_anchor(nearest, stable, way, fine)]))
    )
    cuts = np.flatnonzero(np.diff(kept.astype(int))) + 1
    turns = np.flatnonzero(np.diff(np.sign(rising)) != 0) + 1
    found = []
    for part in np.split(np.arange(SAMPLES), np.unique(np.concatenate([cuts, turns]))):
        if len(part) > 3 and kept[part].all():
            order = part if omega[part[-1]] > omega[part[0]] else part[::-1]
            found.append((omega[order], (x + 1j * y)[order]))
    return found


def _anchor(nearest, stable, way, fine):
    """A sample next to the stable one of the two points beside each sample."""
    point = np.where(stable[nearest - 1], nearest - 1, nearest)
    return np.clip(np.searchsorted(fine, way[point]), 1, len(fine) - 2)


def _followed(curves, omega):
    found, current, last = np.empty(len(omega), dtype=complex), None, None
    for row, at in enumerate(omega):
        if current is None or not current[0][0] <= at <= current[0][-1]:
            open_ones = [c for c in curves if c[0][0] <= at <= c[0][-1]]
            if last is None:
                current = min(open_ones, key=lambda c: abs(np.interp(at, *c)))
            else:
                current = min(open_ones, key=lambda c: abs(np.interp(at, *c) - last))
        last = np.interp(at, *current)
        found[row] = last
    return found
