"""What a lock-in amplifier makes of a motion: amplitude and phase of a harmonic, in time.

The signal times exp(-i k phi), phi the angle of the reference, is averaged over some periods with a
Hann window, whose zeros lie on the other harmonics of the reference.
"""

from __future__ import annotations

import numpy as np

from nanorom.types import Array, Numbers

PER_PERIOD = 32  # samples
LEAST_PERIODS = 4  # of a window: with fewer, neighbouring harmonics leak into each other


def demodulate(signal: Array, angle: Array, harmonic: int, periods: int) -> Numbers:
    """Complex amplitudes (m, ...) of q = Re z exp(i k phi) from equidistant samples (n, ...).

    angle (n,): phi at the samples, rad, PER_PERIOD or so per turn. The first and last windows are
    cut off: entry i is at sample i + periods * PER_PERIOD // 2.
    """
    from scipy.signal import fftconvolve  # takes .3 s to import

    width = periods * PER_PERIOD
    window = 1 - np.cos(2 * np.pi * np.arange(1, width) / width)
    window /= window.sum()
    columns = (slice(None),) + (None,) * (signal.ndim - 1)
    mixed = signal * np.exp(-1j * harmonic * angle)[columns]
    double = 1.0 if harmonic == 0 else 2.0
    return np.asarray(double * fftconvolve(mixed, window[columns], mode="valid", axes=0))


def centres(count: int, periods: int) -> slice:
    """Of `count` samples, those that the entries of `demodulate` belong to."""
    half = periods * PER_PERIOD // 2 - 1
    return slice(half, count - half)


def passed(offset: Array, spacing: float, periods: int) -> Array:
    """By what factor a signal off the reference by angular frequencies `offset` (n,) is smaller
    behind the window; `spacing` of the samples in time.
    """
    width = periods * PER_PERIOD
    turn = np.arange(1, width) - width / 2
    window = 1 - np.cos(2 * np.pi * np.arange(1, width) / width)
    return np.asarray(np.cos(np.multiply.outer(offset * spacing, turn)) @ (window / window.sum()))
