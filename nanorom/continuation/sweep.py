"""Frequency sweeps by time integration: what an instrument would record, jumps included.

The drive frequency is held while the transient dies out, then changed a little with the phase of
the drive continuous; the largest |q_r| of the last periods is recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np
from scipy.integrate import odeint

from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

SAMPLES = 64  # of a period, to read amplitudes
DISTURBANCE = 1e-6  # of the unit of amplitude, for parametric resonance to amplify
SMALL = 1e-4  # of that unit, below which errors are absolute
MOST_STEPS = 100_000  # of the integrator between two outputs
CHUNK = 5  # pairs of periods integrated before it is asked whether the motion has settled
ESCAPED = 1e6  # units of amplitude: no film comes back from there
REST = 1e-12  # size below which a motion has settled


@attrs.frozen(eq=False)
class Sweep:
    """omega (n,), amplitude (n, L) = max |q_r| over two periods, state (n, 2L) at drive phase
    0, in the system's units; settled (n,): whether the stroboscopic state had come to rest (not on
    a torus or in chaos); escaped: frequency at which the motion left all bounds, where the sweep
    ends with what was recorded before, or None.
    """

    omega: Array
    amplitude: Array
    state: Array
    settled: Array
    escaped: float | None = None


@one_thread()
def sweep(
    system: ModalSystem,
    omega: Sequence[float] | Array,
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    state: Array | None = None,
    periods: int = 300,
    settle: float = 1e-3,
    tolerance: float = 1e-6,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Integrate the equations of motion while the drive frequency passes through `omega` in order.

    Parameters
    ----------
    system : ModalSystem
    omega : (n,), drive frequencies in the order of the sweep: rising for a forward sweep
    direct, parametric : drive levels
    state : (2L,), initial (q, dq/dt); a small disturbance of rest if left out
    periods : most drive periods waited at one frequency
    settle : relative change of the state over two drive periods that counts as settled
    tolerance : relative error of the time integration

    Raises
    ------
    ContinuationError
        for invalid frequencies or a state of the wrong shape.
    """
    frequencies = np.asarray(omega, dtype=float)
    if frequencies.ndim != 1 or not len(frequencies) or not np.all(frequencies > 0):
        raise ContinuationError("omega: give the frequencies of the sweep as positive numbers")
    scaled = system.scaled(direct, parametric)
    size = scaled.size
    if state is not None and (np.shape(state) != (2 * size,) or not np.all(np.isfinite(state))):
        raise ContinuationError(f"state: give (q, dq/dt) as {2 * size} finite numbers")
    # parametric resonance needs something to amplify
    here = np.full(2 * size, DISTURBANCE)
    if state is not None:
        here = scaled.inner_states(np.asarray(state, dtype=float))
    results = []
    escaped: float | None = None
    for number, frequency in enumerate(frequencies / scaled.frequency):
        try:
            here, amplitude, settled = _settle(scaled, frequency, here, periods, settle, tolerance)
        except _Escaped:
            escaped = float(frequencies[number])
            break
        results.append((np.abs(scaled.given(amplitude)), scaled.given_states(here), settled))
        if progress is not None:
            progress(number + 1, len(frequencies))
    done = len(results)
    return Sweep(
        frequencies[:done],
        np.array([amplitude for amplitude, _, _ in results]).reshape(done, size),
        np.array([state for _, state, _ in results]).reshape(done, 2 * size),
        np.array([rest for _, _, rest in results], dtype=bool),
        escaped,
    )


class _Escaped(Exception):
    """The motion leaves all bounds, in a potential that does not hold it."""


def _settle(
    system: ScaledSystem,
    omega: float,
    state: Array,
    periods: int,
    settle: float,
    tolerance: float,
) -> tuple[Array, Array, bool]:
    """State after the transient, amplitudes (L,) of the last two periods, whether it came to
    rest.
    """
    equation = equations(system, omega)

    def right_side(time: float, y: Array) -> Array:
        if not np.abs(y).max() < ESCAPED:
            raise _Escaped
        return equation(time, y)

    span = 4 * np.pi / omega  # two periods: period-doubled motion is at rest, too
    options = {"rtol": tolerance, "atol": SMALL * tolerance, "tfirst": True, "mxstep": MOST_STEPS}
    chunk = span * np.arange(CHUNK + 1)
    done, settled = 0, False
    while not settled and done < periods:
        states = odeint(right_side, state, chunk, **options)
        if not np.all(np.isfinite(states)):
            raise _Escaped
        changes = np.abs(np.diff(states, axis=0)).max(axis=1)
        settled = bool(changes[-1] < settle * max(np.abs(states[-1]).max(), REST))
        state, done = states[-1], done + 2 * (len(chunk) - 1)
    instants = np.linspace(0.0, span, 2 * SAMPLES + 1)
    motion = odeint(right_side, state, instants, **options)
    return motion[-1], largest(motion[:, :, None], np.diff(instants[:2]))[:, 0], settled


def largest(samples: Array, step: Array) -> Array:
    """Largest |q| (L, b) of samples (n, 2L, b) of states, `step` (b,) apart in time: where a
    velocity changes its sign, that of the cubic between the two.
    """
    size = samples.shape[1] // 2
    q, v = samples[:, :size], samples[:, size:] * step
    best = np.abs(q).max(axis=0)
    # with s from 0 to 1: q0 + v0 s + b s^2 + a s^3
    rise = q[1:] - q[:-1]
    b, a = 3 * rise - 2 * v[:-1] - v[1:], v[:-1] + v[1:] - 2 * rise
    turns = v[:-1] * v[1:] < 0
    root = np.sqrt(np.fmax(b * b - 3 * a * v[:-1], 0.0))
    below = -(b + np.where(b >= 0, root, -root))
    with np.errstate(divide="ignore", invalid="ignore"):
        for s in (below / (3 * a), v[:-1] / below):
            there = q[:-1] + s * (v[:-1] + s * (b + s * a))
            here = turns & (s >= 0) & (s <= 1)
            best = np.fmax(best, np.where(here, np.abs(there), 0.0).max(axis=0))
    return best


def equations(
    system: ScaledSystem, omega: float, phase: Callable[[float], float] | None = None
) -> Callable[[float, Array], Array]:
    """d(q, q')/dt of the scaled equations of motion; phase: the drive's angle in time, omega times
    it if left out. Of states of first order, q' is not used.
    """
    size, tones = system.size, np.arange(1, system.tones + 1)
    cubic = system.cubic.reshape(size * size, size * size)
    quadratic, loss = system.quadratic, system.loss.reshape(size * size, size * size)
    has_quadratic, has_loss = bool(quadratic.any()), bool(loss.any())
    massless, damping = system.massless, system.inertia[:, None] * system.damping
    terms = np.ones(2 * len(tones) + 1)

    def right_side(time: float, y: Array) -> Array:
        q, v = y[:size], y[size:]
        pairs = np.multiply.outer(q, q).ravel()
        angles = tones * (omega * time if phase is None else phase(time))
        terms[1::2], terms[2::2] = np.cos(angles), np.sin(angles)
        matrix = (cubic @ pairs).reshape(size, size) + system.stiffness
        matrix -= system.parametric @ terms
        if has_quadratic:
            matrix += quadratic @ q
        force = matrix @ q + damping @ v - system.force @ terms
        if has_loss:
            force += (loss @ pairs).reshape(size, size) @ v
        rates = np.concatenate([v, -force])
        rates[massless], rates[size + massless] = -force[massless], 0.0
        return rates

    return right_side
