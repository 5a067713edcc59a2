"""A measured peak, what fits it, and what is left."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import viridis
from matplotlib.figure import Figure

from nanorom.plots.data import MARKERS
from nanorom.plots.style import COLUMN, save, scaled, styled

if TYPE_CHECKING:  # what draws a response loads no fit
    from nanorom.measurement.sweeps.peaks import Peak

BRIGHTEST = 0.85  # of the colour map: the yellow end is too pale for lines


@styled
def peaks_figure(peak: Peak, path: str | Path | None = None) -> Figure:
    """Draw the sweeps of a peak with their fit, and what is left of the amplitudes below."""
    figure = Figure(figsize=(COLUMN, 0.95 * COLUMN), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    hertz, unit = scaled(np.array([peak.frequency.value]), "Hz")
    length, name = scaled(peak.traces[0].amplitude, "m") if peak.unit == "m" else (1.0, peak.unit)
    levels = list(peak.force)
    colours = dict(zip(levels, viridis(np.linspace(0, BRIGHTEST, len(levels)))))
    for trace, fitted in zip(peak.traces, peak.fitted):
        place, colour = hertz * trace.frequency, colours[trace.level]
        label = " ".join(filter(None, (trace.level, trace.direction)))
        style = {"linestyle": "none", "markersize": 2.2, "markeredgewidth": 0, "color": colour}
        marker = MARKERS[trace.direction]
        upper.plot(place, length * trace.amplitude, marker=marker, label=label, **style)
        upper.plot(place, length * fitted, color=colour, linewidth=0.8)
        lower.plot(place, length * (trace.amplitude - fitted), marker=marker, **style)
    lower.axhline(0, color="0.6", linewidth=0.6)
    upper.set_ylabel(f"amplitude ({name})")
    lower.set_ylabel("left")
    lower.set_xlabel(f"drive frequency ({unit})")
    upper.legend()
    if path is not None:
        save(figure, path)
    return figure
