"""Measured responses over a model's."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from matplotlib.cm import autumn
from matplotlib.lines import Line2D

from nanorom.errors import FileError, ScaleWarning
from nanorom.measurement.data import MeasuredResponse

MARKERS = {"up": "^", "down": "v", "": "o"}
BRIGHTEST = 0.6  # of the colour map
MARGIN = 1.08  # of the largest value: top of an axis


def draw_measured(
    axes: Any,
    measured: MeasuredResponse,
    length: tuple[float, str],
    frequency: tuple[float, str],
) -> list[Line2D]:
    """Points over a drawn response; returns what stands for them in a legend.

    length, frequency: factor and unit of the axes, the frequency's from rad/s.  Amplitudes that
    are no lengths get an axis on the right, where their largest is as high as the model's, and
    a ScaleWarning tells by which factor; decibels are turned into amplitudes.  Raises FileError
    if they have no unit or all are outside of the axes.
    """
    if not measured.unit:
        raise FileError(
            "measured data: amplitude: found no unit; name the column 'amplitude (nm)', "
            "'amplitude (mV)' or 'amplitude (a.u.)'"
        )
    low, high = axes.get_xlim()
    places = [2 * np.pi * frequency[0] * trace.frequency for trace in measured.traces]
    shown = [(low <= x) & (x <= high) for x in places]
    if not any(own.any() for own in shown):
        raise FileError(
            f"measured data: none of the frequencies is between {low:.6g} and {high:.6g} "
            f"{frequency[1]}, the range of the response"
        )
    measured = measured.linear()
    heights, unit = [trace.amplitude for trace in measured.traces], measured.unit
    if unit == "m":
        heights = [length[0] * y for y in heights]
    largest = max(float(y[own].max()) for y, own in zip(heights, shown) if own.any())
    panel = _scaled(axes, largest) if unit == "m" else _own_axis(axes, largest, unit, length[1])
    levels = list(dict.fromkeys(trace.level for trace in measured.traces))
    colours = dict(zip(levels, autumn(np.linspace(0, BRIGHTEST, len(levels)))))
    handles = []
    for trace, x, y in zip(measured.traces, places, heights):
        style = {
            "linestyle": "none",
            "marker": MARKERS[trace.direction],
            "markersize": 2.2,
            "markeredgewidth": 0,
            "color": colours[trace.level],
            "label": " ".join(part for part in ("data", trace.level, trace.direction) if part),
        }
        panel.plot(x, y, zorder=2.5, **style)
        handles.append(Line2D([], [], **style))
    return handles


def _scaled(axes: Any, largest: float) -> Any:
    """The model's axes, made higher if they have to be."""
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom, max(top, MARGIN * largest))
    return axes


def _own_axis(axes: Any, largest: float, unit: str, length: str) -> Any:
    """An axis on the right; its zero and its largest value are as high as the model's."""
    panel = axes.twinx()
    label = f"measured ({unit})"
    if largest > 0:
        bottom, top = axes.get_ylim()
        panel.set_ylim(MARGIN * largest * bottom / top, MARGIN * largest)
        factor = f"1 {unit.split(',')[0]} as {top / (MARGIN * largest):.3g} {length}"
        label += f", drawn with {factor}"
        warnings.warn(
            f"measured data: their scale is not known; drawn with {factor}, which makes their "
            "largest amplitude that of the model: heights agree by that alone",
            ScaleWarning,
            stacklevel=2,
        )
    panel.set_ylabel(label)
    panel.grid(False)
    panel.tick_params(length=2.5)
    panel.spines["top"].set_visible(False)
    return panel
