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
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.results.response import Response

Output = str | int | Sequence[float] | Array  # a mode by its name or place, or values (L,) of modes
REFERENCE = 1e-9  # m: decibels are those of nanometres
COLUMNS = {"x": "m", "y": "m", "phase": "rad", "decibel": "dB re 1 nm"}


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


def columns(found: Readout) -> dict[str, Any]:
    """The columns of a table, by name: `COLUMNS` tells their units."""
    return {"x": found.x, "y": found.y, "phase": found.phase, "decibel": found.decibel(REFERENCE)}
