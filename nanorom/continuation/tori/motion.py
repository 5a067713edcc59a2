"""Quasi-periodic motion as a Fourier series in two angles: values, largest excursions, lines."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.tori.invariance import Curve
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.types import Array, Numbers

FIRST_SAMPLES, MOST_SAMPLES = 32, 1024  # of a period of the drive
TAIL = 1e-11  # of the first angle's last harmonics, relative to the largest coefficient
OVERSAMPLING = 4  # of the grid on which the largest excursion is looked for
CANDIDATES = 3  # places of the grid from which it is made precise
NEWTON_STEPS = 4


@brief
@attrs.frozen(eq=False)
class QuasiPeriodic:
    """q(t) = Re sum_mk c_mk exp(i (m theta_1 + k theta_2)), theta_1 = omega t / period_multiple,
    theta_2 = second t.

    coefficients (2M + 1, H + 1, L), complex: m = -M ... M, k = 0 ... H, zero for m < 0 at k = 0,
    so that every line is there once; omega, second: rad per unit of time; the drive is cos(omega
    t).
    """

    coefficients: Numbers = attrs.field(repr=False)
    omega: float
    second: float
    period_multiple: int = 1

    @property
    def orders(self) -> tuple[Numbers, Numbers]:
        """m (2M + 1,) and k (H + 1,) of the coefficients."""
        most = (self.coefficients.shape[0] - 1) // 2
        return np.arange(-most, most + 1), np.arange(self.coefficients.shape[1])

    @property
    def rates(self) -> Array:
        """Angular frequency (2M + 1, H + 1) of the coefficients, rad per unit of time, any sign."""
        first, second = self.orders
        return np.add.outer(self.omega / self.period_multiple * first, self.second * second)

    def __call__(self, time: Array | float) -> Array:
        """Modal coordinates q (..., L) at the times (...), in the system's units."""
        return self._sum(np.asarray(time), self.coefficients)

    def velocity(self, time: Array | float) -> Array:
        """dq/dt (..., L) at the times (...), in the system's units."""
        return self._sum(np.asarray(time), 1j * self.rates[:, :, None] * self.coefficients)

    def _sum(self, time: Array, coefficients: Numbers) -> Array:
        first, second = self.orders
        one = np.exp(1j * self.omega / self.period_multiple * np.multiply.outer(time, first))
        two = np.exp(1j * self.second * np.multiply.outer(time, second))
        return np.einsum("...m,...k,mkr->...r", one, two, coefficients, optimize=True).real

    def spectrum(self, least: float = 1e-9) -> tuple[Array, Numbers, Numbers]:
        """Angular frequencies (n,) >= 0 in rising order, complex amplitudes (n, L) and orders
        (n, 2) = (m, k) of the lines: q(t) = Re sum_n amplitude_n exp(i frequency_n t).

        `least`: lines below this part of the largest are left out.
        """
        rates, amplitudes = self.rates.ravel(), self.coefficients.reshape(-1, self._modes)
        first, second = self.orders
        orders = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
        behind = rates < 0
        rates, orders = np.abs(rates), np.where(behind[:, None], -orders, orders)
        amplitudes = np.where(behind[:, None], amplitudes.conj(), amplitudes)
        sizes = np.abs(amplitudes).max(axis=1)
        kept = np.flatnonzero(sizes >= least * sizes.max())
        kept = kept[np.argsort(rates[kept])]
        return rates[kept], amplitudes[kept], orders[kept]

    def line(self, first: int, second: int) -> Numbers:
        """Complex amplitude (L,), in the unit of q, of the line at first omega / period_multiple +
        second times the second frequency: q has the part Re(amplitude exp(i frequency t)).
        """
        if second < 0 or (second == 0 and first < 0):
            return self.line(-first, -second).conj()
        most, last = self.orders[0][-1], self.orders[1][-1]
        if abs(first) > most or second > last:
            return np.zeros(self._modes, dtype=complex)
        return np.asarray(self.coefficients[first + most, second])

    @property
    def _modes(self) -> int:
        return int(self.coefficients.shape[2])

    def amplitude(self) -> Array:
        """max |q_r| (L,) over both angles, in the system's units.

        It is what the motion comes close to sooner or later.
        """
        return np.array([self._largest(mode) for mode in range(self._modes)])

    def _largest(self, mode: int) -> float:
        c = self.coefficients[:, :, mode]
        most, last = (c.shape[0] - 1) // 2, c.shape[1] - 1
        rows, columns = OVERSAMPLING * (2 * most + 1), OVERSAMPLING * (2 * last + 1)
        # Re of half a spectrum: the values on a grid by fast transforms
        padded = np.zeros((rows, columns), dtype=complex)
        padded[np.ix_(np.arange(-most, most + 1) % rows, np.arange(last + 1))] = c
        values = np.abs((np.fft.ifft2(padded) * rows * columns).real)
        best = np.argsort(values.ravel())[-CANDIDATES:]
        place = np.stack(np.unravel_index(best, values.shape), axis=1)
        angles = 2 * np.pi * place / np.array([rows, columns])
        return max(float(values.max()), float(self._refined(c, angles).max()))

    def _refined(self, c: Numbers, angles: Array) -> Array:
        """|q| at the stationary places next to the angles (n, 2), by Newton's method."""
        orders = self.orders
        limit = np.pi / np.array([c.shape[0], 2 * c.shape[1]])
        for _ in range(NEWTON_STEPS):
            slope = np.stack([_partial(c, orders, angles, *n) for n in ((1, 0), (0, 1))], axis=1)
            bend = [_partial(c, orders, angles, *n) for n in ((2, 0), (1, 1), (1, 1), (0, 2))]
            inverse = np.linalg.pinv(np.stack(bend, axis=1).reshape(-1, 2, 2))
            step = np.einsum("nij,nj->ni", inverse, slope)
            angles = angles - np.clip(step, -limit, limit)
        return np.abs(_partial(c, orders, angles, 0, 0))


