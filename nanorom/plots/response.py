"""Frequency responses: one curve per drive level, stability, special points, mode by mode."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from matplotlib.cm import viridis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import blended_transform_factory
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from nanorom.measured import MeasuredResponse
from nanorom.plots.data import draw_measured
from nanorom.plots.linear import NAMES_HEIGHT, name_lines
from nanorom.plots.style import COLUMN, save, scaled, styled, with_unit
from nanorom.response import SPECIAL_POINTS, Response

Array = NDArray[np.float64]
Measure = Callable[[Array], Array]  # amplitudes (..., L) of all modes to the plotted one

MARKERS = {"LP": "s", "PD": "D", "NS": "o", "BP": "^"}
UNSTABLE = (0, (2.5, 1.2))
TAKES_PART = 1e-3  # of the largest amplitude; modes below are not drawn
NEUTRAL = "0.3"
FINER = 8  # straight pieces per continuation step
SHORTEST = 1e-9  # of the picture; keeps points apart that coincide
APART = 1e-5  # of a branch; special points closer to one of its points are not told apart
SHIFT = 0.3  # of the largest amplitude, between levels that are drawn apart
FEWEST = 5  # points that a smooth curve needs
BRIGHTEST = 0.85  # of the colour map: the yellow end is too pale for lines


@attrs.frozen(eq=False)
class Curve:
    """A stretch of a branch that is stable or unstable throughout."""

    omega: Array
    amplitude: Array
    stable: bool


@styled
def response_figure(
    response: Response,
    path: str | Path | None = None,
    measured: MeasuredResponse | None = None,
) -> Figure:
    """Draw total amplitude against drive frequency, (and write the picture).

    The total |q| is sqrt(sum_r max|q_r|^2): the modal amplitude where one mode dominates.
    A measured response is drawn over it: to scale if its amplitude is a length, else on an axis
    of its own.  Raises FileError if none of it is in the swept range.
    """
    figure = Figure(figsize=(COLUMN, 0.82 * COLUMN), layout="constrained")
    axes = figure.add_subplot()
    length, frequency = _length_unit(response, _total), _frequency_unit(response)
    _draw(axes, response, _total, length, frequency)
    modes = _take_part(response)
    whose = "|q| of all modes" if len(modes) > 1 else f"of {response.label[modes[0]]}"
    axes.set_ylabel(f"amplitude {whose} ({length[1]})")
    axes.set_xlabel(f"drive frequency ({frequency[1]})")
    handles = [] if measured is None else draw_measured(axes, measured, length, frequency)
    _legend(axes, response, more=handles)
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
        _draw(axes, response, _total, length, frequency, ("PD", "NS"), shift)
        axes.set_ylabel(f"amplitude |q| ({length[1]})")
        note = f"levels shifted by {shift:.2g} {length[1]}"
        axes.set_title(f"{title}; {note}", pad=1.25 * NAMES_HEIGHT)
        places = dict(sorted(resonances[title].items(), key=lambda entry: entry[1]))
        name_lines(axes, list(places.values()), list(places))
        axes.label_outer()
    panels[-1].set_xlabel("drive frequency / f01")
    _legend(panels[0], response, ("PD", "NS"), levels, 0.24)
    if path is not None:
        save(figure, path)
    return figure


@styled
def amplitude_panels(response: Response, path: str | Path | None = None) -> Figure:
    """Draw max |q_r| against drive frequency, a panel per mode that takes part."""
    modes = _take_part(response)
    frequency = _frequency_unit(response)
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
    _legend(panels[0], response)
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


def _frequency_unit(response: Response) -> tuple[float, str]:
    factor, unit = scaled(max(response.sweep.hertz(float(response.frequency[0]))), "Hz")
    return factor / (2 * np.pi), unit


def _draw(
    axes: Any,
    response: Response,
    measure: Measure,
    length: tuple[float, str],
    frequency: tuple[float, str],
    kinds: Collection[str] = SPECIAL_POINTS,
    shift: float = 0.0,
) -> None:
    """Draw every level, the higher ones moved up by ``shift`` each."""
    levels = list(zip(_colours(response), response.diagrams))
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
        for point in (p for p in diagram.special_points if p.type in kinds):
            axes.plot(
                point.omega * frequency[0],
                measure(point.amplitude) * length[0] + place * shift,
                color=colour,
                zorder=3,
                **marker_style(point.type),
            )
    start, stop = response.sweep.hertz(float(response.frequency[0]))
    scale = 2 * np.pi * frequency[0]
    axes.set_xlim(start * scale, stop * scale)
    top = length[0] * _largest(response, measure)
    axes.set_ylim(-0.04 * top, 1.08 * top + (len(levels) - 1) * shift)
    axes.tick_params(length=2.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def stretches(branch: Any, located: list[Any]) -> Iterator[Curve]:
    """Cut a branch where its stability changes; the unstable side closes the gap."""
    omega, amplitude, stable = _with_located(branch, located)
    omega, amplitude, position = _smooth(omega, amplitude)
    changes = np.flatnonzero(np.diff(stable)) + 1
    ends = [0, *changes, len(stable)]
    for start, stop in zip(ends[:-1], ends[1:]):
        holds = bool(stable[start])
        first, last = (
            (start, stop - 1) if holds else (max(start - 1, 0), min(stop, len(stable) - 1))
        )
        part = slice(position[first], position[last] + 1)
        yield Curve(omega[part], amplitude[part], holds)


def _with_located(branch: Any, located: list[Any]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """A branch's points and stability, its special points among them: steps pass over folds."""
    omega, amplitude = np.asarray(branch.omega), np.asarray(branch.amplitude)
    stable = np.asarray(branch.stable, dtype=bool)
    width, height = np.ptp(omega), amplitude.max(initial=0.0)
    if width == 0 or height == 0:
        return omega, amplitude, stable
    for point in located:
        points = np.column_stack([omega / width, amplitude / height])
        own = np.concatenate([[point.omega / width], point.amplitude / height])
        away = np.linalg.norm(points - own, axis=1)
        detour = away[:-1] + away[1:] - np.linalg.norm(np.diff(points, axis=0), axis=1)
        after = int(np.argmin(detour)) + 1
        if away[after - 1 : after + 1].min() > APART:
            omega = np.insert(omega, after, point.omega)
            amplitude = np.insert(amplitude, after, point.amplitude, axis=0)
            stable = np.insert(stable, after, stable[after - 1] or stable[after])
    return omega, amplitude, stable


