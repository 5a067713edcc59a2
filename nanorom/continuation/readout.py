"""What an instrument reads off a branch: amplitude and phase, quadratures, decibels."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Protocol

import attrs
import numpy as np

from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

DECIBEL = 20.0  # of a ratio of amplitudes
TINY = 1e-300  # amplitude of no motion at all


class Orbits(Protocol):
    """A `Branch`, an `OrbitCurve`, a `Locus`: orbits one after the other."""

    omega: Array
    period_multiple: int
    coefficients: list[Array]


@attrs.frozen(eq=False)
class Readout:
    """One harmonic of an output along orbits, in the units of the system.

    omega (n,): drive frequencies, rad per unit of time; amplitude (n,): complex, of the output Re
    amplitude exp(i k omega t).
    """

    omega: Array
    amplitude: Numbers

    @property
    def frequency(self) -> Array:
        """omega / (2 pi) (n,): in Hz where omega is in rad/s."""
        return np.asarray(self.omega / (2 * np.pi))

    @property
    def size(self) -> Array:
        """Amplitude (n,) without its phase, in the unit of the output."""
        return np.abs(self.amplitude)

    @property
    def phase(self) -> Array:
        """Phase (n,) ahead of cos(k omega t) in rad, without jumps along the branch."""
        return np.unwrap(np.angle(self.amplitude))

    @property
    def x(self) -> Array:
        """The quadrature (n,) in phase, in the unit of the output: of cos(k w t)."""
        return np.asarray(self.amplitude.real)

    @property
    def y(self) -> Array:
        """The quadrature (n,) a quarter ahead, in the unit of the output: what multiplies -sin(k
        omega t).
        """
        return np.asarray(self.amplitude.imag)

    def decibel(self, reference: float = 1.0) -> Array:
        """20 log10 of the amplitude by a reference in its unit, (n,) in dB; a root mean square has
        3.01 dB less.

        Raises ContinuationError for a reference that is not positive.
        """
        if not reference > 0:
            raise ContinuationError(f"reference: found {reference!r}; allowed more than 0")
        return np.asarray(DECIBEL * np.log10(np.maximum(self.size, TINY) / reference))


def readout(
    orbits: Orbits, output: Array | Sequence[float] | int = 0, harmonic: float = 1
) -> Readout:
    """What a lock-in amplifier reads along a branch, a locus or a curve of orbits.

    Parameters
    ----------
    orbits : Branch, OrbitCurve or Locus
    output : (L,), what is measured: output @ q, as of a point of the film where the mode shapes
        have these values; or the number of one mode, from 0
    harmonic : k, of the drive's frequency; fractions of the period multiple, 1/2, for branches of
        longer periods

    Raises
    ------
    ContinuationError
        for an output or a harmonic that the orbits do not have.
    """
    size = orbits.coefficients[0].shape[1]
    if isinstance(output, (int, np.integer)):
        if not 0 <= output < size:
            raise ContinuationError(f"output: found mode {output}; allowed 0 to {size - 1}")
        output = np.eye(size)[output]
    weights = np.asarray(output, dtype=float)
    if weights.shape != (size,):
        raise ContinuationError(f"output: shape {weights.shape}, expected {(size,)}")
    number = Fraction(harmonic).limit_denominator(1000) * orbits.period_multiple
    if number.denominator != 1 or number < 0:
        raise ContinuationError(
            f"harmonic: found {harmonic!r}; allowed multiples of 1/{orbits.period_multiple}, the "
            "inverse of the period multiple"
        )
    found = [_harmonic(each, weights, int(number)) for each in orbits.coefficients]
    return Readout(np.asarray(orbits.omega), np.array(found, dtype=complex))


def _harmonic(coefficients: Array, weights: Array, number: int) -> complex:
    if 2 * number >= len(coefficients):
        return 0.0j
    if number == 0:
        return complex(coefficients[0] @ weights)
    return complex((coefficients[2 * number - 1] - 1j * coefficients[2 * number]) @ weights)
