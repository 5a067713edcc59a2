"""Floquet multipliers of periodic orbits by Taylor series of the variational equation in time.

The tangent stiffness of a Fourier orbit is a trigonometric polynomial, so on each of M intervals of
the period the variational equation y'' + C(t) y' + K(t) y = 0 has known Taylor coefficients and its
fundamental matrix follows by recursion to order 20; all intervals (and many orbits) advance
together, and a product tree gives the monodromy matrix. The last terms of the series tell the error
and choose M.
"""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np

from nanorom.continuation.orbits.balance import by_pair
from nanorom.continuation.orbits.harmonics import (
    Support,
    differentiate,
    fourier_matrix,
    symmetry_signs,
)
from nanorom.continuation.orbits.product import LARGE, product_eigenvalues
from nanorom.continuation.system import ScaledSystem
from nanorom.types import Array

TAYLOR_ORDER = 20
BATCH_DOUBLES = 400_000
MOST_INTERVALS = 4096


@lru_cache(maxsize=32)
def _sampling(harmonics: int, period_multiple: int) -> tuple[Array, Array, Array]:
    """Synthesis (N, 2H + 1), analysis (4H + 1, N) and drive (N,) for the tangent stiffness of an
    orbit.
    """
    wide = max(2 * harmonics, period_multiple)
    count = 4 * max(harmonics, period_multiple) + 2
    angles = 2 * np.pi / count * np.arange(count)
    everything = fourier_matrix(angles, wide)
    weights = np.full(2 * wide + 1, 2.0 / count)
    weights[0] = 1.0 / count
    synthesis = np.ascontiguousarray(everything[:, : 2 * harmonics + 1])
    return (
        synthesis,
        np.ascontiguousarray((everything * weights).T),
        np.cos(period_multiple * angles),
    )


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


