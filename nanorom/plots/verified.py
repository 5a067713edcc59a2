"""Orbits of a model beside those of its film: amplitudes with their error bars, and the errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import viridis
from matplotlib.figure import Figure

from nanorom.plots.style import COLUMN, save, scaled, styled
from nanorom.results.verified import Verified

BRIGHTEST = 0.85  # of the colour map: the yellow end is too pale for lines
LEAST = 1e-9  # error below which a logarithmic axis shows none
BAND = 0.25  # opacity
WIDEST = 0.5  # of an amplitude: half the width of a band; beyond that an estimate is none


@styled
def verified_figure(verified: Verified, path: str | Path | None = None) -> Figure:
    """Draw amplitudes above, errors below (and write the picture).

    Above the largest modal amplitude against the drive frequency: lines with a band, the model and
    its estimated error; rings, the film.  Below the relative error of that amplitude: lines with
    points as estimated, rings the true one.  One colour per drive level.
    """
    figure = Figure(figsize=(COLUMN, 1.2 * COLUMN), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    frequency, frequency_unit = scaled(verified.omega / (2 * np.pi), "Hz")
    length, length_unit = scaled(verified.modal.max(axis=1, initial=0.0), "m")
    levels = np.unique(verified.level)
    for place, level in enumerate(levels):
        colour = viridis(BRIGHTEST * place / max(len(levels) - 1, 1))
        own = np.flatnonzero(verified.level == level)
        for branch in np.unique(verified.branch[own]):
            rows = own[verified.branch[own] == branch]
            _branch(above, below, verified, rows, colour, frequency / (2 * np.pi), length)
    above.set_ylabel(f"largest amplitude ({length_unit})")
    below.set_ylabel("relative error")
    below.set_yscale("log")
    below.set_xlabel(f"drive frequency ({frequency_unit})")
    above.plot([], [], ".-", color="0.4", ms=3, label="model, with its estimated error")
    if np.isfinite(verified.full).any():
        above.plot([], [], "o", color="0.4", mfc="none", ms=4, label="film")
    above.legend()
    if path is not None:
        save(figure, path)
    return figure


def _branch(
    above: Axes,
    below: Axes,
    verified: Verified,
    rows: np.ndarray,
    colour: tuple[float, ...],
    frequency: float,
    length: float,
) -> None:
    """Rows of one branch, in the order of the table."""
    mode = verified.largest[rows]
    x, y = frequency * verified.omega[rows], length * verified.modal[rows, mode]
    plain = np.array([verified.type[row] == "-" for row in rows])
    half = y * np.clip(np.nan_to_num(verified.estimate[rows], nan=WIDEST), 0.0, WIDEST)
    above.plot(x[plain], y[plain], ".-", color=colour, ms=3, lw=0.8)
    above.plot(x[~plain], y[~plain], ".", color=colour, ms=3)
    above.errorbar(x, y, half, fmt="none", ecolor=colour, elinewidth=2.5, alpha=BAND)
    x_full = frequency * verified.omega_full[rows]
    y_full = length * verified.full[rows, mode]
    above.plot(x_full, y_full, "o", color=colour, mfc="none", ms=4, mew=0.7)
    estimate = np.maximum(verified.estimate[rows], LEAST)
    below.plot(x[plain], estimate[plain], ".-", color=colour, ms=3, lw=0.8)
    below.plot(x[~plain], estimate[~plain], ".", color=colour, ms=3)
    error = np.maximum(np.abs(verified.error[rows]), LEAST)
    below.plot(x, error, "o", color=colour, mfc="none", ms=4, mew=0.7)
