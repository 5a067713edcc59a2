"""From the instrument's drive to modal forces: levels in dBm, folds and tongues that were measured.

A drive of level l (dBm) modulates the light by an amplitude that goes with the voltage, so that
beta and gamma go with 10^(l/20).  The paper calibrates the modal forces from the frequencies at
which the driven resonance falls down: the upper fold of m q'' + c q' + k q + b q^3 = F cos(wt) is

    F^2 = x ((d + 3/4 b x)^2 + (c w)^2),   27/16 b^2 x^2 + 3 b d x + d^2 + (c w)^2 = 0

with d = k - m w^2 and x the squared amplitude there (the larger root), from one harmonic.  The
parametric force gamma J follows from the tongue in which the mode doubles its period, with edges

    w = 2 w_r (1 +- sqrt(g^2 - 1)/(2 Q)),   g = gamma J Q/(2 k)
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from nanorom.continuation.orbits.bifurcations import FOLD
from nanorom.errors import ModelError
from nanorom.rom.model import ReducedModel
from nanorom.scene.units import with_unit
from nanorom.types import Array

REFERENCE = 1e-3  # W: 0 dBm
DECIBELS = 20.0  # per decade of the amplitude
BEFORE = 0.98  # of the natural frequency: where the curve of folds is looked for from
BEYOND = 1.05  # of the highest fold: how far it is followed
FAR = 2.0  # by the one-mode level: coupling changes it by less
STEP = 0.03  # along the curve of folds, between whose points levels are interpolated
STEPS = 400


def power(dbm: ArrayLike) -> Array:
    """Power (...) in W of levels (...) in dBm."""
    return REFERENCE * 10 ** (np.asarray(dbm, dtype=float) / 10)


def amplitude_ratio(dbm: ArrayLike, reference: float) -> Array:
    """Drive amplitude (...) at levels (...) in dBm by that at a reference level in dBm.

    It is the factor of the paper's beta and gamma.
    """
    return 10 ** ((np.asarray(dbm, dtype=float) - reference) / DECIBELS)


def force_of_fold(model: ReducedModel, mode: int | str, frequency: ArrayLike) -> Array:
    """Modal force amplitude (n,) in N from the upper folds of a mode at frequencies (n,) in Hz.

    The mode alone, as in the paper.  mode : number or label.  Raises ModelError where no fold of
    that mode can be: without hardening, or too near to the natural frequency.
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
    discriminant = (3 * b * detuning) ** 2 - 4 * (27 / 16) * b**2 * (detuning**2 + (c * omega) ** 2)
    if (detuning >= 0).any() or (discriminant < 0).any():
        onset = alone.frequency[0] * np.sqrt(1 + np.sqrt(3) * c / np.sqrt(m * k))
        raise ModelError(
            f"frequency: mode {mode!r} at {with_unit(alone.frequency[0], 'Hz', 6)} folds only from "
            f"about {with_unit(onset, 'Hz', 6)} on"
        )
    square = (-3 * b * detuning + np.sqrt(discriminant)) / (2 * (27 / 16) * b**2)
    return np.asarray(np.sqrt(square * ((detuning + 0.75 * b * square) ** 2 + (c * omega) ** 2)))


