"""Periodic orbits along a parameter, in the units of the system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from nanorom.continuation.curves.curve import Point
from nanorom.continuation.curves.parameter import Parameter
from nanorom.continuation.orbits.orbit import PeriodicOrbit, orbit_amplitudes
from nanorom.types import Array, Numbers


@attrs.frozen(eq=False, kw_only=True)
class Orbits:
    """Orbits one after the other along a parameter.

    parameter: its name; level (n,); omega (n,) in rad per unit of time; amplitude (n, L) =
    max |q_r| over a period; turns (m,): numbers of the points at which the parameter turns back;
    coefficients: Fourier coefficients (2H + 1, L) of each orbit, as of a `Branch`.
    """

    parameter: str
    level: Array
    omega: Array
    amplitude: Array
    turns: Numbers
    period_multiple: int
    coefficients: list[Array] = attrs.field(repr=False)

    def orbit(self, index: int) -> PeriodicOrbit:
        """The periodic orbit at one point of the curve."""
        return PeriodicOrbit(
            self.coefficients[index], float(self.omega[index]), self.period_multiple
        )

    def __len__(self) -> int:
        return len(self.level)


def in_units(line: Parameter, points: Sequence[Point], multiple: int) -> dict[str, Any]:
    """The fields of `Orbits` from points of a curve in scaled units."""
    unit = line.unit
    coefficients = [unit.given(point.full) for point in points]
    return {
        "parameter": line.name,
        "level": np.array([point.level for point in points]) * line.size,
        "omega": np.array([point.rate for point in points]) * multiple * unit.frequency,
        "amplitude": np.array([orbit_amplitudes(c[None])[0] for c in coefficients]),
        "turns": np.flatnonzero([point.turn for point in points]),
        "period_multiple": multiple,
        "coefficients": coefficients,
    }
