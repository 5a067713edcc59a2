"""Small disturbances of a stable periodic motion: sidebands, gain, thermal noise and squeezing.

Along an orbit of rate w = omega / period_multiple the disturbed equations have periodic
coefficients, so that a force at one frequency answers at all its sidebands m w apart:

    sum_m [ (i s_n)^2 delta_nm + i s_m C_(n-m) + K_(n-m) ] q_m = f_n ,    s_n = nu + n w .

Thermal forces are white with the one-sided density 4 k T C of the viscous damping (Nyquist), and
what reaches a frequency from all sidebands adds up. At rest that is the text book's 4 k T C times
|chi|^2.
Sources: Hill's infinite determinant; Rugar and Gruetter 1991, doi:10.1103/PhysRevLett.67.699
(squeezing); Callen and Welton 1951, doi:10.1103/PhysRev.83.34.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix, full_support
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

BOLTZMANN = 1.380649e-23  # J/K, exact in the SI
FIRST_SIDEBANDS, MOST_SIDEBANDS = 6, 200
LAST = 1e-10  # response at the outermost sidebands relative to the largest
SAME = 1e-9  # of the rate: a carrier that is a whole number of half rates


@attrs.frozen(eq=False, init=False)
class LinearResponse:
    """What small forces do to a stable periodic motion, or to the film at rest.

    Parameters
    ----------
    system : ModalSystem
        In SI units where temperatures are in K.
    orbit : PeriodicOrbit
        The motion that is disturbed, at these levels; its coefficients are zero at rest.
    direct, parametric : float
        Drive levels.

    Raises
    ------
    ContinuationError
        if the orbit is unstable, or if the levels are not those of the orbit's system.
    """

    system: ModalSystem
    orbit: PeriodicOrbit
    _scaled: ScaledSystem
    _stiffness: Numbers
    _damping: Numbers

    @one_thread()
    def __init__(
        self,
        system: ModalSystem,
        orbit: PeriodicOrbit,
        direct: float = 0.0,
        parametric: float = 0.0,
    ) -> None:
        scaled = system.scaled(direct, parametric)
        coefficients = scaled.inner(orbit.coefficients)
        if coefficients.shape[1] != scaled.size:
            raise ContinuationError(
                f"orbit: found {coefficients.shape[1]} modes; allowed {scaled.size}"
            )
        p = orbit.period_multiple
        rate = orbit.omega / scaled.frequency / p
        multipliers = FloquetSolver(scaled).multipliers(
            coefficients[None], np.array([rate]), p, full_support(scaled, p)
        )[0]
        if np.abs(multipliers).max() >= 1:
            raise ContinuationError(
                f"orbit: unstable (multiplier {np.abs(multipliers).max():.6g}); "
                "small disturbances of it do not stay small"
            )
        stiffness, damping = _tangents(scaled, coefficients, rate, p)
        self.__attrs_init__(  # type: ignore[attr-defined]
            system, orbit, scaled, stiffness, damping
        )

    @property
    def rate(self) -> float:
        """Distance of the sidebands, rad per unit of time."""
        return self.orbit.omega / self.orbit.period_multiple

    @one_thread()
    def transfer(self, omega: Array | float, sideband: int = 0) -> Numbers:
        """Displacement per force (n, 2N + 1, L, L), in units of q by force, in complex amplitudes.

        Entry [i, N + m, r, s]: q_r at omega[i] + sideband * rate for a force on mode s at omega[i]
        + m * rate. Angular frequencies in rad per unit of time; N is as large as needed.
        """
        given = np.atleast_1d(np.asarray(omega, dtype=float)) / self._scaled.frequency
        scaled, modes = self._scaled, self.system.size
        shapes = np.eye(scaled.size) if scaled.shapes is None else scaled.shapes
        inverse = np.linalg.inv(self.system.mass) / scaled.frequency**2
        most = FIRST_SIDEBANDS + abs(sideband)
        while True:
            rows = np.stack([self._row(value, most, sideband) for value in given])
            sizes = np.abs(rows).max(axis=(0, 2, 3))
            if max(sizes[0], sizes[-1]) < LAST * sizes.max() or most >= MOST_SIDEBANDS:
                return np.asarray(shapes @ rows[..., :modes] @ inverse)
            most *= 2

    def density(
        self, omega: Array | float, temperature: float, *, boltzmann: float = BOLTZMANN
    ) -> Numbers:
        """One-sided thermal cross-spectral density (n, L, L) of q in m^2/Hz at angular frequencies
        omega (n,) in rad/s and a temperature in K; Hermitian.
        """
        force = self.force_density(temperature, boltzmann=boltzmann)
        rows = self.transfer(omega)
        return np.asarray(np.einsum("nmrs,st,nmqt->nrq", rows, force, rows.conj(), optimize=True))

    def displacement(
        self,
        omega: Array | float,
        temperature: float,
        shape: Array,
        *,
        boltzmann: float = BOLTZMANN,
    ) -> Array:
        """Spectral density (n,) in m/sqrt(Hz) of the displacement at a point of the film where the
        mode shapes have the values `shape` (L,); omega (n,) in rad/s, temperature in K.
        """
        values = np.asarray(shape, dtype=float)
        density = self.density(omega, temperature, boltzmann=boltzmann)
        return np.sqrt(np.einsum("r,nrq,q->n", values, density, values).real)

    def force_density(self, temperature: float, *, boltzmann: float = BOLTZMANN) -> Array:
        """One-sided density (L, L) of the thermal forces in N^2/Hz at a temperature in K; raises
        ContinuationError for one below zero.
        """
        if not np.isfinite(temperature) or temperature < 0:
            raise ContinuationError(f"temperature: found {temperature!r}; allowed 0 K or more")
        damping = self.system.damping
        return np.asarray(4 * boltzmann * temperature * (damping + damping.T) / 2)

    def quadratures(
        self,
        carrier: float,
        offset: Array | float,
        temperature: float,
        shape: Array,
        *,
        boltzmann: float = BOLTZMANN,
    ) -> tuple[Array, Array, Array]:
        """Smallest and largest one-sided density (n,) in m^2/Hz of the quadratures of a
        displacement, and the phase (n,) in rad of the smallest one.

        The displacement with values `shape` (L,) of the mode shapes is X cos(carrier t + phase) - Y
        sin(carrier t + phase); X is seen at the offsets (n,) in rad/s from the carrier. A carrier
        must be a whole number of half the orbit's rate, or its phase means nothing: another raises
        ContinuationError.
        """
        turns = 2 * carrier / self.rate
        if abs(turns - round(turns)) > SAME * max(1.0, abs(turns)):
            raise ContinuationError(
                f"carrier: found {carrier:g}; allowed multiples of half the orbit's rate "
                f"{self.rate:g}"
            )
        values, mirror = np.asarray(shape, dtype=float), -round(turns)
        force = self.force_density(temperature, boltzmann=boltzmann)
        nu = carrier + np.atleast_1d(np.asarray(offset, dtype=float))
        upper, lower = (
            np.einsum("r,nmrs->nms", values, _centred(self.transfer(nu, m), MOST_SIDEBANDS * 2))
            for m in (0, mirror)
        )

        def correlation(one: Numbers, two: Numbers) -> Numbers:
            return np.asarray(np.einsum("nms,st,nmt->n", one, force, two.conj(), optimize=True))

        # X at an offset is what the displacement has above and below the carrier, added up
        mean = (correlation(upper, upper) + correlation(lower, lower)).real
        cross = correlation(upper, lower)
        phase = (np.angle(cross) + np.pi) / 2
        return mean - 2 * np.abs(cross), mean + 2 * np.abs(cross), phase

    def _row(self, nu: float, most: int, sideband: int) -> Numbers:
        """Block row `sideband` (2N + 1, L, L) of the inverse of Hill's matrix at a frequency."""
        size = self._scaled.size
        rate = self.rate / self._scaled.frequency
        orders = np.arange(-most, most + 1)
        s = nu + rate * orders
        reach = (len(self._stiffness) - 1) // 2
        gap = orders[:, None] - orders[None, :]
        present = (np.abs(gap) <= reach)[:, :, None, None]
        place = np.clip(gap, -reach, reach) + reach
        blocks = self._stiffness[place] + 1j * s[None, :, None, None] * self._damping[place]
        blocks = np.where(present, blocks, 0.0)
        diagonal = np.arange(len(orders))
        blocks[diagonal, diagonal] -= (s**2)[:, None, None] * np.diag(self._scaled.inertia)
        matrix = blocks.transpose(0, 2, 1, 3).reshape(len(orders) * size, -1)
        wanted = np.zeros((len(orders) * size, size))
        first = (most + sideband) * size
        wanted[first : first + size] = np.eye(size)
        rows = np.linalg.solve(matrix.T, wanted).T  # of the inverse
        return np.asarray(rows.reshape(size, len(orders), size).transpose(1, 0, 2))


