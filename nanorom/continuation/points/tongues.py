"""Tongues of instability as narrow as the damping: where multipliers meet on the unit circle.

Where multipliers of a motion that is hardly damped meet, at -1 for a drive near 2 w_r / n, in pairs
near (w_r +- w_s) / n, they may leave the circle within a range of relative width 1/Q: no sampling
finds that. But the test function is a parabola around the meeting, positive outside the tongue and
with its minimum inside, and that minimum a search finds in a few steps, however narrow the tongue.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.types import Array

ITERATIONS = 12
LEAST_DIP = 1.0  # log of a dip between samples that may hide a tongue
RESOLVED = 0.1  # of the half width of a parabola: nothing is hidden in it
MOST_TONGUES = 400  # of one path

Value = Callable[[float], tuple[float, float]]  # sign and log modulus at a position


def dips(signs: Array, logs: Array) -> list[int]:
    """Samples at which a test function of one sign is less than at both neighbours, deepest
    first.
    """
    inner = np.arange(1, len(logs) - 1)
    less = (logs[inner] < logs[inner - 1]) & (logs[inner] <= logs[inner + 1])
    # its own sign may be that of the error of an interpolation
    same = signs[inner - 1] == signs[inner + 1]
    # below one neighbour only where the bottom is half way to the other
    depth = np.maximum(logs[inner - 1], logs[inner + 1]) - logs[inner]
    found = inner[less & same & (depth > LEAST_DIP)]
    return [int(i) for i in found[np.argsort(logs[found], kind="stable")][:MOST_TONGUES]]


def bottom(value: Value, places: Array) -> float | None:
    """A place between three (rising) at which the test function has the other sign; None where its
    minimum shows that there is none.
    """
    known = [(float(s), *value(float(s))) for s in places]
    outside, reference = known[0][1], max(log for _, _, log in known)
    points = [(s, outside * sign * np.exp(log - reference)) for s, sign, log in known]
    if any(f <= 0 for _, f in points):
        return next(s for s, f in points if f <= 0)
    low, high = points[0][0], points[2][0]
    for _ in range(ITERATIONS):
        (a, fa), (b, fb), (c, fc) = points
        left, right = (fb - fa) / (b - a), (fc - fb) / (c - b)
        bend = (right - left) / (c - a)
        if not bend > 0:
            return None
        vertex = 0.5 * (a + b - left / bend)
        if not low < vertex < high:
            return None
        sign, log = value(vertex)
        least = outside * sign * float(np.exp(log - reference))
        if least <= 0:
            return vertex
        nearest = min(abs(vertex - s) for s, _ in points)
        if nearest < RESOLVED * np.sqrt(least / bend):
            return None
        points = sorted([*points, (vertex, least)])
        # the three around the least one
        place = int(np.clip(np.argmin([f for _, f in points]), 1, len(points) - 2))
        points = points[place - 1 : place + 2]
    return None
