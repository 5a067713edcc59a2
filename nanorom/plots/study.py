"""Quantities of many devices against the keys in which they differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from nanorom.plots.style import COLUMN, axis_unit, save, styled
from nanorom.results.study import Study

MOST = 6  # quantities, and keys, that are drawn
PANEL = 0.55  # of a column: width of a panel


@styled
def study_figure(study: Study, path: str | Path | None = None) -> Figure:
    """Draw each quantity against each key, a dot for each device (and write the picture)."""
    keys, names = study.by[:MOST], study.of[:MOST]
    size = (0.4 + PANEL * len(keys), 0.3 + PANEL * len(names))
    figure = Figure(figsize=(COLUMN * max(size[0], 1.0), COLUMN * size[1]), layout="constrained")
    panels = figure.subplots(len(names), len(keys), sharex="col", sharey="row", squeeze=False)
    for row, (name, unit) in zip(panels, zip(names, study.of_unit)):
        factor, shown = axis_unit(study[name][~study.failed], unit)
        for axes, key in zip(row, keys):
            across, heading = _across(study, key)
            axes.plot(across[~study.failed], factor * study[name][~study.failed], ".", markersize=3)
            axes.set_xlabel(heading)
            axes.label_outer()
            if np.all(across == np.round(across)):  # counts, seeds
                axes.xaxis.set_major_locator(MaxNLocator(integer=True))
            if key in study.words:
                axes.set_xticks(range(len(study.words[key])), study.words[key])
        row[0].set_ylabel(f"{name} ({shown})" if shown else name)
    if path is not None:
        save(figure, path)
    return figure


def _across(study: Study, key: str) -> tuple[np.ndarray, str]:
    """Where devices stand by a key, and what the axis is called."""
    column = study.setting[:, study.by.index(key)]
    if key in study.words:
        return column, key
    factor, shown = axis_unit(column, study.by_unit[study.by.index(key)])
    return factor * column, f"{key} ({shown})" if shown else key
