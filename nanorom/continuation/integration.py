"""Integration in time of many periods at equidistant instants, bounded and reported."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import odeint

from nanorom.continuation.lockin import PER_PERIOD
from nanorom.errors import ContinuationError
from nanorom.types import Array

MOST_PERIODS = 200_000  # some minutes for a few modes
MOST_NUMBERS = 50_000_000  # of samples kept, 400 MB
CHUNK = 64  # periods integrated at once
MOST_STEPS = 100_000  # of the integrator between two samples
SMALL = 1e-4  # of the unit of amplitude, below which errors are absolute
ESCAPED = 1e6  # units of amplitude: no film comes back from there


def check_periods(periods: float, coordinates: int, remedy: str) -> None:
    """Raise ContinuationError for more periods than a run may have, with a remedy."""
    most = min(MOST_PERIODS, MOST_NUMBERS // (2 * coordinates * PER_PERIOD))
    if periods > most:
        raise ContinuationError(
            f"time: found {periods:.3g} periods to integrate; allowed {most:.3g}; {remedy}"
        )


def integrated(
    right_side: Callable[[float, Array], Array],
    state: Array,
    spacing: float,
    count: int,
    tolerance: float,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Array, bool]:
    """States (n, 2L) at the instants 0, spacing, 2 spacing, ..., and whether all `count` were
    reached before the motion left all bounds.
    """
    options = {"rtol": tolerance, "atol": SMALL * tolerance, "tfirst": True, "mxstep": MOST_STEPS}
    states = np.empty((count, len(state)))
    states[0] = state
    step = CHUNK * PER_PERIOD
    for first in range(0, count - 1, step):
        last = min(first + step, count - 1)
        times = spacing * np.arange(first, last + 1)
        states[first : last + 1] = odeint(right_side, states[first], times, **options)
        if not np.abs(states[last]).max() < ESCAPED:
            return states[:first], False
        if progress is not None:
            progress(last + 1, count)
    return states, True