def _smooth(omega: Array, amplitude: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """A smooth curve through the points of a branch, and where in it the points are.

    The steps of a continuation are long where the branch is easy to predict, too long for straight
    lines. Akima's interpolation stays local and does not overshoot.
    """
    width, height = np.ptp(omega), amplitude.max(initial=0.0)
    if len(omega) < FEWEST or width == 0 or height == 0:
        return omega, amplitude, np.arange(len(omega))
    points = np.column_stack([omega / width, amplitude / height])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps + SHORTEST)])
    index = np.arange(FINER * (len(omega) - 1) + 1) / FINER
    fine = np.interp(index, np.arange(len(omega)), length)
    curve = Akima1DInterpolator(length, np.column_stack([omega, amplitude]))(fine)
    return curve[:, 0], curve[:, 1:].clip(min=0), FINER * np.arange(len(omega))


def _colours(response: Response) -> Any:
    count = len(response.diagrams)
    return viridis(np.linspace(0, BRIGHTEST, count) if count > 1 else [0.3])


def _level_names(response: Response) -> list[str]:
    """What tells the levels apart: the drives that are not zero throughout."""
    units = response.drive.units
    used = [any(level[i] for level in response.drive.levels) for i in (0, 1)]
    return [
        " + ".join(with_unit(level[i], units[i], 3) for i in (0, 1) if used[i])
        for level in response.drive.levels
    ]


def _legend(
    axes: Any,
    response: Response,
    kinds: Collection[str] = SPECIAL_POINTS,
    names: Sequence[str] = (),
    pad: float = 0.0,
    more: Sequence[Line2D] = (),
) -> None:
    """One legend above the axes: levels, line styles, and the special points that occur."""
    handles = [
        Line2D([], [], color=colour, label=name)
        for colour, name in zip(_colours(response), names or _level_names(response))
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
    for kind in MARKERS:
        if kind in found and kind in kinds:
            style = {**marker_style(kind), "color": NEUTRAL, "linestyle": "none"}
            handles.append(Line2D([], [], **style, label=SPECIAL_POINTS[kind]))
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


def line_style(stable: bool) -> dict[str, Any]:
    return {"linestyle": "-" if stable else UNSTABLE, "linewidth": 1.1 if stable else 0.8}


def marker_style(kind: str) -> dict[str, Any]:
    return {
        "marker": MARKERS[kind],
        "markerfacecolor": "white",
        "markersize": 3.2,
        "markeredgewidth": 0.8,
    }
