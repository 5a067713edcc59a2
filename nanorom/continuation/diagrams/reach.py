"""What a range of frequencies holds, before anything is computed.

Frequencies in a wrong unit lie far below all resonances, where nothing happens but a period lasts
as long as millions of those of the modes; motions that relax much faster than anything else moves
make every period as costly. Both are told instead.
"""

from __future__ import annotations

import numpy as np

from nanorom.continuation.orbits.variation import MOST_INTERVALS
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError

QUASI_STATIC = 100.0  # part of the lowest natural frequency below which the film follows the drive
PER_INTERVAL = 2.5  # relaxation times that an interval of the variational equation may last


def within_reach(system: ScaledSystem, omega: tuple[float, float]) -> tuple[float, float]:
    """The part (low, high) of a range in which there may be more than quasi-static motion, all in
    units of the lowest natural frequency.

    Raises ContinuationError if there is none, or for a motion that relaxes too fast.
    """
    least = 1 / QUASI_STATIC
    low, high = omega
    if high <= least:
        raise ContinuationError(
            f"omega: found a range that ends at {high:.3g} of the lowest natural frequency, "
            f"where everything follows the drive; allowed from {least:g} of it on; "
            "is the unit of the range the one that was meant?"
        )
    low = max(low, least)
    longest, fastest = 2 * np.pi / low, system.relaxation
    if longest * fastest > PER_INTERVAL * MOST_INTERVALS:
        raise ContinuationError(
            f"damping: found a motion that relaxes {fastest:.3g} times as fast as the lowest mode "
            f"turns; allowed {PER_INTERVAL * MOST_INTERVALS / longest:.3g} in this range; "
            "leave its coordinate out, or let it follow the others statically"
        )
    return low, high
