"""Calibration of modal forces: measured folds of a mode against the level, and what fits them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from nanorom.measurement.calibration import Calibration, force_of_fold
from nanorom.plots.style import (
    COLUMN,
    save,
    scaled,
    styled,
)
from nanorom.rom.model import ReducedModel
from nanorom.types import Array

POINTS = 400
COLUMNS = 2
BEYOND = 1.0  # dB on both sides of the levels


@styled
def calibration_figure(
    model: ReducedModel,
    folds: Mapping[str, tuple[Array, Array]],
    found: Mapping[str, Calibration],
    path: str | Path | None = None,
) -> Figure:
    """Draw the folds of every mode against the level, with the one-mode curve that fits them.

    folds : by label, levels in dBm (n,) and frequencies in Hz (n,); found : by label.
    """
    rows = -(-len(folds) // COLUMNS)
    figure = Figure(figsize=(COLUMN, 0.35 + 1.15 * rows), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, sharex=True, squeeze=False).ravel()
    unit, name = scaled(np.concatenate([f for _, f in folds.values()]), "Hz")
    for axes, (label, (dbm, frequency)) in zip(panels, folds.items()):
        own = float(model.select([label]).frequency[0])
        near, far = frequency.min() - own, frequency.max() - own
        detunings = np.geomspace(near, 1.3 * far, POINTS)
        level = 20 * np.log10(force_of_fold(model, label, own + detunings) / found[label].force)
        level += found[label].reference
        inside = (level > dbm.min() - BEYOND) & (level < dbm.max() + BEYOND)
        curve = unit * (own + detunings[inside])
        axes.plot(level[inside], curve, color="C0", label="the mode alone, fitted")
        axes.plot(dbm, unit * frequency, "o", color="C3", markersize=3.5, label="measured fold")
        axes.axhline(unit * own, color="0.6", linewidth=0.6, linestyle="--", label="natural")
        axes.set_title(label, pad=3)
    for axes in panels[len(folds) :]:
        axes.axis("off")
    figure.supxlabel("drive level (dBm)", fontsize=8)
    figure.supylabel(f"drop-down frequency ({name})", fontsize=8)
    handles, names = panels[0].get_legend_handles_labels()
    figure.suptitle(" ")  # keeps the legend's place
    figure.legend(handles, names, loc="upper center", ncol=3, handlelength=1.6)
    if path is not None:
        save(figure, path)
    return figure
