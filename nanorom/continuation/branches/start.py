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


def first_orbit(tracer: Tracer, omega: float) -> Orbit:
    """The orbit reached from rest at `omega` by raising the drive."""
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
            if step < 1e-3:
                raise ContinuationError(
                    "no periodic orbit found at the start of the range "
                    f"(omega = {omega:.6g} of the lowest natural frequency); "
                    "start the range farther from a resonance"
                ) from None
    return orbit


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
            away = steps or root > 0.1 * series.length
            if away and same_orbit(tracer.orbit(series, root), orbit):
                series.length = root
                tracer.ending = "closed"
                return [*steps, series]
        steps.append(series)
    return steps
