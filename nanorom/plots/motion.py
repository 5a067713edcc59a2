"""How the film moves along a branch: amplitudes, energies, time series, shapes, animation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.tri import Triangulation
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from nanorom.continuation import Branch, PeriodicOrbit
from nanorom.errors import ModelError
from nanorom.files.whole import atomic_path
from nanorom.plots.curves import NEUTRAL, TAKES_PART, UNSTABLE
from nanorom.plots.modes import outline, shade
from nanorom.plots.style import (
    COLUMN,
    save,
    scaled,
    styled,
    with_unit,
)
from nanorom.rom import motion
from nanorom.rom.model import ReducedModel
from nanorom.types import Array

SURFACE = "coolwarm"  # no white in the middle: a flat film must be seen
FRAMES = 32  # of an animation, over one period
FRAME_TIME = 100  # milliseconds
SCREEN = 100  # dots per inch of an animation


@styled
def branch_panels(
    model: ReducedModel,
    branch: Branch,
    marks: Sequence[float] = (),
    path: str | Path | None = None,
) -> Figure:
    """Draw max |q_r| along one branch, a panel per mode that takes part, and the energy shares.

    marks : drive frequencies in Hz, as vertical lines.
    """
    x = branch.omega / (2 * np.pi * float(model.frequency[0]))
    largest = branch.amplitude.max(axis=0)
    modes = np.flatnonzero(largest >= TAKES_PART * largest.max())
    shares = np.array([motion.energy_shares(model, branch.orbit(k)) for k in range(len(x))])
    figure = Figure(figsize=(COLUMN, 0.55 * len(modes) + 2.1), layout="constrained")
    ratios = [*([1] * len(modes)), 2.4]
    panels = figure.subplots(len(modes) + 1, 1, sharex=True, height_ratios=ratios)
    for number, (axes, mode) in enumerate(zip(panels, modes)):
        factor, unit = scaled(largest[mode], "m")
        _line(axes, x, factor * branch.amplitude[:, mode], branch.stable, f"C{number}")
        axes.set_ylabel(f"{model.label[mode]}\n({unit})", linespacing=1.2)
        axes.locator_params(axis="y", nbins=3)
        axes.set_ylim(bottom=0)
    below = panels[-1]
    for number, mode in enumerate(modes):
        _line(below, x, shares[:, mode], branch.stable, f"C{number}", model.label[mode])
    below.set_yscale("log")
    below.set_ylim(1e-6, 2)
    below.set_ylabel("share of energy")
    for axes in panels:
        for mark in marks:
            axes.axvline(mark / float(model.frequency[0]), color="0.6", linewidth=0.6, zorder=0)
    below.set_xlabel("drive frequency / f01")
    below.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), handlelength=1.2)
    handles = [
        Line2D([], [], color=NEUTRAL, label="stable"),
        Line2D([], [], color=NEUTRAL, linestyle=UNSTABLE, label="unstable"),
    ]
    panels[0].legend(handles=handles, loc="lower right", ncol=2, bbox_to_anchor=(1.0, 0.98))
    figure.align_ylabels(panels)
    if path is not None:
        save(figure, path)
    return figure


def _line(axes: Any, x: Array, y: Array, stable: Any, colour: str, label: str = "") -> None:
    stable = np.asarray(stable, dtype=bool)
    changes = np.flatnonzero(np.diff(stable)) + 1
    for start, stop in zip([0, *changes], [*changes, len(x)]):
        part = slice(max(start - 1, 0), stop)
        style: Any = "-" if stable[start] else UNSTABLE
        axes.plot(x[part], y[part], color=colour, linestyle=style, linewidth=1)
    if label:
        axes.plot([], [], color=colour, label=label)


@styled
def time_series_figure(
    model: ReducedModel, orbit: PeriodicOrbit, path: str | Path | None = None
) -> Figure:
    """Draw q_r over one period, the largest mode above and the others below."""
    t, q, _ = orbit.time_series(motion.INSTANTS, 1)
    largest = np.abs(q).max(axis=0)
    modes = np.flatnonzero(largest >= TAKES_PART * largest.max())
    first = int(largest.argmax())
    figure = Figure(figsize=(COLUMN, 0.85 * COLUMN), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1, 1.6])
    for axes, chosen in ((above, [first]), (below, [m for m in modes if m != first])):
        factor, unit = scaled(largest[chosen] if chosen else 1.0, "m")
        for number, mode in enumerate(chosen):
            colour = f"C{number + (axes is below)}"
            axes.plot(t / orbit.period, factor * q[:, mode], color=colour, label=model.label[mode])
        axes.set_ylabel(f"q ({unit})")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02))
    below.set_xlabel("time / period of the motion")
    above.set_title(_drive(model, orbit))
    if path is not None:
        save(figure, path)
    return figure


@styled
def shapes_figure(
    model: ReducedModel, orbits: Sequence[PeriodicOrbit], path: str | Path | None = None
) -> Figure:
    """Draw the film at its largest deflection on several orbits, each to its own scale."""
    titles, fields = [], []
    for orbit in orbits:
        field = motion.deflection(model, orbit, motion.time_of_largest(model, orbit))
        largest = field[np.abs(field).argmax()]  # with its sign
        titles.append(f"{_ratio(model, orbit):.3f} f01\n{with_unit(largest, 'm', 3)}")
        fields.append(field / largest)
    return _films(model, fields, titles, "deflection / largest", path)


@styled
def snapshots_figure(
    model: ReducedModel, orbit: PeriodicOrbit, count: int = 8, path: str | Path | None = None
) -> Figure:
    """Draw the film at equal steps of one period T of the motion, all to one scale."""
    t = np.arange(count) / count
    fields = motion.deflection(model, orbit, t * orbit.period)
    largest = float(np.abs(fields).max())
    titles = [f"{instant:.3g} T" for instant in t]
    name = f"deflection / {with_unit(largest, 'm', 3)}, {_drive(model, orbit)}"
    return _films(model, list(fields / largest), titles, name, path)


def _films(
    model: ReducedModel,
    fields: Sequence[Array],
    titles: Sequence[str],
    name: str,
    path: str | Path | None,
) -> Figure:
    columns = min(4, len(fields))
    rows = -(-len(fields) // columns)
    triangulation, edge = _triangulation(model)
    ratio = float(np.ptp(triangulation.y) / np.ptp(triangulation.x))
    lines = 1 + max(title.count("\n") for title in titles)
    high = min(max(ratio, 0.3), 1.5) * COLUMN / columns + 0.1 * lines + 0.06
    figure = Figure(figsize=(COLUMN, rows * high + 0.5), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, field, title in zip(panels, fields, titles):
        drawn = shade(axes, triangulation, field.clip(-1, 1))
        axes.add_collection(LineCollection(edge, colors="0.25", linewidths=0.5))
        axes.set_title(title, pad=2)
        axes.set_aspect("equal" if ratio > 0.2 else "auto")
    for axes in panels:
        axes.margins(0.01)
        axes.axis("off")
    bar = figure.colorbar(
        drawn, ax=panels, orientation="horizontal", ticks=[-1, 0, 1], aspect=40, shrink=0.5
    )
    bar.set_label(name, size=7)
    if path is not None:
        save(figure, path)
    return figure


def _ratio(model: ReducedModel, orbit: PeriodicOrbit) -> float:
    """Drive frequency by the lowest natural frequency."""
    return orbit.omega / (2 * np.pi * float(model.frequency[0]))


def _drive(model: ReducedModel, orbit: PeriodicOrbit) -> str:
    hertz = with_unit(orbit.omega / (2 * np.pi), "Hz")
    return f"driven at {_ratio(model, orbit):.3f} f01 = {hertz}"


def _triangulation(model: ReducedModel) -> tuple[Triangulation, Array]:
    """Triangles and boundary (n, 2, 2) of the film, in um."""
    if model.shapes is None:
        raise ModelError("shapes: the model has none, so there is nothing to draw")
    points = 1e6 * model.shapes.points
    return Triangulation(points[:, 0], points[:, 1], model.shapes.cells), 1e6 * outline(
        model.shapes
    )


@styled
def animate(model: ReducedModel, orbit: PeriodicOrbit, path: str | Path) -> Figure:
    """Write an animation (GIF) of the film over one period, as a surface seen from the side.

    Deflections are magnified; the title says how much.  Raises ModelError, FileError.
    """
    triangulation, edge = _triangulation(model)
    rest = np.concatenate([edge, np.zeros((len(edge), 2, 1))], axis=2)
    t = np.arange(FRAMES) / FRAMES
    fields = 1e6 * motion.deflection(model, orbit, t * orbit.period)
    largest = float(np.abs(fields).max())
    magnified = 0.3 * float(np.ptp(triangulation.x)) / largest
    figure = Figure(figsize=(COLUMN, 0.75 * COLUMN))
    axes = figure.add_axes((0.0, 0.0, 1.0, 0.92), projection="3d")
    sides = np.ptp(triangulation.x), np.ptp(triangulation.y), 2 * magnified * largest
    size = with_unit(1e-6 * largest, "m", 3)
    figure.suptitle(
        f"{_drive(model, orbit)}, deflections of {size} x {magnified:.0f}", fontsize=6.5
    )

    def draw(frame: int) -> None:
        axes.clear()
        axes.plot_trisurf(
            triangulation,
            magnified * fields[frame],
            cmap=SURFACE,
            vmin=-magnified * largest,
            vmax=magnified * largest,
            linewidth=0,
            antialiased=False,
        )
        axes.add_collection3d(Line3DCollection(rest, colors="0.4", linewidths=0.6))
        axes.set_zlim(-magnified * largest, magnified * largest)
        axes.set_box_aspect(sides, zoom=1.6)
        axes.view_init(elev=28)
        axes.set_axis_off()

    film = FuncAnimation(figure, draw, frames=FRAMES, interval=FRAME_TIME)
    with atomic_path(path) as temporary:
        film.save(temporary, writer=PillowWriter(fps=1000 // FRAME_TIME), dpi=SCREEN)
    return figure
