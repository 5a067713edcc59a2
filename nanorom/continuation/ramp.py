"""Ramps: the drive frequency passes a range at a constant rate, as instruments sweep it.

Unlike `sweep`, which waits at every frequency, the phase of the drive is that of the moving
frequency, omega t + (rate / 2) t^2, so that ringing and the shift of jumps are those of the ramp.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from nanorom.continuation.arrays import brief, finite
from nanorom.continuation.integration import check_periods, integrated
from nanorom.continuation.lockin import LEAST_PERIODS, PER_PERIOD, centres, demodulate
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.sweep import DISTURBANCE, equations
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

TURN = 2 * np.pi


@brief
@attrs.frozen(eq=False)
class Ramp:
    """What a lock-in amplifier records during a ramp, in units of the system.

    time (n,); omega (n,): drive frequency, rad per unit of time; amplitude (n, L): complex, of q_r
    = Re amplitude exp(i k phase of the drive); state (2L,) = (q, dq/dt) at the end; escaped:
    frequency at which the motion left all bounds and the record ends, or None.
    """

    time: Array
    omega: Array
    amplitude: Numbers
    state: Array
    escaped: float | None = None

    @property
    def frequency(self) -> Array:
        """omega / (2 pi) (n,): in Hz where omega is in rad/s."""
        return np.asarray(self.omega / TURN)


@one_thread()
def ramp(
    system: ModalSystem,
    omega: tuple[float, float],
    rate: float,
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    state: Array | None = None,
    harmonic: int = 1,
    periods: int = 16,
    tolerance: float = 1e-8,
    progress: Callable[[int, int], None] | None = None,
) -> Ramp:
    """Integrate the equations of motion while the drive frequency rises or falls steadily.

    Parameters
    ----------
    system : ModalSystem
    omega : (from, to), rad per unit of time; falling where the second one is lower
    rate : speed of the ramp, change of omega / (2 pi) per unit of time: Hz/s where time is in s
    direct, parametric : drive levels
    state : (2L,), initial (q, dq/dt); a small disturbance of rest if left out
    harmonic : of the drive that is recorded
    periods : of the drive, over which the record is averaged
    tolerance : relative error of the time integration
    progress : called with (samples done, of how many)

    Raises
    ------
    ContinuationError
        for frequencies, rates or states that do not do, and for a ramp of too many periods.
    """
    scaled = system.scaled(direct, parametric)
    chirp = _chirp(scaled, omega, rate, periods)
    states, whole = integrated(
        equations(scaled, chirp.begin, chirp.angle),
        _start(scaled, state),
        chirp.spacing,
        chirp.count,
        tolerance,
        progress,
    )
    times = chirp.spacing * np.arange(len(states))
    within = centres(len(states), periods)
    omegas = (chirp.begin + chirp.speed * times) * scaled.frequency
    signal = scaled.given(states[:, : scaled.size])
    return Ramp(
        time=times[within] / scaled.frequency,
        omega=omegas[within],
        amplitude=demodulate(signal, chirp.angle(times), harmonic, periods),
        state=scaled.given_states(states[-1]),
        escaped=None if whole else float(omegas[-1]),
    )


@attrs.frozen
class _Chirp:
    """A drive in scaled units: frequency at the beginning, its change per unit of time, how many
    samples and their spacing in time.
    """

    begin: float
    speed: float
    count: int
    spacing: float

    def angle(self, time: Any) -> Any:
        return self.begin * time + self.speed * time**2 / 2


def _chirp(scaled: ScaledSystem, omega: tuple[float, float], rate: float, periods: int) -> _Chirp:
    """The drive of a ramp; raises ContinuationError for what makes no sense or takes too long."""
    start, stop = omega
    if not (finite(start) and finite(stop) and min(start, stop) > 0 and start != stop):
        raise ContinuationError(
            f"omega: found {omega}; allowed two positive frequencies (from, to)"
        )
    if not finite(rate) or rate <= 0:
        raise ContinuationError(f"rate: found {rate!r}; allowed more than 0, in Hz/s")
    if periods < LEAST_PERIODS:
        raise ContinuationError(f"periods: found {periods}; allowed {LEAST_PERIODS} or more")
    begin, end = start / scaled.frequency, stop / scaled.frequency
    speed = float(np.sign(end - begin)) * TURN * rate / scaled.frequency**2
    duration = (end - begin) / speed
    check_periods(
        duration * max(begin, end) / TURN,
        scaled.size,
        "take a faster ramp or a shorter range, or `explore`, which is what slow ones tend to",
    )
    spacing = TURN / max(begin, end) / PER_PERIOD
    return _Chirp(begin, speed, int(duration / spacing) + 1, spacing)


def _start(scaled: ScaledSystem, state: Array | None) -> Array:
    size = 2 * scaled.size
    if state is None:
        return np.full(size, DISTURBANCE)
    given = np.asarray(state, dtype=float)
    if given.shape != (size,) or not np.all(np.isfinite(given)):
        raise ContinuationError(f"state: give (q, dq/dt) as {size} finite numbers")
    return scaled.inner_states(given)
