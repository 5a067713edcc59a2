"""Fundamental matrices of the variational equation y'' + C(t) y' + K(t) y = 0 by Taylor series.

K and C are trigonometric polynomials, so on each of M intervals of the period they have known
Taylor coefficients and the fundamental matrix follows by recursion to order 20; all intervals (and
many orbits) advance together. The last terms of the series tell the error and choose M.
"""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np

from nanorom.types import Array

TAYLOR_ORDER = 20
MOST_INTERVALS = 4096
ROUND_OFF = 1e-18  # of last terms that vanish


@lru_cache(maxsize=64)
def _taylor_table(wide: int, intervals: int, half: bool) -> Array:
    """Taylor coefficients, in the fraction of an interval, of the Fourier functions: (M * P, 2 wide
    + 1).
    """
    order = np.arange(TAYLOR_ORDER - 1)
    step = (np.pi if half else 2 * np.pi) / intervals
    start = step * np.arange(intervals)
    k = np.arange(1, wide + 1)
    factor = (k * step) ** order[:, None] / np.array([float(factorial(int(j))) for j in order])[
        :, None
    ]
    phase = start[:, None, None] * k + order[:, None] * (np.pi / 2)
    table = np.zeros((intervals, len(order), 2 * wide + 1))
    table[:, 0, 0] = 1.0
    table[:, :, 1::2] = factor * np.cos(phase)
    table[:, :, 2::2] = factor * np.sin(phase)
    return table.reshape(intervals * len(order), -1)


class Variation:
    """Maps of the state (y, y') of a set of modes with linear damping C, interval by interval.

    Of coordinates without inertia, whose damping is 1, y alone matters: y' is theirs at the end.
    """

    depth = TAYLOR_ORDER  # matrices kept of every interval

    def __init__(self, damping: Array, inertia: Array, truncation: float) -> None:
        self.damping, self.truncation = damping, truncation
        self.inertia, self.massless = inertia[:, None], np.flatnonzero(inertia == 0)
        self.size = len(damping)
        self._buffers: dict[str, Array] = {}

    def propagate(
        self, stiffness: Array, damping: Array | None, rates: Array, intervals: int, half: bool
    ) -> tuple[Array, int]:
        """Maps (n, M, 2L, 2L) and the number of intervals that would have been just enough."""
        while True:
            maps, error = self._interval_maps(stiffness, damping, rates, intervals, half)
            # the last terms fall with the order of the series
            needed = intervals * (max(error, ROUND_OFF) / self.truncation) ** (1.0 / TAYLOR_ORDER)
            wanted = int(np.clip(np.ceil(1.05 * needed), 3, MOST_INTERVALS))
            if needed <= intervals or intervals == MOST_INTERVALS:
                return maps, wanted
            intervals = wanted

    def _interval_maps(
        self, stiffness: Array, damping: Array | None, rates: Array, intervals: int, half: bool
    ) -> tuple[Array, float]:
        """Maps of the state (q, q') over each interval, (n, M, 2L, 2L), and the relative size of
        the last terms.
        """
        size, order = self.size, TAYLOR_ORDER
        n = len(rates)
        table = _taylor_table((stiffness.shape[1] - 1) // 2, intervals, half)
        durations = (np.pi if half else 2 * np.pi) / intervals / rates
        local = self._local(stiffness * (durations**2)[:, None, None, None], table, intervals)
        if damping is not None:
            friction = self._local(
                damping * durations[:, None, None, None], table, intervals, "friction"
            )
        linear = -self.damping * durations[:, None, None, None]
        # y[:, :, order - j] holds the Taylor coefficient j of the fundamental matrix (value, slope
        # = identity)
        y = self._buffer("y", (n, intervals, order + 1, size, 2 * size))
        force = self._buffer("force", (n, intervals, size, 2 * size))
        y[:, :, order] = np.eye(size, 2 * size)
        y[:, :, order - 1] = np.eye(size, 2 * size, size)
        y[:, :, :order, self.massless] = 0.0
        flat = y.reshape(n, intervals, (order + 1) * size, 2 * size)
        for j in range(order - 1):
            matrix = local[:, :, :, : j + 1].reshape(n, intervals, size, (j + 1) * size)
            np.matmul(matrix, flat[:, :, (order - j) * size :], out=force)
            if damping is None:
                force -= (j + 1.0) * np.matmul(linear, y[:, :, order - j - 1])
            else:
                weights = np.arange(j + 1, 0, -1.0).repeat(size)[:, None]
                past = flat[:, :, (order - j - 1) * size : order * size] * weights
                force += np.matmul(friction[:, :, :, : j + 1].reshape(n, intervals, size, -1), past)
            if len(self.massless):
                rate = force[:, :, self.massless] / durations[:, None, None, None]
                y[:, :, order - j - 1, self.massless] = -rate / (j + 1.0)
                force *= self.inertia
            np.multiply(force, -1.0 / ((j + 2.0) * (j + 1.0)), out=y[:, :, order - j - 2])
        maps = self._buffer("maps", (n, intervals, 2 * size, 2 * size))
        np.sum(y, axis=2, out=maps[:, :, :size])
        slopes = np.arange(order, -1, -1.0)
        np.einsum("j,nmjab->nmab", slopes, y, out=maps[:, :, size:])
        error = float(np.abs(y[:, :, :2]).max())
        scale = durations[:, None, None, None]
        maps[:, :, size:] /= scale
        maps[:, :, :, size:] *= scale
        return maps, error

    def _local(self, harmonics: Array, table: Array, intervals: int, name: str = "local") -> Array:
        """Taylor coefficients of a matrix function on every interval: view (n, M, L, P, L)."""
        size = self.size
        n = len(harmonics)
        by_row = np.ascontiguousarray(harmonics.transpose(0, 2, 1, 3))
        local = self._buffer(name, (n, size, len(table), size))
        np.matmul(table, by_row, out=local)
        return local.reshape(n, size, intervals, -1, size).transpose(0, 2, 1, 3, 4)

    def _buffer(self, name: str, shape: tuple[int, ...]) -> Array:
        """Work space that is reused: large temporaries are faulted in anew at every operation."""
        count = int(np.prod(shape))
        if name not in self._buffers or self._buffers[name].size < count:
            self._buffers[name] = np.empty(count)
        return self._buffers[name][:count].reshape(shape)
