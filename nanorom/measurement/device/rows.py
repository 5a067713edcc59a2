"""Which stable stretch each row of a sweep is on.

A sweep may change its stretch at any row, at a price; so one that falls early, or settles where no
other would, is followed all the same (Viterbi 1967, doi:10.1109/TIT.1967.1054010).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nanorom.types import Array

CHANGE = 25.0  # squared deviations that a change of the stretch must save: no outlier does


def assigned(cost: Array) -> NDArray[np.intp]:
    """Stretch of each row (n,), in the order of the sweep, for costs (n, s) of being on each.

    They may be infinite, but not of all stretches at a row.
    """
    n, count = cost.shape
    if count == 1:
        return np.zeros(n, dtype=np.intp)
    total, before = cost[0].copy(), np.zeros((n, count), dtype=np.intp)
    for row in range(1, n):
        best = int(np.argmin(total))
        stay = total <= total[best] + CHANGE
        before[row] = np.where(stay, np.arange(count), best)
        total = np.where(stay, total, total[best] + CHANGE) + cost[row]
    found = np.empty(n, dtype=np.intp)
    found[-1] = int(np.argmin(total))
    for row in range(n - 1, 0, -1):
        found[row - 1] = before[row, found[row]]
    return found