def level_of_fold(
    model: ReducedModel, mode: int | str, frequency: ArrayLike, pattern: ArrayLike
) -> Array:
    """Drive level (n,) from the upper folds of a mode at frequencies (n,) in Hz, all modes moving.

    pattern : J (L,) in N per unit of the level, as a spot or a pressure gives it.  The curve of
    folds in the plane of frequency and level is followed through the frequencies.  Raises
    ModelError, ContinuationError.
    """
    from nanorom.continuation import explore
    from nanorom.continuation.curves.locus import locus

    folds = np.asarray(frequency, dtype=float)
    force = np.asarray(pattern, dtype=float)
    (r,) = np.flatnonzero(model.number == model.select([mode]).number[0])
    if force[r] == 0:
        raise ModelError(f"pattern: no force on mode {mode!r}")
    guess = force_of_fold(model, mode, folds) / abs(force[r])
    system = attrs.evolve(model, drive={"found": force}, parametric={}).system("found", "paper")
    low, high = BEFORE * float(model.frequency[r]), BEYOND * float(folds.max())
    omega = 2 * np.pi * low, 2 * np.pi * high
    level = float(guess.min())
    diagram = explore(system, omega, level, depth=0, tolerance=1e-8)
    own = [point for point in diagram.points(FOLD.code) if np.argmax(point.amplitude) == r]
    if not own:
        raise ModelError(f"mode {mode!r}: does not fold at level {level:g} with all modes moving")
    start = max(own, key=lambda point: point.omega)
    limits = (level / FAR, float(guess.max()) * FAR)
    options: dict[str, Any] = {"steps": STEPS, "largest_step": STEP}
    curve = locus(system, start, level, 0.0, omega=omega, level=limits, **options)
    cusp = int(curve.level.argmin())  # where upper and lower folds meet, if the curve gets there
    here = int(np.hypot(curve.omega / start.omega - 1, curve.level / level - 1).argmin())
    upper = np.arange(cusp, len(curve.omega)) if here >= cusp else np.arange(cusp, -1, -1)
    upper = upper[np.append(True, np.diff(np.maximum.accumulate(curve.omega[upper])) > 0)]
    way = CubicSpline(curve.omega[upper], np.log(curve.level[upper]), extrapolate=False)
    found = way(2 * np.pi * folds)
    if np.isnan(found).any():
        raise ModelError(f"frequency: the folds of mode {mode!r} cannot be followed to all of them")
    return np.asarray(np.exp(found))


def force_of_tongue(model: ReducedModel, mode: int | str, low: ArrayLike, high: ArrayLike) -> Array:
    """Parametric force gamma J (n,) in N/m of a mode from its two period doublings in Hz.

    Where the tongue just opens (low = high) it is 2 k/Q.
    """
    alone = model.select([mode])
    k, f = float(alone.stiffness[0, 0]), float(alone.frequency[0])
    quality = 2 * np.pi * f * float(alone.mass[0]) / float(alone.damping[0, 0])
    width = (np.asarray(high, dtype=float) - np.asarray(low, dtype=float)) / (2 * f)
    return np.asarray(2 * k / quality * np.sqrt(1 + (quality * width) ** 2))


@attrs.frozen(eq=False)
class Calibration:
    """Modal force of a mode per drive amplitude, from its folds or tongues at several levels.

    force: N (or N/m) at the reference level (dBm); spread: relative standard deviation over the
    levels, small where the force goes with the amplitude as it should.
    """

    force: float
    reference: float
    spread: float

    @classmethod
    def of(cls, dbm: ArrayLike, force: ArrayLike, reference: float = 0.0) -> Calibration:
        """From forces (n,) in N, or N/m, at levels (n,) in dBm; reference: in dBm."""
        logarithm = np.log(np.asarray(force) / amplitude_ratio(dbm, reference))
        return cls(float(np.exp(logarithm.mean())), reference, float(logarithm.std()))

    def at(self, dbm: ArrayLike) -> Array:
        """Force (...) in N, or N/m, at levels (...) in dBm."""
        return self.force * amplitude_ratio(dbm, self.reference)


def calibrate(
    model: ReducedModel,
    mode: int | str,
    dbm: ArrayLike,
    frequency: ArrayLike,
    reference: float = 0.0,
    pattern: ArrayLike | None = None,
) -> Calibration:
    """Calibrate a mode's force from the frequencies (n,) in Hz of its folds at levels (n,) in dBm.

    reference : level in dBm at which the force is told; pattern : J (L,) in N per unit of the
    level if the force on all modes is known but for a factor; then all modes move
    (`level_of_fold`).  Else the mode moves alone, as in the paper.  Raises ModelError where no
    fold of that mode can be, ContinuationError where it cannot be followed.
    """
    if pattern is None:
        return Calibration.of(dbm, force_of_fold(model, mode, frequency), reference)
    own = model.select([mode]).number[0] == model.number
    force = level_of_fold(model, mode, frequency, pattern) * np.abs(np.asarray(pattern)[own])
    return Calibration.of(dbm, force, reference)
