"""Where sweeps fall down: a distribution, with what so many sweeps leave open of it.

Source of the intervals: Clopper, Pearson 1934, doi:10.1093/biomet/26.4.404.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.special import betaincinv

from nanorom.continuation.arrays import brief
from nanorom.continuation.ensemble.sweeps import Sweeps
from nanorom.errors import ContinuationError
from nanorom.types import Array

ALIVE = 0.5  # of the largest amplitude of a sweep; below, it has fallen down
LEVEL = 0.95  # of the intervals


@brief
@attrs.frozen(eq=False)
class Falls:
    """Where B sweeps over the same n frequencies have fallen down.

    last (B,): last frequency before the fall, rad per unit of time, of those that never fell the
    last of all; fell (B,): whether it fell; omega (n,); up (n,): share of the sweeps that are up at
    each frequency, a ratio from 0 to 1, low and high (n,): its 95 % interval.
    """

    last: Array
    fell: Array
    omega: Array
    up: Array
    low: Array
    high: Array

    def quantile(self, share: float) -> float:
        """The frequency, rad per unit of time, up to which no more than this share (0 to 1) of the
        sweeps have fallen; infinite where fewer fall at all.
        """
        order = np.sort(np.where(self.fell, self.last, np.inf))
        return float(order[min(int(share * len(order)), len(order) - 1)])


def falls(sweeps: Sweeps, mode: int = 0, alive: float = ALIVE) -> Falls:
    """Where sweeps fall down: where the largest |q| of a mode (from 0) is for the last time above
    the part `alive` of its largest value in the sweep, a ratio from 0 to 1.

    Raises ContinuationError for sweeps over different frequencies, or a mode that is not there.
    """
    omega = sweeps.omega[0]
    if not np.array_equal(sweeps.omega, np.broadcast_to(omega, sweeps.omega.shape)):
        raise ContinuationError("sweeps: found different frequencies; allowed the same of all")
    if not 0 <= mode < sweeps.amplitude.shape[2]:
        raise ContinuationError(f"mode: found {mode}; allowed 0 to {sweeps.amplitude.shape[2] - 1}")
    size = np.nan_to_num(sweeps.amplitude[:, :, mode])
    above = size > alive * size.max(axis=1, keepdims=True)
    last = above.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)
    number = np.arange(len(omega))
    count, total = (last[:, None] >= number).sum(axis=0), len(last)
    tail = (1 - LEVEL) / 2
    low = np.where(count > 0, betaincinv(count, total - count + 1, tail), 0.0)
    high = np.where(count < total, betaincinv(count + 1, total - count, 1 - tail), 1.0)
    return Falls(omega[last], last < number[-1], omega, count / total, low, high)
