"""A periodic orbit in the user's units: time series, spectrum, moving shape."""

from __future__ import annotations

from dataclasses import dataclass

import attrs
import numpy as np

from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix, turned
from nanorom.types import Array


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
        """Of the motion, in units of time."""
        return 2 * np.pi * self.period_multiple / self.omega

    @property
    def harmonics(self) -> int:
        """Number H of harmonics."""
        return (len(self.coefficients) - 1) // 2

    def without_tail(self, share: float) -> PeriodicOrbit:
        """The same without the last harmonics, whose coefficients are below a share of the largest.

        Harmonics to three times the drive's stay, which a cubic force makes.
        """
        size = np.abs(self.coefficients).max(axis=1)
        large = np.flatnonzero(size > share * size.max())
        last = max(3 * self.period_multiple, int(large.max(initial=0) + 1) // 2)
        coefficients = self.coefficients[: 2 * last + 1]
        return PeriodicOrbit(coefficients, self.omega, self.period_multiple)

    def with_harmonics(self, least: int) -> PeriodicOrbit:
        """The same with as many harmonics at least, those that it has not being zero."""
        missing = max(0, 2 * (least - self.harmonics))
        coefficients = np.pad(self.coefficients, [(0, missing), (0, 0)])
        return PeriodicOrbit(coefficients, self.omega, self.period_multiple)

    def __call__(self, time: Array | float) -> Array:
        """Modal coordinates q (..., L) at the times (...), in the system's units."""
        return np.asarray(self._table(time) @ self.coefficients)

    def velocity(self, time: Array | float) -> Array:
        """dq/dt (..., L) at the times (...), in the system's units."""
        rate = self.omega / self.period_multiple
        return np.asarray(rate * (self._table(time) @ differentiate(self.coefficients)))

    def time_series(self, points: int = 256, periods: int = 1) -> tuple[Array, Array, Array]:
        """Times (n,), q (n, L), dq/dt (n, L) over whole periods, in the system's units."""
        times = self.period * np.arange(points * periods + 1) / points
        return times, self(times), self.velocity(times)

    def spectrum(self) -> tuple[Array, Array]:
        """Angular frequencies (H + 1,), in rad per unit of time, and complex amplitudes (H + 1, L).

        q(t) = Re sum_k amplitude_k exp(i frequency_k t).
        """
        amplitudes = np.zeros((self.harmonics + 1, self.coefficients.shape[1]), dtype=complex)
        amplitudes[0] = self.coefficients[0]
        amplitudes[1:] = self.coefficients[1::2] - 1j * self.coefficients[2::2]
        rate = self.omega / self.period_multiple
        return rate * np.arange(self.harmonics + 1), amplitudes

    def shape(self, modes: Array, time: Array | float) -> Array:
        """Displacement sum_r q_r(t) phi_r (..., P), in units of q, from mode shapes (L, P)."""
        return np.asarray(self(time) @ np.asarray(modes))

    def _table(self, time: Array | float) -> Array:
        return fourier_matrix(self.omega / self.period_multiple * np.asarray(time), self.harmonics)


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic orbit: Fourier coefficients (2H + 1, L) in theta = omega t / period_multiple,
    scaled units.
    """

    coefficients: Array
    rate: float
    period_multiple: int

    @property
    def omega(self) -> float:
        return self.rate * self.period_multiple


SAME_ORBIT = 1e-6  # of an orbit
REST = 1e-9  # size below which an orbit is at rest
SHORTER = 1e-6  # of an orbit: parts below do not make its period longer


def same_orbit(first: Orbit, second: Orbit, tolerance: float = SAME_ORBIT) -> bool:
    """Whether two orbits of one frequency are the same up to a shift by periods of the drive."""
    rows = min(len(first.coefficients), len(second.coefficients))
    one, two = first.coefficients[:rows], second.coefficients[:rows]
    scale = max(float(np.abs(two).max(initial=0.0)), REST)
    for shift in range(first.period_multiple):
        moved = turned(one, 2 * np.pi * shift / first.period_multiple)
        if np.abs(moved - two).max(initial=0.0) < tolerance * scale:
            return True
    return False


def is_shorter(orbit: Orbit) -> bool:
    """Whether an orbit of period_multiple > 1 has the period of the drive after all."""
    numbers = (np.arange(len(orbit.coefficients)) + 1) // 2
    part = np.abs(orbit.coefficients[numbers % orbit.period_multiple != 0]).max(initial=0.0)
    scale = max(np.abs(orbit.coefficients).max(initial=0.0), REST)
    return orbit.period_multiple > 1 and bool(part <= SHORTER * scale)


def orbit_state(orbit: Orbit) -> Array:
    """(q, q') at forcing phase 0, (2L,)."""
    values = fourier_matrix(np.array(0.0), (len(orbit.coefficients) - 1) // 2)
    return np.concatenate(
        [values @ orbit.coefficients, orbit.rate * (values @ differentiate(orbit.coefficients))]
    )


def orbit_amplitudes(coefficients: Array) -> Array:
    """max |q_r| over a period of each orbit; coefficients (n, 2H + 1, L), result (n, L)."""
    harmonics = (coefficients.shape[1] - 1) // 2
    count = 8 * harmonics + 8
    angles = 2 * np.pi / count * np.arange(count)
    values = np.abs(fourier_matrix(angles, harmonics) @ coefficients)
    best = values.max(axis=1)
    where = angles[values.argmax(axis=1)]
    slope = np.stack([differentiate(c) for c in coefficients])
    bend = np.stack([differentiate(c) for c in slope])
    for _ in range(3):
        table = fourier_matrix(where, harmonics)
        first = np.einsum("nlf,nfl->nl", table, slope)
        second = np.einsum("nlf,nfl->nl", table, bend)
        move = np.divide(-first, second, out=np.zeros_like(first), where=second != 0)
        where = where + np.clip(move, -2 * np.pi / count, 2 * np.pi / count)
    refined = np.abs(np.einsum("nlf,nfl->nl", fourier_matrix(where, harmonics), coefficients))
    return np.maximum(best, refined)
