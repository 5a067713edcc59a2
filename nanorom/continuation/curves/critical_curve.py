"""Curves of orbits with a critical multiplier in the plane of drive frequency and a parameter.

The balance and the criticality of the orbit (`critical`) are followed. Where the parameter turns
back along the curve there is a cusp of folds, or the tip of a tongue. Source: Detroux et al. 2015,
doi:10.1016/j.cma.2015.07.017 (bifurcation tracking with harmonic balance).
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.curves.curve import Curve, Place
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.continuation.orbits.harmonics import Support
from nanorom.continuation.points.critical import CriticalBalance

LEFT_OUT = 0.03  # of the tolerance: coefficients that are no unknowns


@attrs.define(eq=False, kw_only=True)
class CriticalCurve(Curve):
    """Orbits at a bifurcation of one kind; where a pair is critical, the further unknown is its
    second frequency by the rate.
    """

    kind: Kind

    def equations(self, support: Support, harmonics: int) -> CriticalBalance:
        return CriticalBalance(
            self.origin, self.change, support, self.kind, self.multiple, harmonics
        )

    def _adapt(self, here: Place) -> Place:
        """As of any curve; without the coefficients that are next to zero."""
        here = super()._adapt(here)
        assert isinstance(here.balance, CriticalBalance)
        whole = here.balance.whole
        there = here if whole is here.balance else self._moved(here, whole)
        part = min(LEFT_OUT * self.tolerance, self.small_force)
        less = whole.without_small(there.z, part)
        same = np.array_equal(less.basis.taken, here.balance.basis.taken)
        return here if same else self._moved(there, less)
