"""Measured phases: how the instrument turns them and counts them, before a fit begins.

A lock-in's reference, cables and mirrors add a turn, which is one number about each resonance; and
some count the phase against time, so that it rises where that of a motion falls.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.measurement.device.fit import DeviceFit

SENSES = (1.0, -1.0)


def turned(angle: Array) -> Array:
    """Angles (n,) in rad between -pi and pi."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


def with_phases(fit: DeviceFit, x: Array) -> tuple[DeviceFit, Array]:
    """A fit whose phases count as the motion's do, and x (p,) with the turns of its ranges.

    Both are those with which measured phases lie closest to the device's at x.
    """
    if all(part.trace.phase is None for part in fit.parts):
        return fit, x
    found = fit.evaluate(x)
    sums = np.zeros((len(SENSES), len(fit.ranges)), dtype=complex)
    for part, size, angle in zip(fit.parts, found.fitted, found.angle):
        for s, sense in enumerate(SENSES):
            away = sense * np.asarray(part.trace.phase) - angle
            sums[s, part.place] += np.sum(size * np.exp(1j * away)) / size.sum()
    best = int(np.abs(sums).sum(axis=1).argmax())
    parts = [
        attrs.evolve(
            part,
            trace=attrs.evolve(part.trace, phase=SENSES[best] * np.asarray(part.trace.phase)),
        )
        for part in fit.parts
    ]
    turns, start = np.angle(sums[best]), x.copy()
    for i, parameter in enumerate(fit.parameters.sought):
        if parameter.name == "phase":
            label = fit.parameters.label
            one = label.index(parameter.mode) if parameter.mode else 0
            start[i] = turns[one] if parameter.mode else float(np.angle(sums[best].sum()))
    return attrs.evolve(fit, parts=parts), start