class FloquetSolver:
    """Monodromy matrices and multipliers of orbits of one system, all modes."""

    def __init__(self, system: ScaledSystem, truncation: float = 1e-13) -> None:
        self.system, self.truncation = system, truncation
        size = system.size
        self.size = size
        self.cubic = 3.0 * by_pair(system.cubic.transpose(2, 3, 0, 1))
        self.quadratic = 2.0 * system.quadratic.transpose(1, 0, 2).reshape(size, size * size)
        self.loss = by_pair(system.loss.transpose(2, 3, 0, 1))
        self.has_loss = bool(self.loss.any())
        values = np.linalg.eigvals(system.stiffness)
        self.fastest = float(np.sqrt(np.abs(values).max()))
        self._buffers: dict[str, Array] = {}
        self._signs: dict[tuple[bytes, tuple[int, ...]], Array | None] = {}
        self._density: dict[tuple[int, bool], float] = {}  # intervals times rate, learnt on the way

    def stiffness_harmonics(
        self, orbits: Array, rates: Array, period_multiple: int
    ) -> tuple[Array, Array | None]:
        """Fourier coefficients (n, F, L, L) of the tangent stiffness and of the tangent damping."""
        system, size = self.system, self.size
        n, rows, _ = orbits.shape
        harmonics = (rows - 1) // 2
        synthesis, analysis, drive = _sampling(harmonics, period_multiple)
        v = synthesis @ orbits
        first, second = np.triu_indices(size)
        pairs = v[:, :, first] * v[:, :, second]
        stiffness = pairs @ self.cubic
        if self.quadratic.any():
            stiffness += v @ self.quadratic
        stiffness += system.stiffness.ravel()
        if system.parametric.any():
            stiffness -= drive[:, None] * system.parametric.ravel()
        damping = None
        if self.has_loss:
            z = rates[:, None, None] * (
                synthesis @ np.stack([differentiate(orbit) for orbit in orbits])
            )
            mixed = np.einsum("rkjl,nsl,nsk->nsrj", system.loss, v, z, optimize=True)
            stiffness += 2.0 * mixed.reshape(n, len(drive), -1)
            damping = pairs @ self.loss + system.damping.ravel()
            damping = (analysis @ damping).reshape(n, -1, size, size)
        return (analysis @ stiffness).reshape(n, -1, size, size), damping

    def monodromy(
        self, orbits: Array, rates: Array, period_multiple: int, support: Support
    ) -> tuple[Array, Array]:
        """Fundamental matrices over one period, or over half of it (with the symmetry applied) if
        symmetric, and their eigenvalues.

        orbits (n, 2H + 1, L), rates (n,) = omega / period_multiple; result (n, 2L, 2L) for the
        state (q, q') and (n, 2L).
        """
        size = self.size
        stiffness, damping = self.stiffness_harmonics(orbits, rates, period_multiple)
        signs = self.signs(support)
        half = signs is not None
        key = (period_multiple, half)
        start = (np.pi if half else 2 * np.pi) * self.fastest / 2.5
        density = self._density.get(key, start)
        intervals = max(3, int(np.ceil(density / float(rates.min()))))
        per_orbit = intervals * TAYLOR_ORDER * 3 * size * size
        batch = max(1, BATCH_DOUBLES // per_orbit)
        result = np.empty((len(orbits), 2 * size, 2 * size))
        eigenvalues = np.empty((len(orbits), 2 * size), dtype=complex)
        for first in range(0, len(orbits), batch):
            part = slice(first, first + batch)
            loss = None if damping is None else damping[part]
            maps, intervals = self._propagate(stiffness[part], loss, rates[part], intervals, half)
            if signs is not None:
                maps[:, -1] *= np.tile(signs, 2)[:, None]
            result[part] = _product(maps)
            eigenvalues[part] = np.linalg.eigvals(result[part])
            for i in np.flatnonzero(np.abs(result[part]).max(axis=(1, 2)) > LARGE):
                eigenvalues[first + i] = product_eigenvalues(maps[i])
        self._density[key] = intervals * float(rates.min())
        return result, eigenvalues

    def signs(self, support: Support) -> Array | None:
        """The signs of the half-period symmetry of orbits in a support, if they have it."""
        key = (support.table.tobytes(), support.table.shape)
        if key not in self._signs:
            self._signs[key] = symmetry_signs(self.system, support, support.modulus // 2)
        return self._signs[key]

    def _propagate(
        self, stiffness: Array, damping: Array | None, rates: Array, intervals: int, half: bool
    ) -> tuple[Array, int]:
        """Maps (n, M, 2L, 2L) and the number of intervals that would have been just enough."""
        while True:
            maps, error = self._interval_maps(stiffness, damping, rates, intervals, half)
            # the last terms fall with the order of the series
            needed = intervals * (max(error, 1e-18) / self.truncation) ** (1.0 / TAYLOR_ORDER)
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
        linear = -self.system.damping * durations[:, None, None, None]
        # y[:, :, order - j] holds the Taylor coefficient j of the fundamental matrix (value, slope
        # = identity)
        y = self._buffer("y", (n, intervals, order + 1, size, 2 * size))
        force = self._buffer("force", (n, intervals, size, 2 * size))
        y[:, :, order] = np.eye(size, 2 * size)
        y[:, :, order - 1] = np.eye(size, 2 * size, size)
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

    def multipliers(
        self, orbits: Array, rates: Array, period_multiple: int, support: Support
    ) -> Array:
        """All multipliers (n, 2L) over the whole period, largest modulus first."""
        _, values = self.monodromy(orbits, rates, period_multiple, support)
        return sort_multipliers(values if self.signs(support) is None else values**2)


def sort_multipliers(values: Array) -> Array:
    """Largest modulus first, conjugates with the positive imaginary part first."""
    keys = np.lexsort((-values.imag, -np.round(np.abs(values), 10)), axis=-1)
    return np.take_along_axis(values, keys, axis=-1)


def _product(maps: Array) -> Array:
    """The ordered product of maps (n, M, d, d), later intervals to the left."""
    while maps.shape[1] > 1:
        even = maps.shape[1] // 2 * 2
        pairs = np.matmul(maps[:, 1:even:2], maps[:, 0:even:2])
        maps = pairs if even == maps.shape[1] else np.concatenate([pairs, maps[:, even:]], axis=1)
    return np.asarray(maps[:, 0])
