"""Measured sweeps, the device that fits them, and what is left."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import viridis
from matplotlib.figure import Figure

from nanorom.plots.data import MARKERS
from nanorom.plots.peaks import BRIGHTEST
from nanorom.plots.style import COLUMN, save, scaled, styled
from nanorom.types import Array

if TYPE_CHECKING:  # what draws a response loads no fit
    from nanorom.measurement.device.identify import Fitted, SweepIdentification


@styled
def device_figure(found: SweepIdentification, path: str | Path | None = None) -> Figure:
    """Draw the sweeps of every range with their fit, and what is left of the amplitudes below."""
    places = sorted({part.place for part in found.parts})
    figure = Figure(
        figsize=(COLUMN * max(1.0, 0.75 * len(places)), 0.95 * COLUMN), layout="constrained"
    )
    panels = figure.subplots(2, len(places), sharex="col", height_ratios=(3, 1), squeeze=False)
    levels = list(dict.fromkeys(part.trace.level for part in found.parts))
    colours = dict(zip(levels, viridis(np.linspace(0, BRIGHTEST, len(levels)))))
    hertz, unit = scaled(found.frequency, "Hz")
    largest = np.array([max(float(part.trace.amplitude.max()) for part in found.parts)])
    meters = found.unit_of_amplitude == "m"
    length, name = scaled(largest, "m") if meters else (1.0, found.unit_of_amplitude)
    for column, place in enumerate(places):
        upper, lower = panels[:, column]
        for part in found.parts:
            if part.place == place:
                _draw(upper, lower, part, (hertz, length), colours[part.trace.level])
        lower.axhline(0, color="0.6", linewidth=0.6)
        lower.set_xlabel(f"drive frequency ({unit})")
    panels[0, 0].set_ylabel(f"amplitude ({name})")
    panels[1, 0].set_ylabel("left")
    panels[0, 0].legend()
    if path is not None:
        save(figure, path)
    return figure


def _draw(
    upper: Any, lower: Any, part: Fitted, factors: tuple[float, float], colour: Array
) -> None:
    trace, (hertz, length) = part.trace, factors
    label = " ".join(filter(None, (trace.level, trace.direction)))
    style = {"linestyle": "none", "markersize": 2.2, "markeredgewidth": 0, "color": colour}
    marker, place = MARKERS[trace.direction], hertz * trace.frequency
    upper.plot(place, length * trace.amplitude, marker=marker, label=label, **style)
    upper.plot(place, length * part.fitted, color=colour, linewidth=0.8)
    lower.plot(place, length * (trace.amplitude - part.fitted), marker=marker, **style)
