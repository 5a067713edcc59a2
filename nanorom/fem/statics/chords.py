"""Where curves that are drawn by straight lines need more points."""

from __future__ import annotations

import numpy as np


def chord_errors(x: np.ndarray, curves: np.ndarray) -> np.ndarray:
    """How far the lines between points of curves leave them, as shares of a picture.

    x : (n,), curves : (n, K), NaN where there is none.  Of n - 1 lines the largest error among the
    curves: the height of an arc above its chord, which turns as the chords do at the chord's ends.
    """
    steps = [np.diff(values, axis=0) / _range(values) for values in (x[:, None], curves)]
    along = steps[0] + 1j * steps[1]  # (n - 1, K) chords in a square picture
    turns = np.abs(np.angle(along[1:] * along[:-1].conj()))
    turns = np.pad(np.nan_to_num(turns), ((1, 1), (0, 0)))
    heights = np.nan_to_num(np.abs(along)) * np.maximum(turns[1:], turns[:-1]) / 8
    return np.asarray(heights.max(axis=1))


def _range(values: np.ndarray) -> np.ndarray:
    """Largest minus smallest of each column, 1 where that is nothing."""
    seen = np.nanmax(values, axis=0) - np.nanmin(values, axis=0)
    return np.where(seen > 0, seen, 1.0)
