"""A branch where a range of frequencies cuts it: pieces that leave the range and come back.

A range that begins inside a bistable region shows, from rest, the low branch only; the others are
connected to it outside. From every orbit at an end of the range the branch is followed outwards,
past the resonances that may lean into the range, until it comes back or is far away.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from nanorom.continuation.branches.start import fixed_rate
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.diagrams.record import Record
from nanorom.continuation.orbits.orbit import Orbit, same_orbit
from nanorom.errors import ContinuationError

AT_END = 1e-9  # of the frequency at which a step leaves the range
UNSTABLE = 1e-6  # of a multiplier beyond 1
BEYOND = 1e-2  # of the frequency, past an orbit that is stable again


class Window:
    """The orbits at the ends of a range, and where the base branch comes back into it."""

    def __init__(self, record: Record, tracer: Tracer) -> None:
        self.record, self.tracer = record, tracer
        self.seen: list[Orbit] = []
        self.waiting: list[Orbit] = []  # of those, the ones not followed outwards yet
        self.rest: list[Orbit] = []  # of those, the ones reached from rest

    def begin(self, orbit: Orbit) -> bool:
        """Take note of an orbit at an end, reached from rest; whether it was not met before."""
        here, new = self._met(orbit)
        self.rest.append(here)
        return new

    def meet(self, orbit: Orbit) -> bool:
        """Take note of an orbit of a branch; whether it is at an end, and not met before."""
        edges = np.array(self.record.range)
        at_end = np.abs(edges - orbit.omega).min() <= AT_END * orbit.omega
        return bool(at_end) and self._met(orbit)[1]

    def _met(self, orbit: Orbit) -> tuple[Orbit, bool]:
        """An orbit at an end to all digits, or as it was met before; whether it was not."""
        exact = self._corrected(orbit)
        for other in self.seen:
            if _same(other, exact):
                return other, False
        self.seen.append(exact)
        self.waiting.append(exact)
        return exact, True

    def _corrected(self, orbit: Orbit) -> Orbit:
        """An orbit at an end of the range to all digits: a step's end has fewer of its phase."""
        low, high = self.record.range
        edge = low if abs(orbit.omega - low) < abs(orbit.omega - high) else high
        there = replace(orbit, rate=edge / orbit.period_multiple)
        try:
            return self.tracer.solve(there, fixed_rate)[0]
        except ContinuationError:  # at a fold: as it was
            return orbit

    def add_pieces(self) -> None:
        """Pieces of the branch inside the range that begin where it comes back."""
        low, high = self.record.range
        while self.waiting:
            orbit = self.waiting.pop(0)
            back = self._return(orbit)
            if back is None or not self.meet(back):
                continue
            inwards = 1.0 if back.omega < (low + high) / 2 else -1.0
            steps = list(self.tracer.follow(back, inwards, self._rates(low, high)))
            if not steps:
                continue
            end = self.tracer.orbit(steps[-1], steps[-1].length)
            self.meet(end)
            # another branch may have led to it before
            if self.tracer.period_multiple == 1 or not self.record.is_known(self.tracer, steps):
                self.record.add(self.tracer, steps, None, int(self.tracer.period_multiple > 1))

    def _rates(self, low: float, high: float) -> tuple[float, float]:
        """Frequencies of the drive as rates of the orbits."""
        return low / self.tracer.period_multiple, high / self.tracer.period_multiple

    def tell(self) -> None:
        """Note the ends of the range with several orbits."""
        for edge in self.record.range:
            count = sum(abs(orbit.omega - edge) < AT_END * edge for orbit in self.seen)
            if count > 1:
                why = f"{count} orbits at this end of the range; what joins them lies outside"
                self.record.leave("window", edge, why)

    def outside(self) -> Iterator[tuple[float, float]]:
        """Ranges from an end at which the branch from rest is unstable to where it became so."""
        low, high = self.record.range
        for orbit in self.rest:
            if not self._is_unstable(orbit):
                continue
            falls = orbit.omega < (low + high) / 2
            reach = self.record.settings.reach
            outer = (low / reach, low) if falls else (high, high * reach)
            for series in self.tracer.follow(orbit, -1.0 if falls else 1.0, self._rates(*outer)):
                end = self.tracer.orbit(series, series.length)
                if not self._is_unstable(end):
                    beyond = end.omega * (1 - BEYOND if falls else 1 + BEYOND)
                    yield (beyond, low) if falls else (high, beyond)
                    break
            else:
                why = "unstable at this end of the range; what made it so was not found outside"
                self.record.leave("window", low if falls else high, why)

    def _is_unstable(self, orbit: Orbit) -> bool:
        given = orbit.coefficients[None], np.array([orbit.rate])
        found = self.record.floquet.multipliers(*given, orbit.period_multiple, self.tracer.support)
        return bool(np.abs(found).max() > 1 + UNSTABLE)

    def _return(self, orbit: Orbit) -> Orbit | None:
        """Where the branch that leaves the range at an orbit comes back."""
        low, high = self.record.range
        reach = self.record.settings.reach
        falls = orbit.omega < (low + high) / 2
        outside = (low / reach, low) if falls else (high, high * reach)
        if orbit in self.rest and not self._may_lean(*outside, falls):
            return None
        end = None
        for series in self.tracer.follow(orbit, -1.0 if falls else 1.0, self._rates(*outside)):
            end = self.tracer.orbit(series, series.length)
        edge = low if falls else high
        back = end is not None and abs(end.omega - edge) < AT_END * edge
        return end if back and self.tracer.ending == "range" else None

    def _may_lean(self, lowest: float, highest: float, hardening: bool) -> bool:
        """Whether a resonance of a moving mode between two frequencies may lean into the range."""
        moving = np.flatnonzero(self.tracer.support.table.any(axis=1))
        system = self.tracer.system.restrict(moving)
        frequencies = np.sqrt(np.abs(np.linalg.eigvals(system.stiffness)))
        if not ((frequencies > lowest) & (frequencies < highest)).any():
            return False
        modes = np.arange(system.size)
        own = system.cubic[modes, modes, modes, modes]
        leans = (own > 0) if hardening else (own < 0)
        return bool(system.quadratic.any() or leans.any())


def _same(one: Orbit, two: Orbit) -> bool:
    return abs(one.omega - two.omega) < AT_END * two.omega and same_orbit(one, two)
