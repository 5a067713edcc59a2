"""Branches that nothing leads to: from an orbit that may be near one."""

from __future__ import annotations

import numpy as np

from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.start import beside_fold, fixed_rate, follow_closed
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.diagrams.record import Record
from nanorom.continuation.diagrams.window import Window
from nanorom.continuation.orbits.harmonics import (
    Support,
    forced_support,
    full_support,
    own_support,
)
from nanorom.continuation.orbits.orbit import Orbit, is_shorter
from nanorom.errors import ContinuationError

UNSTABLE = 100.0  # multiplier beyond which an orbit that nothing leads to is not followed


class Apart:
    """Follows them, and what they lead to beyond the ends of the range, which `window` knows."""

    def __init__(self, record: Record) -> None:
        self.record, self.scaled, self.settings = record, record.scaled, record.settings
        self.window: Window | None = None

    def follow(
        self,
        seed: Orbit,
        support: Support | None = None,
        at_fold: bool = False,
        alone: bool = False,
    ) -> bool:
        """The branch near an orbit, say of another level, unless it is known; whether there is
        one.
        """
        p = seed.period_multiple
        low, high = self.record.range
        if not low < seed.omega < high and p == 1:
            return False
        if support is None:
            support = full_support(self.scaled, p)
        if p == 1 and forced_support(self.scaled).holds(seed.coefficients):
            support = forced_support(self.scaled)
        tracer = Tracer(self.scaled, support, p, self.settings)
        rates = self.record.rates(p, p > 1 and not alone)
        try:
            if at_fold:
                orbit = beside_fold(tracer, seed, rates)
            else:
                orbit, _ = tracer.solve(seed, fixed_rate)
        except ContinuationError as error:
            if not alone and not self.record.known:  # a level need not have what another one has
                self.record.leave("start", seed.omega, f"from a seed: {error}")
            return False
        if is_shorter(orbit):
            return False
        if not self.record.is_new(orbit):
            return True
        own = own_support(self.scaled, orbit.coefficients, p)
        if own.table.sum() < support.table.sum():
            support, tracer = own, Tracer(self.scaled, own, p, self.settings)
        if alone and self._is_unstable(orbit, support):
            why = f"orbits of {p} period(s) with multipliers above {UNSTABLE:g}: not followed"
            self.record.leave("start", orbit.omega, why)
            return True
        steps = follow_closed(tracer, orbit, 1.0, rates)
        if tracer.ending != "closed":  # from end to end
            steps = follow_closed(tracer, orbit, -1.0, rates) or steps
        if not steps:
            return False
        if tracer.ending != "closed":
            end = tracer.orbit(steps[-1], steps[-1].length)
            slope = steps[-1].rate_slope(steps[-1].length)
            steps = follow_closed(tracer, end, -1.0 if slope > 0 else 1.0, rates)
        if steps and not self.record.is_known(tracer, steps):
            self.record.add(tracer, steps, None, 0 if p == 1 else 1)
            self._beyond(tracer, steps)
        return bool(steps)

    def _beyond(self, tracer: Tracer, steps: list[Series]) -> None:
        """What a branch leads to outside the range."""
        window = self.window
        if tracer.period_multiple > 1:
            window = Window(self.record, tracer)
        if window is not None and np.array_equal(tracer.support.table, window.tracer.support.table):
            window.meet(tracer.orbit(steps[0], 0.0))
            window.meet(self.record.end(tracer, steps))
            window.add_pieces()

    def _is_unstable(self, orbit: Orbit, support: Support) -> bool:
        """Whether an orbit that nothing leads to is too unstable to be met in practice."""
        given = orbit.coefficients[None], np.array([orbit.rate])
        multipliers = self.record.floquet.multipliers(*given, orbit.period_multiple, support)
        return bool(np.abs(multipliers).max() > UNSTABLE)
