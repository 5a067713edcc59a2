"""A branch as an iterator of states: the caller prints, saves and stops."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from nanorom.continuation.branches.start import first_orbit
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.harmonics import forced_support
from nanorom.continuation.orbits.orbit import PeriodicOrbit, orbit_amplitudes
from nanorom.continuation.settings import Settings, check_range
from nanorom.continuation.system import ModalSystem
from nanorom.types import Array

TRUNCATION = 1e-11  # of multipliers that tell stability, not where it changes


@attrs.frozen(eq=False)
class State:
    """One point of a branch, in the system's units.

    omega; amplitude (L,) = max |q_r| over a period; multipliers (2L,); stable; orbit.
    """

    omega: float
    amplitude: Array
    multipliers: Array
    stable: bool
    orbit: PeriodicOrbit


def states(
    system: ModalSystem,
    omega: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    falling: bool = False,
    tolerance: float = 5e-10,
    steps: int = 2000,
) -> Iterator[State]:
    """States of the response from rest, one per step, computed as they are asked for.

    omega: (low, high) in rad per unit of time; direct, parametric: levels in units of the patterns;
    tolerance: relative, of the orbits.
    Starts at omega[0] (at omega[1] if `falling`) and goes round folds until the branch leaves the
    range. Raises ContinuationError like `explore`.
    """
    scaled = system.scaled(direct, parametric)
    low, high = (value / scaled.frequency for value in check_range(omega))
    support = forced_support(scaled)
    tracer = Tracer(scaled, support, 1, Settings(tolerance=tolerance, steps=steps))
    floquet = FloquetSolver(scaled, truncation=TRUNCATION)
    first = first_orbit(tracer, high if falling else low)
    for series in tracer.follow(first, -1.0 if falling else 1.0, (low, high)):
        for a in (0.0, series.length) if tracer.ending == "range" else (0.0,):
            orbit = tracer.orbit(series, a)
            coefficients = orbit.coefficients[None]
            multipliers = floquet.multipliers(coefficients, np.array([orbit.rate]), 1, support)[0]
            frequency = orbit.omega * scaled.frequency
            yield State(
                omega=frequency,
                amplitude=orbit_amplitudes(scaled.given(coefficients))[0],
                multipliers=multipliers,
                stable=bool(np.abs(multipliers[0]) < 1),
                orbit=PeriodicOrbit(scaled.given(orbit.coefficients), frequency),
            )
