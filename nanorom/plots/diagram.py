"""Diagrams of `nanorom.continuation` in the units of its arrays: branches, sweeps, one motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from nanorom.continuation import Diagram, PeriodicOrbit, Sweep
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.plots.curves import (
    NEUTRAL,
    TAKES_PART,
    UNEXPLORED,
    line_style,
    marker_style,
    stretches,
)
from nanorom.plots.style import COLUMN, save, styled

SWEPT = ("C3", "C2")  # colours of sweeps, say up and down
RECORDED: Any = {"marker": ".", "markersize": 4.5, "linewidth": 0.6, "alpha": 0.45, "zorder": 1.5}
PERIODS = {1: "C0", 2: "C4", 3: "C1"}  # colour of a branch by its period
FLOOR = 1e-8  # of the largest line of a spectrum


@styled
def diagram_figure(
    diagram: Diagram,
    path: str | Path | None = None,
    labels: Sequence[str] = (),
    sweeps: Mapping[str, Sweep] | None = None,
) -> Figure:
    """Draw max |q_r| against drive frequency, a panel per mode that takes part.

    Every branch is drawn, with its special points by type; labels: names of the modes; sweeps:
    what time integration recorded, by name, drawn over the branches.
    """
    sweeps = sweeps or {}
    base = [b for b in diagram.branches if b.parent is None and b.period_multiple == 1]
    driven = np.concatenate([branch.omega for branch in base])
    low, high = driven.min(), driven.max()
    shown = [b.amplitude[(b.omega >= low) & (b.omega <= high)] for b in diagram.branches]
    tops = np.concatenate(shown).max(axis=0)
    modes = np.flatnonzero(tops >= TAKES_PART * tops.max())
    figure = Figure(figsize=(COLUMN, 0.9 * len(modes) + 1.3), layout="constrained")
    panels = figure.subplots(len(modes), 1, sharex=True, squeeze=False)[:, 0]
    for axes, mode in zip(panels, modes):
        for number, branch in enumerate(diagram.branches):
            for curve in stretches(branch, diagram.points(branch=number)):
                axes.plot(
                    curve.omega,
                    curve.amplitude[:, mode],
                    color=_colour(branch.period_multiple),
                    **line_style(curve.stable),
                )
        for (name, swept), colour in zip(sweeps.items(), SWEPT):
            axes.plot(swept.omega, swept.amplitude[:, mode], color=colour, label=name, **RECORDED)
        whole: Any = {"zorder": 3, "clip_on": False}  # also on the edge
        for point in (p for p in diagram.special_points if low <= p.omega <= high):
            style = {"color": _colour(point.period_multiple), **marker_style(point.type)}
            axes.plot(point.omega, point.amplitude[mode], **style, **whole)
        for left in (u for u in diagram.unexplored if low <= u.omega <= high):
            axes.plot(left.omega, 0.0, color=NEUTRAL, **UNEXPLORED, **whole)
        name = labels[mode] if labels else f"mode {mode + 1}"
        axes.set_ylabel(f"max |q|\n{name}", linespacing=1.2)
        axes.set_ylim(-0.05 * tops[mode], 1.1 * tops[mode])
        axes.locator_params(axis="y", nbins=4)
    panels[-1].set_xlim(low, high)
    panels[-1].set_xlabel("drive frequency ω")
    figure.align_ylabels(panels)
    _legend(panels[0], diagram, list(sweeps))
    if path is not None:
        save(figure, path)
    return figure


def _colour(period_multiple: int) -> str:
    return PERIODS.get(period_multiple, "C5")


def _legend(axes: Any, diagram: Diagram, sweeps: Sequence[str]) -> None:
    handles = []
    for multiple in sorted({b.period_multiple for b in diagram.branches}):
        name = "period of the drive" if multiple == 1 else f"{multiple} periods"
        handles.append(Line2D([], [], color=_colour(multiple), label=name))
    if not all(np.all(b.stable) for b in diagram.branches):
        handles.append(Line2D([], [], **line_style(False), color=NEUTRAL, label="unstable"))
    for kind in KINDS.values():
        if diagram.points(kind.code):
            style = {**marker_style(kind.code), "color": NEUTRAL, "linestyle": "none"}
            handles.append(Line2D([], [], **style, label=kind.name))
    if diagram.unexplored:
        handles.append(Line2D([], [], color=NEUTRAL, label="not explored", **UNEXPLORED))
    handles += [
        Line2D([], [], color=colour, **RECORDED, label=name) for name, colour in zip(sweeps, SWEPT)
    ]
    axes.legend(
        handles=handles,
        loc="lower center",
        bbox_to_anchor=(0.45, 1.0),
        ncol=min(3, len(handles)),
        handlelength=1.6,
        handletextpad=0.5,
        columnspacing=1.0,
    )


@styled
def motion_figure(
    orbit: PeriodicOrbit, path: str | Path | None = None, labels: Sequence[str] = ()
) -> Figure:
    """Draw q_r over one period of an orbit, and its spectrum on a logarithmic scale."""
    times, q, _ = orbit.time_series(400)
    frequencies, amplitudes = orbit.spectrum()
    sizes: NDArray[np.float64] = np.abs(amplitudes)
    tops = np.abs(q).max(axis=0)
    modes = np.flatnonzero(tops >= TAKES_PART * tops.max())
    figure = Figure(figsize=(COLUMN, 0.95 * COLUMN), layout="constrained")
    above, below = figure.subplots(2, 1)
    floor = FLOOR * sizes.max()
    width = 0.25 / len(modes) / orbit.period_multiple
    for number, mode in enumerate(modes):
        name = labels[mode] if labels else f"mode {mode + 1}"
        above.plot(times / orbit.period, q[:, mode], color=f"C{number}", label=name)
        kept = sizes[:, mode] > floor
        places = frequencies[kept] / orbit.omega + (number - (len(modes) - 1) / 2) * width
        below.vlines(places, floor, sizes[kept, mode], color=f"C{number}", lw=1.2)
    above.set_ylabel("q")
    above.set_xlabel("time / period of the motion")
    above.set_title(f"drive frequency ω = {orbit.omega:.6g}")
    above.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), handlelength=1.2)
    below.set_yscale("log")
    below.set_ylim(floor, 3 * sizes.max())
    below.set_ylabel("amplitude of q")
    below.set_xlabel("frequency / drive frequency")
    if path is not None:
        save(figure, path)
    return figure
