"""Ring-down: the free motion from an orbit when the drive is switched off.

The output is mixed down with its own phase (`lockin`), found in rounds, so that what is left in the
window is one motion whose frequency changes slowly: with the amplitude, of a nonlinear film.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
from scipy.integrate import cumulative_trapezoid

from nanorom.continuation.arrays import brief, finite
from nanorom.continuation.integration import check_periods, integrated
from nanorom.continuation.lockin import PER_PERIOD, centres, demodulate
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.sweep import equations
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

ROUNDS = 3  # of mixing with a better phase
TURN = 2 * np.pi


@brief
@attrs.frozen(eq=False)
class RingDown:
    """A free motion in time, in units of the system.

    time (n,) from the switching on; amplitude (n,) of the output; omega (n,): its instantaneous
    frequency, rad per unit of time; decay (n,): rate at which the logarithm of its amplitude falls,
    per unit of time; state (2L,) = (q, dq/dt) at the end.
    """

    time: Array
    amplitude: Array
    omega: Array
    decay: Array
    state: Array

    @property
    def quality_factor(self) -> Array:
        """omega / (2 decay) (n,), a ratio."""
        return np.asarray(self.omega / (2 * self.decay))


@one_thread()
def ring_down(
    system: ModalSystem,
    orbit: PeriodicOrbit,
    time: float,
    *,
    output: Array | None = None,
    phase: float = 0.0,
    periods: int = 16,
    tolerance: float = 1e-10,
    progress: Callable[[int, int], None] | None = None,
) -> RingDown:
    """Let a motion ring down from an orbit without drive.

    Parameters
    ----------
    system : ModalSystem
    orbit : PeriodicOrbit
        The motion until then.
    time : how long, in the system's unit of time
    output : (L,), what is measured: output @ q; the coordinate that moves most if left out
    phase : of the drive at which it is switched off, rad
    periods : of the motion, over which the record is averaged
    tolerance : relative error of the time integration
    progress : called with (samples done, of how many)

    Raises
    ------
    ContinuationError
        for an orbit or output that do not fit, and for a time of too many or too few periods.
    """
    scaled = system.scaled()
    if orbit.coefficients.shape[1] != scaled.size:
        raise ContinuationError(
            f"orbit: found {orbit.coefficients.shape[1]} coordinates; allowed {scaled.size}"
        )
    weights = _output(orbit) if output is None else np.asarray(output, dtype=float)
    if weights.shape != (scaled.size,):
        raise ContinuationError(f"output: shape {weights.shape}, expected {(scaled.size,)}")
    reference = orbit.omega / orbit.period_multiple * _strongest(orbit, weights)
    if not finite(time) or time * reference / TURN < 2 * periods:
        raise ContinuationError(
            f"time: found {time!r}; allowed more than {2 * periods * TURN / reference:.3g}, two "
            "windows"
        )
    check_periods(time * reference / TURN, scaled.size, "take a shorter time")
    spacing = TURN / reference / PER_PERIOD
    at = phase / orbit.omega
    start = np.concatenate([orbit(at), orbit.velocity(at)])
    states, whole = integrated(
        equations(scaled, reference / scaled.frequency),
        scaled.inner_states(start),
        spacing * scaled.frequency,
        int(time / spacing) + 1,
        tolerance,
        progress,
    )
    if not whole:
        raise ContinuationError("time: without drive the motion leaves all bounds")
    signal = scaled.given(states[:, : scaled.size]) @ weights
    return _tracked(signal, reference, spacing, periods, scaled.given_states(states[-1]))


def _tracked(
    signal: Array, reference: float, spacing: float, periods: int, state: Array
) -> RingDown:
    """Amplitude and frequency of a signal that begins at a reference frequency."""
    times = spacing * np.arange(len(signal))
    within = centres(len(signal), periods)
    angle = reference * times
    for _ in range(ROUNDS):
        mixed = demodulate(signal, angle, 1, periods)
        turning = _slope(np.unwrap(np.angle(mixed)), spacing)
        omega = np.gradient(angle, spacing)
        omega[within] += np.pad(turning, PER_PERIOD // 2, mode="edge")
        angle = cumulative_trapezoid(_extended(omega, within), times, initial=0.0)
    mixed = demodulate(signal, angle, 1, periods)
    inner = slice(PER_PERIOD // 2, len(mixed) - PER_PERIOD // 2)
    return RingDown(
        time=times[within][inner],
        amplitude=np.abs(mixed)[inner],
        omega=omega[within][inner] + _slope(np.unwrap(np.angle(mixed)), spacing),
        decay=-_slope(np.log(np.abs(mixed)), spacing),
        state=state,
    )


def _extended(values: Array, within: slice) -> Array:
    """Values that are known within a slice, continued by straight lines."""
    result = values.copy()
    half, last = within.start, len(values) - 1
    for edge, inner in ((half, 2 * half), (within.stop - 1, within.stop - 1 - half)):
        outside = np.arange(edge) if edge < inner else np.arange(edge, last + 1)
        slope = (values[inner] - values[edge]) / (inner - edge)
        result[outside] = values[edge] + slope * (outside - edge)
    return result


def _slope(values: Array, spacing: float) -> Array:
    """Derivative over a period: what is left of twice its frequency does not show."""
    change = values[PER_PERIOD:] - values[:-PER_PERIOD]
    return np.asarray(change / (PER_PERIOD * spacing))


def _output(orbit: PeriodicOrbit) -> Array:
    sizes = np.abs(orbit.coefficients[1:]).max(axis=0)
    return np.eye(len(sizes))[int(sizes.argmax())]


def _strongest(orbit: PeriodicOrbit, weights: Array) -> int:
    """The harmonic of the orbit that is largest in an output."""
    sizes = np.abs(orbit.spectrum()[1][1:] @ weights)
    if not sizes.any():
        raise ContinuationError("output: it does not move on this orbit")
    return int(sizes.argmax()) + 1
