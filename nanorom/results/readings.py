"""What an instrument reads off a response: one harmonic of a mode or of a point of the film."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from nanorom.continuation import Branch, Readout, SpecialPoint, readout
from nanorom.errors import ContinuationError
from nanorom.rom.names import index_of
from nanorom.scene.instrument import Instrument
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.results.response import Response

Output = str | int | Sequence[float] | Array  # a mode by its name or place, or values (L,) of modes
REFERENCE = 1e-9  # m: decibels are those of nanometres
MOST_SAMPLES = 1 << 18
MARGIN = 40  # harmonics beyond what a fringe is turned by: Bessel functions of that order vanish
COLUMNS = {"x": "m", "y": "m", "phase": "rad", "decibel": "dB re 1 nm"}
VOLTAGES = {"signal_x": "V", "signal_y": "V", "signal_phase": "rad", "dbm": "dBm"}


@attrs.define(eq=False)
class _Orbits:
    """What `readout` asks for."""

    omega: Array
    period_multiple: int
    coefficients: list[Array]


def weights(response: Response, output: Output) -> Array:
    """The modes' part (L,) in an output; raises ContinuationError for one that is not there."""
    names, size = response.label, len(response.label)
    if isinstance(output, str):
        named = index_of(names, output)
        if named is None:
            raise ContinuationError(f"output: found {output!r}; allowed: {', '.join(names)}")
        output = named
    if isinstance(output, (int, np.integer)):
        if not 0 <= output < size:
            raise ContinuationError(f"output: found mode {output}; allowed 0 to {size - 1}")
        return np.asarray(np.eye(size)[output])
    found = np.asarray(output, dtype=float)
    if found.shape != (size,):
        raise ContinuationError(f"output: shape {found.shape}, expected {(size,)}")
    return found


def order(harmonic: object) -> Fraction:
    """A harmonic of the drive, be it "1/2"; raises ContinuationError for none."""
    try:
        found = Fraction(str(harmonic))
    except (ValueError, ZeroDivisionError):
        raise ContinuationError(f'harmonic: found {harmonic!r}; allowed 1, 2, "1/2", ...') from None
    if found < 0:
        raise ContinuationError(f"harmonic: found {harmonic!r}; allowed 0 or more")
    return found


def reading(
    response: Response, orbits: Branch | SpecialPoint, output: Output, harmonic: object = 1
) -> Readout:
    """One harmonic of an output along a branch, or at a special point, in m.

    output: a mode by its name or its place from 0, or values (L,) of the mode shapes at a point of
    the film; harmonic: of the drive's frequency; "1/2" for what has twice its period, of which
    other branches have nothing. Raises ContinuationError for what is not there.
    """
    single = isinstance(orbits, SpecialPoint)
    coefficients: Any = [orbits.coefficients] if single else orbits.coefficients
    given = _Orbits(np.atleast_1d(orbits.omega), orbits.period_multiple, coefficients)
    number = order(harmonic)
    if (number * orbits.period_multiple).denominator > 1:
        return Readout(given.omega, np.zeros(len(given.omega), dtype=complex))
    return readout(given, weights(response, output), float(number))


def signal(
    response: Response, orbits: Branch | SpecialPoint, output: Output, harmonic: object = 1
) -> Readout:
    """The same of the voltage that the response's readout makes of an output, in V.

    A fringe makes harmonics of a motion that has none.  Raises ContinuationError, also where there
    is no readout, or a motion goes through so many fringes that they cannot be told apart.
    """
    instrument = response.readout
    if instrument is None:
        raise ContinuationError("readout: none; allowed: of a response with [readout]")
    single = isinstance(orbits, SpecialPoint)
    given: Any = [orbits.coefficients] if single else orbits.coefficients
    omega, number = np.atleast_1d(orbits.omega), order(harmonic) * orbits.period_multiple
    if number.denominator > 1:
        return Readout(omega, np.zeros(len(omega), dtype=complex))
    seen = weights(response, output)
    found = [_of_voltage(instrument, each @ seen, int(number)) for each in given]
    return Readout(omega, np.array(found, dtype=complex))


def _of_voltage(instrument: Instrument, motion: Array, number: int) -> complex:
    """Harmonic of the voltage of a motion, mean, cosines and sines in turn (1 + 2 H,), in m."""
    highest = len(motion) // 2
    turned = instrument.wave * np.abs(motion[1:]).sum()
    needed = 2 * (highest * (turned + MARGIN) + number)
    if not needed <= MOST_SAMPLES:
        raise ContinuationError(
            f"readout.wavelength: the motion goes through {turned / (2 * np.pi):.3g} fringes; "
            f"allowed: so few that {MOST_SAMPLES} samples tell them apart"
        )
    count = 1 << int(np.ceil(np.log2(needed)))
    spectrum = np.zeros(count // 2 + 1, dtype=complex)
    spectrum[0] = count * motion[0]
    spectrum[1 : highest + 1] = count / 2 * (motion[1::2] - 1j * motion[2::2])
    volts = instrument.volts(np.fft.irfft(spectrum, count))
    found = np.fft.rfft(volts)[number] / count
    return complex(found if number == 0 else 2 * found)


def columns(found: Readout) -> dict[str, Any]:
    """The columns of a table, by name: `COLUMNS` tells their units."""
    return {"x": found.x, "y": found.y, "phase": found.phase, "decibel": found.decibel(REFERENCE)}


def voltages(found: Readout, instrument: Instrument) -> dict[str, Any]:
    """The same of a voltage: `VOLTAGES` tells their units."""
    power = instrument.dbm(found.size)
    return {"signal_x": found.x, "signal_y": found.y, "signal_phase": found.phase, "dbm": power}
