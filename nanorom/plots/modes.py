"""The mode gallery: every mode shape of a reduced model, with its name and frequency."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, TriMesh
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from nanorom.errors import ModelError
from nanorom.plots.style import (
    COLUMN,
    save,
    styled,
    with_unit,
)
from nanorom.rom.model import ReducedModel
from nanorom.rom.shapes import Shapes
from nanorom.types import Array

COLOURS = "RdBu_r"
TITLE = 0.27  # height in inches of the two lines above a panel
GAP = 0.08  # between panels
BAR = 0.42  # of the colour bar with its label
FLATTEST = 1 / 8  # a narrower film is drawn wider than it is, and the picture says so


@styled
def mode_gallery(model: ReducedModel, path: str | Path | None = None) -> Figure:
    """Draw one panel per mode, (and write the picture); raises ModelError without shapes.

    Colour is the displacement phi of the mode, from -1 (blue) to 1 (red).
    """
    if model.shapes is None:
        raise ModelError("shapes: the model has none, so there is nothing to draw")
    x, y = model.shapes.points[:, 0], model.shapes.points[:, 1]
    ratio = float(np.ptp(y) / np.ptp(x))
    shown = max(ratio, FLATTEST)
    columns = _columns(model.size, shown)
    rows = -(-model.size // columns)
    width = (COLUMN - GAP) / columns
    height = (width - GAP) * shown + TITLE + GAP
    note = 0.15 if shown > ratio else 0.0
    total = rows * height + BAR + note

    figure = Figure(figsize=(COLUMN, total))
    triangulation = Triangulation(x, y, model.shapes.cells)
    edge = outline(model.shapes)
    for mode in range(model.size):
        row, column = divmod(mode, columns)
        left = GAP + column * width
        bottom = total - (row + 1) * height + GAP
        box = (
            left / COLUMN,
            bottom / total,
            (width - GAP) / COLUMN,
            (width - GAP) * shown / total,
        )
        axes = figure.add_axes(box)
        values = model.shapes.values[mode].clip(-1, 1)
        shade(axes, triangulation, values)
        axes.add_collection(LineCollection(edge, colors="0.25", linewidths=0.6, capstyle="round"))
        axes.set_title(_title(model, mode), y=1.0, pad=2, linespacing=1.15)
        axes.set_aspect(shown / ratio)
        axes.margins(0.01)
        axes.axis("off")
    _colour_bar(figure, total, note)
    if note:
        text = f"films drawn {shown / ratio:.3g} times as wide as they are"
        figure.text(0.5, 0.03 / total, text, ha="center", va="bottom", size=6, color="0.35")
    if path is not None:
        save(figure, path)
    return figure


def shade(axes: Axes, triangulation: Triangulation, values: Array) -> TriMesh:
    """Colour a film by values (P,) from -1 to 1, without a say in the limits of the axes."""
    # not contours: their search never ends where triangles shrink towards corners
    film = TriMesh(triangulation, cmap=COLOURS, norm=Normalize(-1, 1))
    film.set_array(values)
    axes.add_collection(film, autolim=False)  # limits would make a path of every triangle
    return film


def _columns(panels: int, ratio: float) -> int:
    """As many columns as keep a panel's title readable and the picture about square."""
    most = 4 if ratio > 0.4 else 3 if ratio > 0.2 else 2
    return min(panels, most)


def _title(model: ReducedModel, mode: int) -> str:
    frequency = with_unit(float(model.frequency[mode]), "Hz", trim="k")
    along = model.shapes is not None and model.shapes.in_plane[mode]
    return f"{model.label[mode]}{', in plane' * bool(along)}\n{frequency}"


def outline(shapes: Shapes) -> Any:
    """Line segments (n, 2, 2) of the film's boundary: edges that belong to one triangle."""
    edges = np.sort(shapes.cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    return shapes.points[unique[count == 1], :2]


def _colour_bar(figure: Figure, total: float, note: float) -> None:
    axes = figure.add_axes((0.3, (note + 0.27) / total, 0.4, 0.06 / total))
    scale = ScalarMappable(Normalize(-1, 1), COLOURS)
    bar = figure.colorbar(scale, cax=axes, orientation="horizontal", ticks=[-1, 0, 1])
    bar.set_label("mode shape φ", labelpad=1, size=7)
    bar.ax.tick_params(length=2, pad=1.5)
    bar.outline.set_linewidth(0.5)
