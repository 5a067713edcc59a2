"""From the instrument's drive to modal forces: levels in dBm, and the shift of Duffing folds.

A drive of level l (dBm) modulates the light by an amplitude that goes with the voltage, so that
beta and gamma go with 10^(l/20).  The paper calibrates the modal forces from the frequencies at
which the driven resonance falls down: the upper fold of m q'' + c q' + k q + b q^3 = F cos(wt) is

    F^2 = x ((d + 3/4 b x)^2 + (c w)^2),   27/16 b^2 x^2 + 3 b d x + d^2 + (c w)^2 = 0

with d = k - m w^2 and x the squared amplitude there (the larger root), from one harmonic.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanorom.errors import ModelError
from nanorom.rom import ReducedModel

Array = NDArray[np.float64]

REFERENCE = 1e-3  # W: 0 dBm
DECIBELS = 20.0  # per decade of the amplitude


def power(dbm: ArrayLike) -> Array:
    """Power in W of levels in dBm."""
    return REFERENCE * 10 ** (np.asarray(dbm, dtype=float) / 10)


def amplitude_ratio(dbm: ArrayLike, reference: float) -> Array:
    """Drive amplitude at levels in dBm by that at a reference level: factor of beta and gamma."""
    return 10 ** ((np.asarray(dbm, dtype=float) - reference) / DECIBELS)


def force_of_fold(model: ReducedModel, mode: int | str, frequency: ArrayLike) -> Array:
    """Modal force amplitude (n,) in N from the upper folds of a mode at frequencies (n,) in Hz.

    mode : number or label.  Raises ModelError where no fold of that mode can be: without
    hardening, or too near to the natural frequency.
    """
    alone = model.select([mode])
    m, k, c = float(alone.mass[0]), float(alone.stiffness[0, 0]), float(alone.damping[0, 0])
    b = float(alone.cubic[0, 0, 0, 0])
    if b <= 0:
        raise ModelError(f"mode {mode!r}: no hardening (b = {b:g} N/m^3), so it has no upper fold")
    if np.abs(alone.quadratic).max() > 0:
        raise ModelError(f"mode {mode!r}: has quadratic terms; the formula is for a flat film")
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    detuning = k - m * omega**2
    discriminant = (3 * b * detuning) ** 2 - 4 * (27 / 16) * b**2 * (
        detuning**2 + (c * omega) ** 2
    )
    if (detuning >= 0).any() or (discriminant < 0).any():
        onset = alone.frequency[0] * np.sqrt(1 + np.sqrt(3) * c / np.sqrt(m * k))
        raise ModelError(
            f"frequency: mode {mode!r} at {alone.frequency[0]:.6g} Hz folds only from about "
            f"{onset:.6g} Hz on"
        )
    square = (-3 * b * detuning + np.sqrt(discriminant)) / (2 * (27 / 16) * b**2)
    return np.sqrt(square * ((detuning + 0.75 * b * square) ** 2 + (c * omega) ** 2))


@attrs.frozen(eq=False)
class Calibration:
    """Modal force of a mode per drive amplitude, from its folds at several levels.

    force: N at the reference level (dBm); spread: relative standard deviation over the levels,
    small where the force goes with the amplitude as it should.
    """

    force: float
    reference: float
    spread: float

    def at(self, dbm: ArrayLike) -> Array:
        """Force in N at levels in dBm."""
        return self.force * amplitude_ratio(dbm, self.reference)


def calibrate(
    model: ReducedModel,
    mode: int | str,
    dbm: ArrayLike,
    frequency: ArrayLike,
    reference: float = 0.0,
) -> Calibration:
    """Calibrate a mode's force from the frequencies (n,) in Hz of its folds at levels in dBm."""
    force = force_of_fold(model, mode, frequency) / amplitude_ratio(dbm, reference)
    mean = float(np.exp(np.mean(np.log(force))))
    return Calibration(mean, reference, float(np.std(np.log(force))))
