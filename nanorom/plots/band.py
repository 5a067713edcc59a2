"""Bands of estimated errors along branches: where a model of more modes has the same points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nanorom.continuation import Branch
from nanorom.results.estimates import Estimates
from nanorom.types import Array

OPACITY = 0.25
LEAST = 2  # estimates on a branch between which there is anything to draw


def draw_band(
    axes: Any,
    branch: Branch,
    number: int,
    estimates: Estimates,
    measure: Callable[[Array], Array],
    length: float,
    frequency: float,
    colour: Any,
) -> None:
    """Fill between a branch moved by its estimated error and by as much the other way.

    number: of the branch; length, frequency: factors to the units of the axes.
    """
    own = np.flatnonzero((estimates.branch == number) & np.isfinite(estimates.omega_change))
    if len(own) < LEAST:
        return
    place = np.array([_place(branch, estimates, row) for row in own])
    order = np.argsort(place)
    rows = np.arange(len(branch))
    by_omega, by_amplitude = (
        np.interp(rows, place[order], change[own][order])
        for change in (estimates.omega_change, estimates.amplitude_change)
    )
    omega, amplitude = branch.omega * frequency, measure(branch.amplitude) * length
    sides = [
        np.column_stack([omega * (1 + s * by_omega), amplitude * (1 + s * by_amplitude)])
        for s in (1, -1)
    ]
    outline = np.concatenate([sides[0], sides[1][::-1]])
    axes.fill(*outline.T, color=colour, alpha=OPACITY, linewidth=0, zorder=1)


def _place(branch: Branch, estimates: Estimates, row: int) -> int:
    """The row of a branch next to an estimated point."""
    mode = int(estimates.mode[row])
    size = estimates.amplitude[row]
    higher = branch.amplitude[:, mode] / size - 1 if size else 0.0  # of a film that stays at rest
    return int(np.hypot(branch.omega / estimates.omega[row] - 1, higher).argmin())
