"""Functions of the drive frequency, sampled where they need to be: Chebyshev series on intervals.

Source: Trefethen, Approximation Theory and Approximation Practice, SIAM 2013, chapters 3 and 4.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable

import numpy as np

from nanorom.types import Numbers

NODES = 9  # per interval
TOLERANCE = 1e-7  # of the largest value: last coefficients of a series that is resolved
HALVINGS = 12  # of the whole interval: a resonance of Q below 1e5 is resolved


class Piecewise:
    """A function of one variable with values in complex arrays, on [low, high]; intervals are
    resolved when they are first needed, and where they are not, halved.
    """

    def __init__(self, function: Callable[[float], Numbers], limits: tuple[float, float]) -> None:
        self._function = function
        self._edges = [limits[0]]
        self._high = limits[1]
        self._series: list[Numbers | None] = [None]
        self._least = (limits[1] - limits[0]) / 2**HALVINGS
        angles = np.pi * (np.arange(NODES) + 0.5) / NODES
        self._nodes = np.cos(angles)
        weights = np.full((NODES, 1), 2.0 / NODES)
        weights[0] = 1.0 / NODES
        self._analysis = weights * np.cos(np.arange(NODES)[:, None] * angles)

    def _resolved(self, x: float) -> tuple[Numbers, float, float]:
        """The series of the interval that holds x, its middle and half its width."""
        x = min(max(x, self._edges[0]), self._high)
        while True:
            place = bisect_right(self._edges, x) - 1
            low = self._edges[place]
            high = (*self._edges, self._high)[place + 1]
            middle, half = (low + high) / 2, (high - low) / 2
            series = self._series[place]
            if series is not None:
                return series, middle, half
            values = np.array([self._function(middle + half * node) for node in self._nodes])
            terms = np.tensordot(self._analysis, values, axes=1)
            last = np.abs(terms[-2:]).max(initial=0.0)
            if last <= TOLERANCE * np.abs(values).max(initial=0.0) or half <= self._least:
                self._series[place] = terms
            else:
                self._edges.insert(place + 1, middle)
                self._series.insert(place + 1, None)

    def __call__(self, x: float) -> tuple[Numbers, Numbers]:
        """Value and derivative at x."""
        series, middle, half = self._resolved(x)
        t = (x - middle) / half
        first = [1.0, t]
        slope = [0.0, 1.0]
        for _ in range(2, NODES):
            slope.append(2 * first[-1] + 2 * t * slope[-1] - slope[-2])
            first.append(2 * t * first[-1] - first[-2])
        value = np.tensordot(np.array(first), series, axes=1)
        return value, np.tensordot(np.array(slope), series, axes=1) / half
