"""Fundamental matrices of y'' + c y' + K(t) y = 0 by splitting: free oscillations and kicks.

Every mode turns freely with its damping and its mean stiffness, which is known exactly; what is
left of K, its coupling and its change in time, kicks the velocities between such turns. A kick
costs one product of matrices where a step of a Taylor series (`variation`) costs two hundred of
them. Most of the error of the maps is a change of coordinates, which leaves the multipliers as they
are: steps are as long as these allow. Source: Blanes and Moan 2002,
doi:10.1016/S0377-0427(01)00492-7 (Runge-Kutta-Nystrom splitting of order 6 with 11 stages).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nanorom.continuation.orbits.harmonics import fourier_matrix
from nanorom.continuation.orbits.product import product
from nanorom.types import Array, Numbers

ORDER = 6
_KICKS = (
    0.0414649985182624,
    0.198128671918067,
    -0.0400061921041533,
    0.0752539843015807,
    -0.0115113874206879,
)
_TURNS = (
    0.123229775946271,
    0.290553797799558,
    -0.127049212625417,
    -0.246331761062075,
    0.357208872795928,
)
MANY = 8  # modes from which on it is cheaper than the series: tests/benchmarks/splitting.md
MOST_INTERVALS = 16384
LEAST_INTERVALS = 4
MARGIN = 1.05  # more intervals than the error asks for
TRUSTED = 16  # orbits for which one estimate of the error serves
HARDER = 1.05  # strength, by that of the last estimate, from which another one is made
CLOSE = 20_000  # doubles of a matrix that stay near the processor
UNFELT = 1e-2  # of the truncation: harmonics of the stiffness, by the largest, that change nothing
ROUND_OFF = 1e-18  # of an error that vanishes
TINY = 1e-300  # rate at which a mode would drift rather than turn


def _both(some: tuple[float, ...], middle: tuple[float, ...]) -> tuple[float, ...]:
    return (*some, *middle, *some[::-1])


KICKS = _both(_KICKS, (0.5 - sum(_KICKS),) * 2)
TURNS = _both(_TURNS, (1.0 - 2.0 * sum(_TURNS),))


@lru_cache(maxsize=64)
def _table(wide: int, intervals: int, half: bool, kick: int) -> Array:
    """Fourier functions (M, 2 wide + 1) at the time of one kick in every interval."""
    step = (np.pi if half else 2 * np.pi) / intervals
    return fourier_matrix(step * (np.arange(intervals) + sum(TURNS[:kick])), wide)


class Splitting:
    """Maps of the state (y, y') of a set of modes with modal damping c (L,), as `Variation`."""

    depth = 3  # matrices kept of every interval, as those of a series

    def __init__(self, damping: Array, truncation: float) -> None:
        self.damping, self.truncation = damping, truncation
        self.size = len(damping)
        self._estimated = 0.0  # strength of a step at which the error was last estimated
        self._since = 0  # orbits since then

    @staticmethod
    def serves(damping: Array, inertia: Array, has_loss: bool) -> bool:
        """Whether modes are damped one by one, by a constant, and are so many that it pays."""
        alone = np.array_equal(damping, np.diag(damping.diagonal()))
        return len(damping) >= MANY and bool(inertia.all()) and not has_loss and alone

    def propagate(
        self, stiffness: Array, damping: Array | None, rates: Array, intervals: int, half: bool
    ) -> tuple[Array, int]:
        """Maps (n, M, 2L, 2L) and the number of intervals that would have been just enough.

        stiffness (n, F, L, L): Fourier coefficients; damping: None; rates (n,).
        """
        stiffness = self._without_rest(stiffness)
        intervals += intervals % 2
        phases = (np.pi if half else 2 * np.pi) * np.sqrt(_strength(stiffness)) / rates
        hardest = int(phases.argmax())
        wanted = intervals
        while True:
            strength = float(phases[hardest]) / intervals
            if strength <= HARDER * self._estimated and self._since < TRUSTED:
                break
            some = slice(hardest, hardest + 1)
            error = self._error(stiffness[some], rates[some], intervals, half)
            needed = intervals * (max(error, ROUND_OFF) / self.truncation) ** (1.0 / ORDER)
            wanted = int(np.clip(np.ceil(MARGIN * needed), LEAST_INTERVALS, MOST_INTERVALS))
            wanted += wanted % 2
            if needed <= intervals or intervals >= MOST_INTERVALS:
                self._estimated, self._since = strength, 0
                break
            intervals = wanted
        self._since += len(rates)
        return self._maps(stiffness, rates, intervals, half), wanted

    def _without_rest(self, stiffness: Array) -> Array:
        """The stiffness without its last harmonics, if multipliers do not feel them."""
        sizes = np.abs(stiffness).max(axis=(0, 2, 3))
        felt = np.flatnonzero(sizes > UNFELT * self.truncation * sizes.max())
        return stiffness[:, : 2 * ((felt.max(initial=0) + 1) // 2) + 1]

    def _error(self, stiffness: Array, rates: Array, intervals: int, half: bool) -> float:
        """Of the eigenvalues of a period's map, from those of steps twice as long.

        They are nearer to the exact ones than the map itself, most of whose error is a change of
        coordinates: the kicks would have to be given at slightly other states.
        """
        maps = (self._maps(stiffness, rates, n, half) for n in (intervals, intervals // 2))
        fine, coarse = (np.linalg.eigvals(product(some)[0]) for some in maps)
        gaps = np.abs(fine[:, None] - coarse).min(axis=1) / np.maximum(np.abs(fine), 1.0)
        return float(gaps.max()) / 2.0**ORDER

    def _maps(self, stiffness: Array, rates: Array, intervals: int, half: bool) -> Array:
        """Maps (n, M, 2L, 2L), so many intervals at a time as stay in the processor's memory."""
        n, size, every = len(rates), self.size, np.arange(self.size)
        duration = (np.pi if half else 2 * np.pi) / intervals / rates
        mean = stiffness[:, 0, every, every]
        rest = stiffness.copy()
        rest[:, 0, every, every] = 0.0
        rest = rest.reshape(n, stiffness.shape[1], -1)
        rest *= -duration[:, None, None]
        turns = [self._turn(mean, part * duration) for part in TURNS]
        maps = np.empty((n, intervals, 2 * size, 2 * size))
        count = max(1, CLOSE // (2 * n * size * size))
        for first in range(0, intervals, count):
            some = slice(first, first + count)
            maps[:, some, :size], maps[:, some, size:] = self._some(
                rest, turns, intervals, half, some
            )
        return maps

    def _some(
        self, rest: Array, turns: list[tuple[Array, ...]], intervals: int, half: bool, some: slice
    ) -> tuple[Array, Array]:
        """Values and velocities (n, m, L, 2L) of the maps of some intervals."""
        n, width, size = len(rest), rest.shape[1], self.size
        count = len(range(intervals)[some])
        y, v = np.zeros((2, n, count, size, 2 * size))
        y[..., :size], v[..., size:] = np.eye(size), np.eye(size)
        other, product = np.empty((2, *y.shape))
        for kick, weight in enumerate(KICKS):
            table = weight * _table((width - 1) // 2, intervals, half, kick)[some]
            local = np.matmul(table, rest).reshape(n, count, size, size)
            v += np.matmul(local, y, out=product)
            if kick == len(TURNS):
                break
            a, b, c, d = turns[kick]
            np.multiply(b, v, out=other)
            np.multiply(c, y, out=product)
            y *= a
            y += other
            v *= d
            v += product
        return y, v

    def _turn(self, mean: Array, times: Array) -> tuple[Array, ...]:
        """The map of (y, y') of every mode over times (n,): four factors (n, 1, L, 1)."""
        half, t = self.damping / 2, times[:, None]
        turn: Numbers = np.emath.sqrt(mean - half**2 + 0j) + TINY
        decay = np.exp(-half * t)
        cosine, sine = np.cos(turn * t).real, (np.sin(turn * t) / turn).real
        entries = (cosine + half * sine, sine, -mean * sine, cosine - half * sine)
        return tuple((decay * entry)[:, None, :, None] for entry in entries)


def _strength(stiffness: Array) -> Array:
    """A measure (n,) of the largest stiffness along orbits: the largest sum over a row."""
    return np.asarray(np.abs(stiffness).sum(axis=(1, 3)).max(axis=1))
