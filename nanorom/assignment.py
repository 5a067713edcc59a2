"""Which computed mode a measured resonance is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

UNSEEN = 0.01  # relative difference that leaving out a computed mode is worth


def assign(
    measured: ArrayLike, label: Sequence[str], computed: ArrayLike, names: Sequence[str]
) -> NDArray[np.intp]:
    """Which computed resonance belongs to each measured one.

    measured (n,) and computed (m,) rise, in logarithms; those with a label go to their namesake,
    the others in order, each to one of its own, for the least squared difference, where a computed
    mode left out between costs as much as a difference of `UNSEEN`.
    """
    measured, computed = np.asarray(measured, float), np.asarray(computed, float)
    index = np.full(len(measured), -1, dtype=np.intp)
    for n, name in enumerate(label):
        if name:
            index[n] = list(names).index(name)
    rest = np.flatnonzero(index < 0)
    free = np.setdiff1d(np.arange(len(computed)), index)
    if len(rest) == 0:
        return index
    cost = (measured[rest, None] - computed[None, free]) ** 2
    before = np.zeros(cost.shape, dtype=np.intp)  # where the measured one before goes
    cost[0] += UNSEEN**2 * np.arange(len(free))
    skipped = UNSEEN**2 * np.subtract.outer(np.arange(len(free)), np.arange(len(free)) + 1)
    skipped[skipped < 0] = np.inf
    for n in range(1, len(rest)):
        total = cost[n - 1] + skipped
        before[n] = total.argmin(axis=1)
        cost[n] += total.min(axis=1)
    k = int(cost[-1].argmin())
    for n in range(len(rest) - 1, -1, -1):
        index[rest[n]] = free[k]
        k = before[n, k]
    return index
