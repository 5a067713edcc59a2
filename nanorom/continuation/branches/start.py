"""First orbits of branches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.orbit import Orbit, same_orbit
from nanorom.errors import ContinuationError
from nanorom.types import Array

LEAST_RISE = 1e-3  # of the drive: the smallest part by which it is raised
OUTWARD = 1.3  # factor between frequencies at which the response from rest is looked for
FARTHEST = 6  # such factors away
SAME_FREQUENCY = 1e-9  # of a frequency at which a step ends
AWAY = 0.1  # of a first step, in which a branch cannot have closed


def first_orbit(tracer: Tracer, omega: float, outward: float = 0.0) -> Orbit:
    """The orbit at `omega` of the response from rest.

    It is reached by raising the drive, or, where that leads past a fold, along the branch from a
    frequency farther off: above for outward > 0, below for outward < 0.

    Raises
    ------
    ContinuationError
        if neither leads to an orbit.
    """
    try:
        return _raised(tracer, omega)
    except ContinuationError:
        if not outward:
            raise
        failed = ContinuationError(
            "no periodic orbit found at the start of the range "
            f"(omega = {omega:.6g} of the lowest natural frequency); "
            "start the range farther from a resonance"
        )
    for number in range(1, FARTHEST + 1):
        far = omega * OUTWARD ** (number if outward > 0 else -number)
        try:
            return _followed(tracer, _raised(tracer, far), omega)
        except ContinuationError:
            continue  # farther off it may be easier
    raise failed


def _raised(tracer: Tracer, omega: float) -> Orbit:
    """The orbit reached from rest by raising the drive."""
    p = tracer.period_multiple
    orbit = Orbit(np.zeros((2 * p * 2 + 1, tracer.system.size)), omega / p, p)
    if not tracer.support.table.any():
        return orbit
    level, step = 0.0, 1.0
    while level < 1.0:
        target = min(1.0, level + step)
        ramped = tracer if target == 1.0 else _at_level(tracer, target)
        try:
            orbit, _ = ramped.solve(orbit, fixed_rate)
            level, step = target, 2 * step
        except ContinuationError:
            step /= 2
            if step < LEAST_RISE:
                raise
    return orbit


def _followed(tracer: Tracer, orbit: Orbit, omega: float) -> Orbit:
    """Where the branch of an orbit reaches another frequency."""
    p = tracer.period_multiple
    rates = min(orbit.omega, omega) / p, max(orbit.omega, omega) / p
    direction = 1.0 if omega > orbit.omega else -1.0
    for series in tracer.follow(orbit, direction, rates):
        end = tracer.orbit(series, series.length)
        if tracer.ending == "range" and abs(end.omega - omega) < SAME_FREQUENCY * omega:
            return end
    raise ContinuationError("the branch does not lead to the start of the range")


def fixed_rate(balance: HarmonicBalance) -> Array:
    """The border that keeps the frequency in Newton's method."""
    border = np.zeros(balance.basis.size + 1)
    border[-1] = 1.0
    return border


def _at_level(tracer: Tracer, level: float) -> Tracer:
    system = replace(
        tracer.system,
        force=level * tracer.system.force,
        parametric=level * tracer.system.parametric,
    )
    return Tracer(system, tracer.support, tracer.period_multiple, tracer.settings)


def follow_closed(
    tracer: Tracer, orbit: Orbit, direction: Array | float, rates: tuple[float, float]
) -> list[Series]:
    """Steps of a branch until it leaves the range or comes back to where it started."""
    steps: list[Series] = []
    for series in tracer.follow(orbit, direction, rates):
        for root in series.crossings(orbit.rate):
            away = steps or root > AWAY * series.length
            if away and same_orbit(tracer.orbit(series, root), orbit):
                series.length = root
                tracer.ending = "closed"
                return [*steps, series]
        steps.append(series)
    return steps