def _partial(
    c: Numbers, orders: tuple[Numbers, Numbers], angles: Array, one: int, two: int
) -> Array:
    """Derivatives (n,) of a mode's series, `one` and `two` times by the angles (n, 2)."""
    first, second = orders
    weighted = c * np.multiply.outer((1j * first) ** one, (1j * second) ** two)
    along, across = np.exp(1j * angles[:, :1] * first), np.exp(1j * angles[:, 1:] * second)
    return np.asarray(np.einsum("nm,nk,mk->n", along, across, weighted, optimize=True).real)


def motion(map_: ReturnMap, curve: Curve) -> QuasiPeriodic:
    """The motion (scaled units) whose states at drive phase 0 form an invariant curve."""
    _, omega = map_.at(curve.parameter)
    p = map_.period_multiple
    second = curve.rotation / map_.duration(curve.parameter)
    modes, last = curve.values.shape[1] // 2, curve.circle.harmonics
    count = FIRST_SAMPLES * p
    while True:
        states = map_.samples(curve.values, curve.parameter, count, curve.circle.angles)
        q = states[:, :, :modes]
        times = 2 * np.pi * p / omega * np.arange(count) / count
        along = np.fft.rfft(q, axis=1)[:, : last + 1] / curve.circle.count
        along *= np.exp(-1j * second * np.multiply.outer(times, np.arange(last + 1)))[:, :, None]
        along[:, 1:] *= 2.0
        c = np.fft.fftshift(np.fft.fft(along, axis=0) / count, axes=0)[1:]
        sizes = np.abs(c).max(axis=(1, 2))
        if max(sizes[:2].max(), sizes[-2:].max()) < TAIL * sizes.max() or count >= MOST_SAMPLES * p:
            break
        count *= 2
    middle = (len(c) - 1) // 2
    c[:middle, 0] = 0.0  # conjugates of those of positive order
    c[middle + 1 :, 0] *= 2.0
    kept = np.flatnonzero(sizes + sizes[::-1] > 0.1 * TAIL * sizes.max())
    return QuasiPeriodic(c[kept[0] : kept[-1] + 1], omega, second, p)