def _centred(rows: Numbers, most: int) -> Numbers:
    """Rows (n, 2N + 1, L, L) padded to sidebands -most ... most."""
    missing = most - (rows.shape[1] - 1) // 2
    return np.pad(rows, [(0, 0), (missing, missing), (0, 0), (0, 0)])


def _tangents(
    system: ScaledSystem, coefficients: Array, rate: float, period_multiple: int
) -> tuple[Numbers, Numbers]:
    """Complex Fourier coefficients (2F + 1, L, L), of orders -F ... F in the orbit's angle, of the
    tangent stiffness and damping along an orbit.
    """
    # twice the harmonics
    reach = max(coefficients.shape[0] - 1, system.tones * period_multiple)
    count = 2 * reach + 1
    angles = 2 * np.pi / count * np.arange(count)
    table = fourier_matrix(angles, (len(coefficients) - 1) // 2)
    q, speed = table @ coefficients, rate * (table @ differentiate(coefficients))
    stiffness = system.stiffness + 2 * np.einsum("rjk,nj->nrk", system.quadratic, q)
    stiffness = stiffness + 3 * np.einsum("rjkl,nj,nk->nrl", system.cubic, q, q, optimize=True)
    drive = fourier_matrix(period_multiple * angles, system.tones)
    stiffness -= np.einsum("nk,rjk->nrj", drive, system.parametric)
    damping = system.damping + np.einsum("rkjl,nj,nl->nrk", system.loss, q, q, optimize=True)
    stiffness += 2 * np.einsum("rkjl,nl,nk->nrj", system.loss, q, speed, optimize=True)
    return _orders(stiffness), _orders(damping)


def _orders(samples: Array) -> Numbers:
    """Complex Fourier coefficients of orders -F ... F from 2F + 1 samples."""
    return np.asarray(np.fft.fftshift(np.fft.fft(samples, axis=0), axes=0) / len(samples))
