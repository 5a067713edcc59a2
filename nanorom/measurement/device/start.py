"""Where the fit of a device begins: what its peaks tell one by one (`sweeps.peaks`).

The four numbers of every peak (frequency, Q, Duffing coefficient, forces) are functions of the
device's numbers with exact derivatives, so that a few steps of least squares are the global start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nanorom.errors import SceneError
from nanorom.measurement.device.parameters import FARTHEST, Device, Parameters
from nanorom.measurement.sweeps.peaks import Peak
from nanorom.types import Array

STEPS = 12
SETTLED = 1e-4  # of a logarithm
LEAST = 1e-6, 1e-2  # relative deviation of frequencies, and of the rest: one mode's formula
NORMAL = 1.96  # standard deviations in a half width
TOLD = 5.0  # relative half width beyond which a peak does not tell a number: a rough one is
# better than none, without which drive and read-out would begin anywhere
UNDETERMINED = 1e-7


def from_peaks(
    parameters: Parameters,
    peaks: Sequence[Peak],
    mode: Sequence[int],
    levels: Mapping[str, float],
) -> Array:
    """Parameters (p,) that meet the peaks best; mode: which of the device's each peak is."""
    x = parameters.start()
    for number in range(STEPS):
        left, rows = _differences(parameters.device(x), peaks, mode, levels)
        if number == 0:  # the instruments first: the film is known best where it is not told
            rows[:, : len(parameters.unknowns)] = 0.0
        sizes = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        u, s, vt = np.linalg.svd(rows / sizes, full_matrices=False)
        kept = s > UNDETERMINED * max(s[0], 1e-300)
        step = -(vt[kept].T @ ((u.T @ left)[kept] / s[kept])) / sizes
        film = len(parameters.unknowns)  # the rest acts as a factor: its logarithm is linear
        longest = float(np.abs(step[:film]).max(initial=0.0))
        x = x + step * min(1.0, FARTHEST / max(longest, 1e-300))
        logs = np.array([parameter.logarithm for parameter in parameters.sought])
        if number and float(np.abs(step[logs]).max(initial=0.0)) < SETTLED:
            break
    return x


def _differences(
    device: Device, peaks: Sequence[Peak], mode: Sequence[int], levels: Mapping[str, float]
) -> tuple[Array, Array]:
    """Logarithms of computed by found numbers, by their deviations, and derivatives."""
    terms, changes = device.terms, device.changes
    left, rows = [], []
    for peak, r in zip(peaks, mode):
        k, c, b = terms.stiffness[r], terms.damping[r], terms.cubic[r, r, r, r]
        gain, force = device.gain[r], terms.force[r]
        if force == 0:
            raise SceneError(
                f"unknowns: found drive, whose pattern does not move {device.label[r]}; allowed: "
                "drives, or another pattern in [drive]"
            )
        by_k = np.array([change.stiffness[r] for change in changes]) / k
        by_c = np.array([change.damping[r] for change in changes]) / c
        by_b = np.array([change.cubic[r, r, r, r] for change in changes]) / b
        by_gain = device.gains[:, r] / gain
        by_force = np.array([change.force[r] for change in changes]) / force
        frequency = np.sqrt(k) / (2 * np.pi) + device.offset
        entries = [
            (frequency, peak.frequency, 0.5 * by_k + device.offsets / frequency, LEAST[0]),
            (np.sqrt(k) / c, peak.quality_factor, 0.5 * by_k - by_c, LEAST[1]),
            (b / k / gain**2, peak.duffing, by_b - by_k - 2 * by_gain, LEAST[1]),
        ]
        for level, found in peak.force.items():
            own = gain * force * levels[level] / k
            entries.append((own, found, by_gain + by_force - by_k, LEAST[1]))
        for computed, found, slope, least in entries:
            relative = abs(found.interval / found.value) if found.value else np.inf
            if found.value <= 0 or not relative < TOLD or not computed > 0:
                continue
            deviation = max(relative / NORMAL, least)
            left.append(np.log(computed / found.value) / deviation)
            rows.append(slope / deviation)
    return np.array(left), np.array(rows)
