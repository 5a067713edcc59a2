"""How the film moves along a branch: amplitudes, energies, time series, shapes, animation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from nanorom import motion
from nanorom.continuation import Branch, PeriodicOrbit
from nanorom.errors import ModelError
from nanorom.files import atomic_path
from nanorom.plots.response import TAKES_PART, UNSTABLE
from nanorom.plots.style import COLUMN, save, scaled, styled, with_unit
from nanorom.rom import ReducedModel

Array = NDArray[np.float64]

COLOURS = "RdBu_r"
LEVELS = 31
FRAMES = 48  # of an animation, over one period
FRAME_TIME = 80  # milliseconds
SCREEN = 100  # dots per inch of an animation


@styled
def branch_panels(
    model: ReducedModel, branch: Branch, path: str | Path | None = None
) -> Figure:
    """Draw max |q_r| along one branch, a panel per mode that takes part, and the energy shares."""
    x = branch.omega / (2 * np.pi * float(model.frequency[0]))
    largest = branch.amplitude.max(axis=0)
    modes = np.flatnonzero(largest >= TAKES_PART * largest.max())
    shares = np.array([motion.energy_shares(model, branch.orbit(k)) for k in range(len(x))])
    figure = Figure(figsize=(COLUMN, 0.55 * len(modes) + 2.1), layout="constrained")
    ratios = [*([1] * len(modes)), 2.4]
    panels = figure.subplots(len(modes) + 1, 1, sharex=True, height_ratios=ratios)
    for axes, mode in zip(panels, modes):
        factor, unit = scaled(largest[mode], "m")
        _line(axes, x, factor * branch.amplitude[:, mode], branch.stable, "C0")
        axes.set_ylabel(f"{model.label[mode]}\n({unit})", linespacing=1.2)
        axes.locator_params(axis="y", nbins=3)
        axes.set_ylim(bottom=0)
    below = panels[-1]
    for number, mode in enumerate(modes):
        _line(below, x, shares[:, mode], branch.stable, f"C{number}", model.label[mode])
    below.set_yscale("log")
    below.set_ylim(1e-6, 2)
    below.set_ylabel("share of\nenergy (1)")
    below.set_xlabel("drive frequency / f01")
    below.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), handlelength=1.2)
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
    above.set_title(f"drive frequency {with_unit(orbit.omega / (2 * np.pi), 'Hz')}")
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
        ratio = orbit.omega / (2 * np.pi * float(model.frequency[0]))
        titles.append(f"{ratio:.3f} f01\n{with_unit(np.abs(field).max(), 'm', 3)}")
        fields.append(field / np.abs(field).max())
    return _films(model, fields, titles, "deflection / largest", path)


@styled
def snapshots_figure(
    model: ReducedModel, orbit: PeriodicOrbit, count: int = 8, path: str | Path | None = None
) -> Figure:
    """Draw the film at equal steps of one period, all to one scale."""
    t = np.arange(count) / count
    fields = motion.deflection(model, orbit, t * orbit.period)
    largest = float(np.abs(fields).max())
    titles = [f"{instant:.3g} T" for instant in t]
    name = f"deflection / {with_unit(largest, 'm', 3)}"
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
    triangulation = _triangulation(model)
    x, y = triangulation.x, triangulation.y
    high = min(max(float(np.ptp(y) / np.ptp(x)), 0.3), 1.5) * COLUMN / columns + 0.33
    figure = Figure(figsize=(COLUMN, rows * high + 0.45), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    levels = np.linspace(-1, 1, LEVELS)
    for axes, field, title in zip(panels, fields, titles):
        drawn = axes.tricontourf(triangulation, field.clip(-1, 1), levels, cmap=COLOURS)
        axes.set_title(title, pad=2)
        axes.set_aspect("equal" if np.ptp(y) > 0.2 * np.ptp(x) else "auto")
    for axes in panels:
        axes.axis("off")
    bar = figure.colorbar(
        drawn, ax=panels, orientation="horizontal", ticks=[-1, 0, 1], aspect=40, shrink=0.5
    )
    bar.set_label(name)
    if path is not None:
        save(figure, path)
    return figure


def _triangulation(model: ReducedModel) -> Triangulation:
    if model.shapes is None:
        raise ModelError("shapes: the model has none, so there is nothing to draw")
    points = 1e6 * model.shapes.points
    return Triangulation(points[:, 0], points[:, 1], model.shapes.cells)


@styled
def animate(model: ReducedModel, orbit: PeriodicOrbit, path: str | Path) -> Figure:
    """Write an animation (GIF) of the film over one period, as a surface seen from the side.

    Deflections are magnified; the title says how much.  Raises ModelError, FileError.
    """
    triangulation = _triangulation(model)
    t = np.arange(FRAMES) / FRAMES
    fields = 1e6 * motion.deflection(model, orbit, t * orbit.period)
    largest = float(np.abs(fields).max())
    magnified = 0.3 * float(np.ptp(triangulation.x)) / largest
    figure = Figure(figsize=(COLUMN, 0.85 * COLUMN))
    axes = figure.add_axes((0.0, 0.0, 1.0, 0.92), projection="3d")
    sides = np.ptp(triangulation.x), np.ptp(triangulation.y), 2 * magnified * largest
    ratio = orbit.omega / (2 * np.pi * float(model.frequency[0]))
    figure.suptitle(
        f"drive at {ratio:.3f} f01, deflections of {with_unit(1e-6 * largest, 'm', 3)} x "
        f"{magnified:.0f}",
        fontsize=7,
    )

    def draw(frame: int) -> None:
        axes.clear()
        axes.plot_trisurf(
            triangulation,
            magnified * fields[frame],
            cmap=COLOURS,
            vmin=-magnified * largest,
            vmax=magnified * largest,
            linewidth=0,
            antialiased=False,
        )
        axes.set_zlim(-magnified * largest, magnified * largest)
        axes.set_box_aspect(sides, zoom=1.45)
        axes.view_init(elev=28)
        axes.set_axis_off()

    film = FuncAnimation(figure, draw, frames=FRAMES, interval=FRAME_TIME)
    with atomic_path(path) as temporary:
        film.save(temporary, writer=PillowWriter(fps=1000 // FRAME_TIME), dpi=SCREEN)
    return figure
