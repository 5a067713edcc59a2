"""Frequency responses: one curve per drive level, stability, special points, mode by mode."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import viridis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import blended_transform_factory
from numpy.typing import NDArray

from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.measurement.data import MeasuredResponse
from nanorom.plots.band import draw_band
from nanorom.plots.curves import (
    NEUTRAL,
    TAKES_PART,
    UNEXPLORED,
    line_style,
    marker_style,
    stretches,
)
from nanorom.plots.data import draw_measured
from nanorom.plots.names import NAMES_HEIGHT, name_lines
from nanorom.plots.style import (
    COLUMN,
    save,
    scaled,
    styled,
)
from nanorom.results.cut import cut_peaks
from nanorom.results.response import Response
from nanorom.types import Array

# folds and their like are seen without a mark
MOTION_CHANGES = tuple(code for code, kind in KINDS.items() if kind.changes_motion)

Measure = Callable[[Array], Array]  # amplitudes (..., L) of all modes to the plotted one

SHIFT = 0.3  # of the largest amplitude, between levels that are drawn apart
BRIGHTEST = 0.85  # of the colour map: the yellow end is too pale for lines


@styled
def response_figure(
    response: Response,
    path: str | Path | None = None,
    measured: MeasuredResponse | None = None,
) -> Figure:
    """Draw total amplitude against drive frequency, (and write the picture).

    The total |q| is sqrt(sum_r max|q_r|^2): the modal amplitude where one mode dominates.
    A measured response is drawn over it: to scale if its amplitude is a length, else on an axis
    of its own.  Where errors are estimated, a band shows them.  Raises FileError if none of it is
    in the swept range.
    """
    figure = Figure(figsize=(COLUMN, 0.82 * COLUMN), layout="constrained")
    axes = figure.add_subplot()
    length, frequency = _length_unit(response, _total), frequency_unit(response)
    _draw(axes, response, _total, length, frequency)
    modes = _take_part(response)
    whose = "|q| of all modes" if len(modes) > 1 else f"of {response.label[modes[0]]}"
    axes.set_ylabel(f"amplitude {whose} ({length[1]})")
    axes.set_xlabel(f"drive frequency ({frequency[1]})")
    handles = [] if measured is None else draw_measured(axes, measured, length, frequency)
    legend(axes, response, more=handles)
    if path is not None:
        save(figure, path)
    return figure


@styled
def comparison_figure(
    responses: Mapping[str, Response],
    levels: Sequence[str],
    resonances: Mapping[str, Mapping[str, float]],
    path: str | Path | None = None,
) -> Figure:
    """Draw several responses below each other, level above level, (and write the picture).

    Drive frequencies are in multiples of the lowest natural frequency of each; levels: their
    names, the same for all responses; resonances: names and places of lines, by title; every level
    is shifted up by `SHIFT` of the largest amplitude.  Folds are not marked.
    """
    figure = Figure(figsize=(COLUMN, 0.3 + 0.82 * COLUMN * len(responses)), layout="constrained")
    panels = figure.subplots(len(responses), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (title, response) in zip(panels, responses.items()):
        length = _length_unit(response, _total)
        frequency = 1 / (2 * np.pi * float(response.frequency[0])), ""
        shift = SHIFT * length[0] * _largest(response, _total)
        _draw(axes, response, _total, length, frequency, MOTION_CHANGES, shift)
        axes.set_ylabel(f"amplitude |q| ({length[1]})")
        note = f"levels shifted by {shift:.2g} {length[1]}"
        axes.set_title(f"{title}; {note}", pad=1.25 * NAMES_HEIGHT)
        places = dict(sorted(resonances[title].items(), key=lambda entry: entry[1]))
        name_lines(axes, list(places.values()), list(places))
        axes.label_outer()
    panels[-1].set_xlabel("drive frequency / f01")
    legend(panels[0], response, MOTION_CHANGES, levels, 0.24)
    if path is not None:
        save(figure, path)
    return figure


@styled
def amplitude_panels(response: Response, path: str | Path | None = None) -> Figure:
    """Draw max |q_r| against drive frequency, a panel per mode that takes part."""
    modes = _take_part(response)
    frequency = frequency_unit(response)
    height = 0.62 * len(modes) + 0.9
    figure = Figure(figsize=(COLUMN, height), layout="constrained")
    panels = figure.subplots(len(modes), 1, sharex=True, squeeze=False)[:, 0]
    for axes, mode in zip(panels, modes):
        measure = _mode(int(mode))
        length = _length_unit(response, measure)
        _draw(axes, response, measure, length, frequency)
        axes.set_ylabel(f"{response.label[mode]}\n({length[1]})", linespacing=1.2)
        axes.locator_params(axis="y", nbins=3)
    figure.align_ylabels(panels)
    panels[-1].set_xlabel(f"drive frequency ({frequency[1]})")
    legend(panels[0], response)
    if path is not None:
        save(figure, path)
    return figure


def _total(amplitude: Array) -> Array:
    return np.asarray(np.linalg.norm(amplitude, axis=-1))


def _take_part(response: Response) -> NDArray[np.intp]:
    """Indices of the modes whose amplitude shows beside the largest one."""
    largest = _largest(response, lambda amplitude: amplitude)
    return np.flatnonzero(largest >= TAKES_PART * largest.max())


def _mode(number: int) -> Measure:
    return lambda amplitude: amplitude[..., number]


def _largest(response: Response, measure: Measure) -> Any:
    """The largest value(s) of a measure within the swept range, over all levels and branches."""
    start, stop = (2 * np.pi * f for f in response.sweep.hertz(float(response.frequency[0])))
    shown = [
        branch.amplitude[(branch.omega >= start) & (branch.omega <= stop)]
        for diagram in response.diagrams
        for branch in diagram.branches
    ]
    return np.max(measure(np.concatenate(shown)), axis=0)


def _length_unit(response: Response, measure: Measure) -> tuple[float, str]:
    return scaled(_largest(response, measure), "m")


def frequency_unit(response: Response) -> tuple[float, str]:
    factor, unit = scaled(max(response.sweep.hertz(float(response.frequency[0]))), "Hz")
    return factor / (2 * np.pi), unit


def _draw(
    axes: Any,
    response: Response,
    measure: Measure,
    length: tuple[float, str],
    frequency: tuple[float, str],
    kinds: Collection[str] = KINDS,
    shift: float = 0.0,
) -> None:
    """Draw every level, the higher ones moved up by ``shift`` each."""
    levels = list(zip(colours(response), response.diagrams))
    start, stop = (2 * np.pi * f for f in response.sweep.hertz(float(response.frequency[0])))
    # low levels lie within high ones: draw them on top
    for place, (colour, diagram) in reversed([*enumerate(levels)]):
        for number, branch in enumerate(diagram.branches):
            located = [point for point in diagram.special_points if point.branch == number]
            for curve in stretches(branch, located):
                axes.plot(
                    curve.omega * frequency[0],
                    measure(curve.amplitude) * length[0] + place * shift,
                    color=colour,
                    **line_style(curve.stable),
                )
            if response.estimates and not shift:
                own, factors = response.estimates[place], (length[0], frequency[0])
                draw_band(axes, branch, number, own, measure, *factors, colour)
        marks = [(p.omega, p.amplitude, p.type) for p in diagram.special_points if p.type in kinds]
        marks += [
            (left.omega, np.zeros_like(response.frequency), "") for left in diagram.unexplored
        ]
        for omega, amplitude, kind in marks:
            if start <= omega <= stop:  # whole, also those on the edge
                height = measure(amplitude) * length[0] + place * shift * bool(kind)
                style = marker_style(kind) if kind else UNEXPLORED
                axes.plot(
                    omega * frequency[0], height, color=colour, zorder=3, clip_on=False, **style
                )
    for cut in cut_peaks(response):
        height = measure(cut.amplitude) * length[0] + cut.level * shift
        style = {"marker": 5 if cut.omega > (start + stop) / 2 else 4, "markersize": 3.5}
        axes.plot(
            cut.omega * frequency[0], height, color=levels[cut.level][0], clip_on=False, **style
        )
    axes.set_xlim(start * frequency[0], stop * frequency[0])
    top = length[0] * _largest(response, measure) or 1.0  # nothing moves
    axes.set_ylim(-0.04 * top, 1.08 * top + (len(levels) - 1) * shift)
    axes.tick_params(length=2.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def colours(response: Response) -> Any:
    """Of the levels, (n, 4)."""
    count = len(response.diagrams)
    return viridis(np.linspace(0, BRIGHTEST, count) if count > 1 else [0.3])


def legend(
    axes: Any,
    response: Response,
    kinds: Collection[str] = KINDS,
    names: Sequence[str] = (),
    pad: float = 0.0,
    more: Sequence[Line2D] = (),
) -> None:
    """One legend above the axes: levels, line styles, and the special points that occur."""
    handles = [
        Line2D([], [], color=colour, label=name)
        for colour, name in zip(colours(response), names or response.drive.names)
    ]
    if any(not np.all(b.stable) for d in response.diagrams for b in d.branches):
        handles.append(Line2D([], [], color=NEUTRAL, label="stable"))
        handles.append(Line2D([], [], **line_style(False), color=NEUTRAL, label="unstable"))
    start, stop = (2 * np.pi * f for f in response.sweep.hertz(float(response.frequency[0])))
    found = {
        point.type
        for diagram in response.diagrams
        for point in diagram.special_points
        if start <= point.omega <= stop
    }
    for kind in KINDS:
        if kind in found and kind in kinds:
            style = {**marker_style(kind), "color": NEUTRAL, "linestyle": "none"}
            handles.append(Line2D([], [], **style, label=KINDS[kind].name))
    if any(start <= u.omega <= stop for d in response.diagrams for u in d.unexplored):
        handles.append(Line2D([], [], color=NEUTRAL, label="not explored", **UNEXPLORED))
    if cut_peaks(response):
        arrow: Any = {"marker": 5, "linestyle": "none", "markersize": 3.5, "color": NEUTRAL}
        handles.append(Line2D([], [], **arrow, label="still rises where the range ends"))
    handles += more
    axes.legend(
        handles=handles,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0 + pad),
        bbox_transform=blended_transform_factory(axes.figure.transFigure, axes.transAxes),
        ncol=min(3, len(handles)),
        handlelength=1.6,
        handletextpad=0.5,
        columnspacing=1.0,
    )
