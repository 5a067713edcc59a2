"""Deflection and frequencies against a static load."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from nanorom.plots.style import COLUMN, axis_unit, save, scaled, styled
from nanorom.results.loadcurve import UNITS, LoadCurve
from nanorom.types import Array

SAME = 1e-4  # relative: no eye tells such curves apart
MOST_NAMED = 6  # modes; more of them have no legend


@styled
def load_curve(curve: LoadCurve, path: str | Path | None = None) -> Figure:
    """Draw deflection, frequencies and effective cubic coefficients (and write the picture).

    Unstable states are dashed; vertical lines mark limit points, of a gate the pull-in.
    """
    rows = 2 if curve.cubic is None else 3
    figure = Figure(figsize=(COLUMN, 0.55 * rows * COLUMN), layout="constrained")
    panels = figure.subplots(rows, 1, sharex=True)
    above, below = panels[:2]
    load, load_unit = scaled(curve.load, UNITS[curve.quantity])
    at_centre = bool(np.isfinite(curve.centre).all())
    height = curve.centre if at_centre else curve.largest
    deflection, deflection_unit = scaled(height, "m")
    frequency, frequency_unit = scaled(curve.frequency[curve.stable], "Hz")
    x, y = curve.load * load, height * deflection
    above.plot(x, y, "--", color="0.6", lw=0.8)
    above.plot(x, np.where(curve.stable, y, np.nan), ".-", ms=3)
    where = "centre" if at_centre else "largest"
    above.set_ylabel(f"deflection, {where} ({deflection_unit})")
    _draw_modes(below, x, curve.names, curve.frequency * frequency)
    below.set_ylabel(f"frequency ({frequency_unit})")
    if curve.cubic is not None:
        factor, unit = axis_unit(curve.cubic, "N/m^3")
        _draw_modes(panels[2], x, curve.names, curve.cubic * factor)
        panels[2].axhline(0.0, color="0.6", lw=0.7)
        panels[2].set_ylabel(f"cubic coefficient ({unit})")
    panels[-1].set_xlabel(f"{curve.quantity} ({load_unit})")
    below.xaxis.set_major_locator(MaxNLocator(6))
    what = "pull-in" if curve.quantity == "voltage" else "limit point"
    for number, limit in enumerate(curve.limits):
        for axes in panels:
            label = what if number == 0 and axes is above else None
            axes.axvline(limit * load, color="0.3", lw=0.7, ls=":", label=label)
    if len(curve.limits):
        above.legend()
    if curve.frequency.shape[1] <= MOST_NAMED:
        below.legend()
    if path is not None:
        save(figure, path)
    return figure


def _draw_modes(axes: Axes, x: Array, names: Sequence[str], values: Array) -> None:
    """A curve for each mode, (loads, L); dashed over one that is the same, as of an exact pair."""
    for place, (name, column) in enumerate(zip(names, values.T)):
        same = (np.allclose(column, other, SAME, 0.0, equal_nan=True) for other in values.T[:place])
        axes.plot(x, column, ".--" if any(same) else ".-", ms=3, label=name)
