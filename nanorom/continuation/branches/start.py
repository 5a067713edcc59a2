"""First orbits of branches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nanorom.continuation.branches.raising import Rise
from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.harmonics import turned
from nanorom.continuation.orbits.orbit import Orbit, same_orbit
from nanorom.errors import ContinuationError
from nanorom.types import Array

MIDDLE = 0.5  # of a step from a fold
LEAST_RISE = 1e-3  # of the drive: the smallest part by which it is raised
OUTWARD = 1.3  # factor between frequencies at which the response from rest is looked for
FARTHEST = 6  # such factors away
SAME_FREQUENCY = 1e-9  # of a frequency at which a step ends
CLOSED = 1e-5  # of orbit and rate: series are less exact than orbits
AWAY = 0.1  # of a first step, in which a branch cannot have closed


def first_orbit(tracer: Tracer, omega: float, outward: float = 0.0) -> Orbit:
    """The orbit at `omega` of the response from rest.

    It is reached by raising the drive, or, where that leads past a fold, along the branch from a
    frequency farther off: above for outward > 0, below for outward < 0. If that fails, too, the
    drive is raised round its folds.

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
    try:
        return tracer.solve(Rise(tracer, omega).orbit(), fixed_rate)[0]
    except ContinuationError as error:
        raise ContinuationError(f"{failed} ({error})") from None


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


def beside_fold(tracer: Tracer, orbit: Orbit, rates: tuple[float, float]) -> Orbit:
    """An orbit a little away from a fold that another one is near, of the same branch.

    At a fold the frequency cannot be kept in Newton's method, but the size of the orbit can.
    Raises ContinuationError if there is no orbit near, or none beside it.
    """

    def fixed_size(balance: HarmonicBalance) -> Array:
        packed = balance.basis.pack(balance.basis.compress(orbit.coefficients))
        return np.append(packed / np.linalg.norm(packed), 0.0)

    fold, _ = tracer.solve(orbit, fixed_size)
    for series in tracer.follow(fold, fold.coefficients, rates):
        return tracer.orbit(series, MIDDLE * series.length)
    raise ContinuationError("no orbit beside the fold of another level")


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
    section: Section | None = None
    for series in tracer.follow(orbit, direction, rates):
        section = section or Section(tracer, series)
        root = section.passed(series, 0.0 if steps else AWAY * series.length)
        steps.append(series)
        if root is not None:
            series.length = root
            tracer.ending = "closed"
            break
    return steps


class Section:
    """The hyperplane through the first orbit of a step, normal to the branch: where the branch
    passes it close to the orbit (or to it some periods of the drive later), it has closed. (At a
    fold it would not pass the frequency of the orbit.)
    """

    def __init__(self, tracer: Tracer, series: Series) -> None:
        self.tracer, basis = tracer, series.balance.basis
        self.orbit = tracer.orbit(series, 0.0)
        tangent = series.tangent(0.0)
        self.slope = float(tangent[-1])
        self.normal = basis.expand(basis.unpack(tangent[:-1]), tracer.system.size)

    def passed(self, series: Series, after: float) -> float | None:
        """The place in a step, beyond another one, at which the branch is back."""
        p, orbit = self.orbit.period_multiple, self.orbit
        for shift in range(p):
            angle = 2 * np.pi * shift / p
            first = Orbit(turned(orbit.coefficients, angle), orbit.rate, p)
            for root in self._crossings(series, first, turned(self.normal, angle)):
                if root > after and self._is_near(self.tracer.orbit(series, root), first):
                    return root
        return None

    def _crossings(self, series: Series, orbit: Orbit, normal: Array) -> list[float]:
        basis = series.balance.basis
        direction = basis.pack(basis.compress(normal))
        place = float(direction @ basis.pack(basis.compress(orbit.coefficients)))
        return series.level_crossings(direction, self.slope, place + self.slope * orbit.rate)

    def _is_near(self, one: Orbit, two: Orbit) -> bool:
        near = abs(one.rate - two.rate) < CLOSED * two.rate
        return near and same_orbit(one, two, CLOSED)
