"""Which computed mode a measured resonance is.

A computed mode below the highest measured one is taken to be seen as often as not, which makes an
assignment half as likely for every mode that it leaves out: 2 ln 2 in units of chi^2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

UNSEEN = 2 * np.log(2)


def assign(
    measured: ArrayLike,
    label: Sequence[str],
    computed: ArrayLike,
    names: Sequence[str],
    noise: ArrayLike,
) -> NDArray[np.intp]:
    """Which computed resonance belongs to each measured one.

    measured (n,) and computed (m,) rise, in logarithms; noise (n,) or one number: their standard
    deviation.  Those with a label go to their namesake, the others in order, each to one of its
    own, for the smallest chi^2, to which a computed mode left out between adds `UNSEEN`.
    """
    measured, computed = np.asarray(measured, float), np.asarray(computed, float)
    index = np.full(len(measured), -1, dtype=np.intp)
    for n, name in enumerate(label):
        if name:
            index[n] = list(names).index(name)
    rest = np.flatnonzero(index < 0)
    if len(rest) == 0:
        return index
    free = np.delete(np.arange(len(computed)), index[index >= 0])
    deviation = np.broadcast_to(noise, measured.shape)[rest, None]
    cost = ((measured[rest, None] - computed[None, free]) / deviation) ** 2
    before = np.zeros(cost.shape, dtype=np.intp)  # where the measured one before goes
    cost[0] += UNSEEN * np.arange(len(free))
    skipped = UNSEEN * np.subtract.outer(np.arange(len(free)), np.arange(len(free)) + 1)
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
