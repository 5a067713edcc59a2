"""Names beside the peaks of a plot, spread so that they do not cover each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

NAMES_APART = 0.042  # of the axis
NAMES_HEIGHT = 22  # points above the axis that rotated names need


def name_lines(axes: Any, places: Sequence[float] | np.ndarray, names: Sequence[str]) -> None:
    """Draw thin lines at rising places of the x axis, their names upright above the axes.

    What lies outside the limits of the axis is left out.
    """
    low, high = axes.get_xlim()
    shown = [(place, name) for place, name in zip(places, names) if low <= place <= high]
    if not shown:
        return
    places, names = zip(*shown)
    where = spread(np.array(places), NAMES_APART * (high - low))
    style = {"rotation": 90, "ha": "center", "va": "bottom", "fontsize": 6}
    for line, place, name in zip(places, where, names):
        axes.axvline(line, color="0.75", linewidth=0.5, zorder=0)
        axes.text(place, 1.02, name, transform=axes.get_xaxis_transform(), **style)


def spread(places: np.ndarray, apart: float) -> np.ndarray:
    """Rising places moved as little as needed to be ``apart`` from each other."""
    places = places.astype(float).copy()
    clusters = [[x] for x in places]
    centres = list(places)
    merged = True
    while merged:
        merged = False
        for i in range(len(centres) - 1):
            reach = 0.5 * apart * (len(clusters[i]) + len(clusters[i + 1]))
            if centres[i + 1] - centres[i] < reach - 1e-12:
                clusters[i] += clusters.pop(i + 1)
                centres[i] = float(np.mean(clusters[i]))
                centres.pop(i + 1)
                merged = True
                break
    return np.concatenate(
        [
            centre + apart * (np.arange(len(members)) - 0.5 * (len(members) - 1))
            for centre, members in zip(centres, clusters)
        ]
    )
