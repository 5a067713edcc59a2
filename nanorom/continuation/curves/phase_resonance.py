"""Phase resonance: what a phase-locked loop tracks while the level of the drive rises.

The loop holds the lag of an output behind the drive, 90 degrees at resonance. Along the level that
is the backbone of the damped, driven system, with no folds where the response at one level has two.
Source: Peeters, Kerschen and Golinval 2011, doi:10.1016/j.jsv.2010.08.028 (phase lag quadrature).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nanorom.continuation.arrays import checked, finite
from nanorom.continuation.branches.start import first_orbit
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.curves.conditioned import (
    OrbitCurve,
    Phase,
    PhasedCurve,
    orbit_curve,
    within,
)
from nanorom.continuation.curves.curve import Point
from nanorom.continuation.curves.parameter import Parameter, parameter_of
from nanorom.continuation.orbits.harmonics import forced_support
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

LINEAR = 1e-4  # amplitude in scaled units at which the curve begins: still linear
QUARTER = np.pi / 2


@one_thread()
def phase_resonance(
    system: ModalSystem,
    direct: tuple[float, float],
    parametric: float = 0.0,
    *,
    mode: int = 0,
    output: Array | None = None,
    lag: float = QUARTER,
    harmonic: int = 1,
    at: Sequence[float] = (),
    tolerance: float = 1e-9,
    steps: int = 300,
    largest_step: float = 0.1,
) -> OrbitCurve:
    """Orbits whose output lags behind cos(omega t) by a given angle, by level of the direct drive.

    Parameters
    ----------
    system : ModalSystem
    direct : (low, high), levels in units of the pattern
    parametric : level of the parametric drive
    mode : number of the linear mode at whose resonance the curve begins, from 0, by frequency
    output : (L,), what is measured: output @ q; the shape of the mode if left out
    lag : in rad, modulo pi: pi / 2 at resonance
    harmonic : of the drive's frequency that is measured
    at : levels at which there are to be points
    tolerance : size of the last harmonics, relative to the orbit
    steps : most steps
    largest_step : arc length, relative to the size of the orbit, the frequency and the level

    Returns
    -------
    OrbitCurve
        Stability is that at a fixed frequency: what is unstable there, a loop may hold.

    Raises
    ------
    ContinuationError
        for a mode that does not exist, invalid levels, an output without resonance, or where the
        curve cannot be begun.
    """
    low, high = _checked(direct, mode, system.size)
    line = parameter_of(system, "direct", (0.0, high), parametric=parametric)
    unit = line.unit
    frequency, shape = _mode(unit, mode)
    own = shape if output is None else _inner(unit, output)
    first = _first(line, frequency, low / line.size)
    phase = Phase(own, harmonic, lag)
    curve = PhasedCurve.along(line, phase, frequency, direct, at, tolerance)
    curve.limits = curve.limits[0], (first.level / 2, 1.0)
    try:
        points = curve.follow(first, 1.0, steps, largest_step)
    except ContinuationError:
        raise ContinuationError(
            f"lag: no orbit near mode {mode} has an output that lags by {lag:g} rad; choose an "
            "output that the drive moves at resonance"
        ) from None
    return orbit_curve(line, within(points, direct, line.size), 1, free=False)


def _checked(direct: tuple[float, float], mode: int, size: int) -> tuple[float, float]:
    """The levels; raises ContinuationError for those, or a mode, that do not do."""
    low, high = direct
    if not (finite(low) and finite(high) and 0 < low < high):
        raise ContinuationError(f"direct: found {direct}; allowed 0 < low < high")
    if not 0 <= mode < size:
        raise ContinuationError(f"mode: found {mode}; allowed 0 to {size - 1}")
    return float(low), float(high)


def _mode(unit: ScaledSystem, mode: int) -> tuple[float, Array]:
    """Natural frequency and shape (L,) of a linear mode, states of first order at rest."""
    massive = np.flatnonzero(unit.inertia)
    values, vectors = np.linalg.eig(unit.stiffness[np.ix_(massive, massive)])
    chosen = np.argsort(values.real)[mode]
    shape = np.zeros(unit.size)
    shape[massive] = vectors[:, chosen].real
    return float(np.sqrt(values.real[chosen])), shape


def _inner(unit: ScaledSystem, output: Array) -> Array:
    """An output of the model by the coordinates of the equations."""
    modes = np.asarray(output, dtype=float)
    given = checked(
        np.append(modes, np.zeros(max(unit.size - modes.size, 0))), (unit.size,), "output"
    )
    return given if unit.shapes is None else unit.shapes.T @ given


def _first(line: Parameter, frequency: float, low: float) -> Point:
    """The response at resonance to a drive that is weak enough for it to be linear."""
    weak = line.at(low)
    impedance = weak.stiffness - weak.inertia * np.eye(weak.size) * frequency**2
    linear = np.linalg.solve(impedance + 1j * frequency * weak.damping, weak.force[:, 1] + 0j)
    size = float(np.abs(linear).max())
    if size == 0:
        raise ContinuationError("direct: the drive moves nothing at its own frequency")
    level = low * min(1.0, LINEAR / size)
    system = line.at(level)
    tracer = Tracer(system, forced_support(system), 1, Settings())
    return Point(first_orbit(tracer, frequency).coefficients, frequency, level)
