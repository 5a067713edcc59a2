"""A design: its front, or its formulas against its keys, device by device."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from nanorom.plots.style import COLUMN, axis_unit, save, styled
from nanorom.results.design import Design

MOST = 6  # formulas, and keys, that are drawn
PANEL = 0.55  # of a column: width of a panel
MET = 1e-3  # violation up to which a device is drawn as one that meets the conditions


@styled
def design_figure(design: Design, path: str | Path | None = None) -> Figure:
    """Draw each formula against each key, and a front as one; the best with a ring.

    Devices that miss a condition are pale.
    """
    keys, names = design.by[:MOST], design.of[:MOST]
    two = int(design.front.sum()) > 1
    columns = len(keys) + two
    size = COLUMN * max(0.4 + PANEL * columns, 1.0), COLUMN * (0.3 + PANEL * len(names))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(len(names), columns, squeeze=False)
    for row, axes_row in enumerate(panels):
        for column, axes in enumerate(axes_row[: len(keys)]):
            across = design.setting[:, column], design.ended_setting[:, column]
            _panel(axes, design, across, design.by_unit[column], row)
            if row == len(names) - 1:
                _named(axes.set_xlabel, keys[column], across[0], design.by_unit[column])
        _named(axes_row[0].set_ylabel, names[row], design.value[:, row], design.of_unit[row])
        if two:
            axes = axes_row[-1]
            across = design.value[:, 1 - min(row, 1)], design.ended_value[:, 1 - min(row, 1)]
            other = 1 - min(row, 1)
            _panel(axes, design, across, design.of_unit[other], row)
            _named(axes.set_xlabel, names[other], across[0], design.of_unit[other])
    if path is not None:
        save(figure, path)
    return figure


def _panel(
    axes: object, design: Design, across: tuple[np.ndarray, np.ndarray], unit: str, row: int
) -> None:
    draw = axes.plot  # type: ignore[attr-defined]
    x, y = axis_unit(across[0], unit)[0], axis_unit(design.value[:, row], design.of_unit[row])[0]
    missed = design.violation > MET
    draw(x * across[0][missed], y * design.value[missed, row], ".", color="0.8", markersize=3)
    draw(x * across[0][~missed], y * design.value[~missed, row], ".", color="C0", markersize=3)
    front = design.front
    draw(x * across[1][front], y * design.ended_value[front, row], ".", color="C1", markersize=4)
    if design.chosen >= 0:
        best = design.chosen
        place = x * across[1][best], y * design.ended_value[best, row]
        draw(*place, "o", markersize=7, markerfacecolor="none", color="C3")


def _named(label: object, name: str, values: np.ndarray, unit: str) -> None:
    shown = axis_unit(values, unit)[1]
    label(f"{name} ({shown})" if shown else name)  # type: ignore[operator]
