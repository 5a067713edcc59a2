"""Where orbits of one to five periods of the drive may lie on branches of their own.

Nothing leads to them from rest; to those of one and two periods only from resonances and tongues
that the response does not pass in the range. Near them the motion is a free one, of the undamped
system, that turns n times more slowly than the drive, and the drive makes up for what damping
takes. To first order in both that is so where the work of the drive over a period, a function of
its phase, equals the loss (Melnikov's function has a zero). Along the backbone of a mode this tells
at which amplitudes there are such orbits, with which phases: Newton's method starts there. Source:
Guckenheimer and Holmes 1983, doi:10.1007/978-1-4612-1140-2 (section 4.6, subharmonic Melnikov
functions).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import attrs
import numpy as np

from nanorom.continuation.curves.backbone import conservative, free_orbits, linear_mode
from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix, stretch, turned
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings
from nanorom.types import Array

Response = Callable[[float], Array]  # coefficients (2H + 1, L) at a frequency of the drive

ORDERS = (1, 2, 3, 5)
DOUBLED = 2
TOLERANCE, STEPS = 1e-6, 60  # of a backbone, which is to lead near an orbit
FARTHEST = 10.0  # factor between the linear frequency and one looked at
ENOUGH = 0.8  # work by loss, to first order, from which an orbit is looked for
PHASES = 48  # of the drive, of one of its periods
TRIES = 4  # amplitudes spread over a stretch of a backbone from which orbits are looked for
LARGEST = 1.5  # of the stiffness, that the forced response may add
WITHIN = 1e-3  # of a range
PASSED = 1.05  # linear frequency by the low end of a range: its resonance begins there
HIGHEST = 1e6  # units of amplitude, where a mode alone is linear and its frequency never changes
LITTLE = 1e-14  # loss of a motion, by its energy, that is none


@attrs.frozen(eq=False)
class Stretch:
    """Part of a backbone along which the drive makes up for the loss: the drive's frequency at its
    middle, and orbits from which Newton's method may start, the most promising first.
    """

    order: int
    omega: float
    starts: list[Orbit]


def stretches(
    system: ScaledSystem, omega: tuple[float, float], response: Response, doublings: bool
) -> Iterator[Stretch]:
    """Where in a range of the drive's frequency such orbits may be found beside the response, those
    of two periods only where `doublings` are followed.

    Raises ContinuationError where a backbone cannot be followed.
    """
    if not system.nonlinear or len(system.massless):
        return
    plain = conservative(system)
    dressed = _dressed(plain, response(float(np.sqrt(omega[0] * omega[1]))))
    alone, beside = ((free, _linear_modes(free)) for free in (plain, dressed))
    for order in ORDERS:
        if order == DOUBLED and not doublings:
            continue
        free, modes = alone if order == 1 else beside
        low, high = omega[0] / order, omega[1] / order
        for frequency, shape, bend in modes:
            if not _may_reach(free, frequency, bend, low, high):
                continue
            if order == 1 and low < PASSED * frequency and frequency < high:
                continue  # the response from rest passes it
            # a backbone ends a little within the range, where its last orbit is then
            inner = WITHIN * (high - low)
            down = low + inner if frequency > low + inner else frequency / FARTHEST
            limits = down, max(high - inner, 1.001 * frequency)
            settings = Settings(tolerance=TOLERANCE, steps=STEPS)
            orbits = free_orbits(free, (frequency, shape), limits, settings, HIGHEST)
            yield from _supported(system, orbits, order, omega, response)


def _linear_modes(free: ScaledSystem) -> list[tuple[float, Array, float]]:
    """Frequency and shape (L,) of every mode, and how much of a cubic force there is along it."""
    modes = [linear_mode(free, mode) for mode in range(free.size)]
    shapes = np.stack([shape for _, shape in modes], axis=1)
    squares = (shapes[:, None] * shapes).reshape(free.size**2, -1)
    bends = (squares * (free.cubic.reshape(len(squares), -1) @ squares)).sum(axis=0)
    return [(*mode, float(bend)) for mode, bend in zip(modes, bends)]


def _may_reach(free: ScaledSystem, frequency: float, bend: float, low: float, high: float) -> bool:
    """Whether free motions of a mode may have frequencies between two."""
    softens, hardens = (
        bool(free.quadratic.any()) or bend < 0,
        bool(free.quadratic.any()) or bend > 0,
    )
    lowest = frequency / FARTHEST if softens else frequency
    highest = frequency * FARTHEST if hardens else frequency
    return lowest < high and low < highest


def _supported(
    system: ScaledSystem,
    orbits: list[Orbit],
    order: int,
    omega: tuple[float, float],
    response: Response,
) -> Iterator[Stretch]:
    """The stretches of a backbone inside the range, with work and loss in balance."""
    balances = [_balance(system, orbit, order) for orbit in orbits]
    inside = np.array([omega[0] < order * orbit.rate < omega[1] for orbit in orbits])
    margins = np.array([work.max() / loss if loss > 0 else 0.0 for work, loss in balances])
    good = np.flatnonzero(inside & (margins > ENOUGH))
    for run in np.split(good, np.flatnonzero(np.diff(good) > 1) + 1):
        if not len(run):
            continue
        spread = np.linspace(0, len(run) - 1, TRIES).round().astype(int)
        best = [run[int(margins[run].argmax())], run[len(run) // 2], *run[spread]]
        starts = []
        for place in dict.fromkeys(best):
            work, loss = balances[place]
            forced = response(order * orbits[place].rate)
            for phase in _phases(work, loss):
                starts.append(_started(orbits[place], forced, order, phase))
        yield Stretch(order, order * orbits[run[len(run) // 2]].rate, starts)


def _balance(system: ScaledSystem, orbit: Orbit, order: int) -> tuple[Array, float]:
    """Work of the drive over a period of a free orbit for its phases (PHASES,), and the loss."""
    harmonics = (len(orbit.coefficients) - 1) // 2
    count = 4 * max(harmonics, order * system.tones) + 4
    angles = 2 * np.pi / count * np.arange(count)
    table = fourier_matrix(angles, harmonics)
    q, v = table @ orbit.coefficients, orbit.rate * (table @ differentiate(orbit.coefficients))
    friction = v @ system.damping.T
    if system.has_loss:
        friction += np.einsum("rkjl,nj,nl,nk->nr", system.loss, q, q, v, optimize=True)
    loss = float((v * friction).sum() / count)
    phases = 2 * np.pi / PHASES * np.arange(PHASES)
    drive = fourier_matrix(order * angles + phases[:, None], system.tones)  # (phases, n, 2K + 1)
    direct = v @ system.force  # (n, 2K + 1)
    direct = direct + np.einsum("nr,rlk,nl->nk", v, system.parametric, q, optimize=True)
    if loss < LITTLE * float((v * v).sum() / count):
        loss = 0.0
    return np.asarray(np.einsum("pnk,nk->p", drive, direct) / count), loss


def _phases(work: Array, loss: float) -> list[float]:
    """Phases of the drive at which its work equals the loss, or is nearest to it."""
    if work.max() < loss:
        return [2 * np.pi / PHASES * int(work.argmax())]
    gaps = np.append(work, work[0]) - loss
    changes = np.flatnonzero((gaps[:-1] > 0) != (gaps[1:] > 0))
    parts = gaps[changes] / (gaps[changes] - gaps[changes + 1])
    return [float(2 * np.pi / PHASES * (i + part)) for i, part in zip(changes, parts)]


def _started(orbit: Orbit, forced: Array, order: int, phase: float) -> Orbit:
    """A free orbit, with the drive at a phase where it begins, and the response of other modes."""
    free = turned(orbit.coefficients, -phase / order)
    forced = stretch(forced, order)
    rows = max(len(free), len(forced))
    coefficients = np.zeros((rows, free.shape[1]))
    coefficients[: len(free)] = free
    coefficients[: len(forced)] += forced
    return Orbit(coefficients, orbit.rate, order)


def linear_response(system: ScaledSystem, omega: float) -> Array:
    """The linear response (2K + 1, L) at a frequency of the drive."""
    forced = np.zeros((2 * system.tones + 1, system.size))
    for k in range(1, system.tones + 1):
        inertia = system.stiffness - (k * omega) ** 2 * np.eye(system.size)
        force = system.force[:, 2 * k - 1] - 1j * system.force[:, 2 * k]
        answer = np.linalg.solve(inertia + 1j * k * omega * system.damping, force)
        forced[2 * k - 1], forced[2 * k] = answer.real, -answer.imag
    return forced


def _dressed(free: ScaledSystem, forced: Array) -> ScaledSystem:
    """The free system as the response stiffens it on average, if that is a correction."""
    squares = forced[1:].T @ forced[1:] / 2
    added = 3.0 * np.tensordot(free.cubic, squares, axes=2)
    small = np.linalg.norm(added) < LARGEST * np.linalg.norm(free.stiffness)
    return replace(free, stiffness=free.stiffness + added) if small else free
