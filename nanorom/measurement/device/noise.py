"""Noise of amplitudes and of phases: a constant and a share of the amplitude, whatever outliers."""

from __future__ import annotations

import numpy as np

from nanorom.measurement.sweeps.fit import GAUSSIAN, variance
from nanorom.types import Array

CLIPPED, ROUNDS = 2.5, 8  # deviations beyond which a difference counts no more
KEPT = 0.9776  # of the variance of a normal distribution that is so clipped


def noise_of(sizes: Array, misses: Array) -> tuple[float, float]:
    """Floor and share of the noise at sizes (n,), from absolute differences (n,)."""
    largest = float(sizes.max())
    sizes, misses = sizes / largest, misses / largest
    most = CLIPPED * GAUSSIAN * float(np.median(misses / (sizes + 1))) * (sizes + 1)
    for _ in range(ROUNDS):
        floor, share = variance(sizes, np.minimum(misses, most))
        floor, share = floor / KEPT, share / KEPT
        most = CLIPPED * np.sqrt(floor + share * sizes**2)
    return largest * float(np.sqrt(floor)), float(np.sqrt(share))
