"""A periodic orbit in the user's units: time series, spectrum, moving shape."""

from __future__ import annotations

import attrs
import numpy as np

from .harmonics import differentiate, fourier_matrix
from .system import Array


@attrs.frozen(eq=False)
class PeriodicOrbit:
    """q(t) = sum_k a_k cos(k theta) + b_k sin(k theta), theta = omega t / period_multiple.

    coefficients (2H + 1, L) in the order 1, cos, sin, cos 2, ...; omega: drive frequency in rad per
    unit of time; the drive is cos(omega t).
    """

    coefficients: Array = attrs.field(repr=False)
    omega: float
    period_multiple: int = 1

    @property
    def period(self) -> float:
        return 2 * np.pi * self.period_multiple / self.omega

    @property
    def harmonics(self) -> int:
        return (len(self.coefficients) - 1) // 2

    def __call__(self, time: Array | float) -> Array:
        """Modal coordinates q (..., L) at the times (...)."""
        return np.asarray(self._table(time) @ self.coefficients)

    def velocity(self, time: Array | float) -> Array:
        """dq/dt (..., L) at the times (...)."""
        rate = self.omega / self.period_multiple
        return np.asarray(rate * (self._table(time) @ differentiate(self.coefficients)))

    def time_series(self, points: int = 256, periods: int = 1) -> tuple[Array, Array, Array]:
        """Times (n,), q (n, L) and dq/dt (n, L) over whole periods of the response."""
        times = self.period * np.arange(points * periods + 1) / points
        return times, self(times), self.velocity(times)

    def spectrum(self) -> tuple[Array, Array]:
        """Angular frequencies (H + 1,) and complex amplitudes (H + 1, L).

        q(t) = Re sum_k amplitude_k exp(i frequency_k t).
        """
        amplitudes = np.zeros((self.harmonics + 1, self.coefficients.shape[1]), dtype=complex)
        amplitudes[0] = self.coefficients[0]
        amplitudes[1:] = self.coefficients[1::2] - 1j * self.coefficients[2::2]
        rate = self.omega / self.period_multiple
        return rate * np.arange(self.harmonics + 1), amplitudes

    def shape(self, modes: Array, time: Array | float) -> Array:
        """Displacement sum_r q_r(t) phi_r (..., P) from mode shapes (L, P)."""
        return np.asarray(self(time) @ np.asarray(modes))

    def _table(self, time: Array | float) -> Array:
        return fourier_matrix(self.omega / self.period_multiple * np.asarray(time), self.harmonics)
