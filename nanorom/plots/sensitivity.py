"""Sensitivities as bars: what each number of a scene does to each quantity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from nanorom.plots.style import COLUMN, save, styled
from nanorom.results.sensitivity import Sensitivity

ROW = 0.22  # inches of a bar
MOST = 24  # quantities that are drawn


@styled
def sensitivity_figure(found: Sensitivity, path: str | Path | None = None) -> Figure:
    """Draw d ln(quantity) / d ln(key), a panel for each key, the first quantities if many."""
    names = found.of[:MOST]
    width = COLUMN * max(1.0, 0.28 * len(found.by) + 0.2)
    figure = Figure(figsize=(width, 0.7 + ROW * len(names)), layout="constrained")
    panels = figure.subplots(1, len(found.by), sharey=True, squeeze=False)[0]
    places = np.arange(len(names))
    for axes, key, column in zip(panels, found.by, found.relative[: len(names)].T):
        axes.barh(places, np.where(np.isfinite(column), column, 0.0), color="C0")
        axes.axvline(0, color="0.5", linewidth=0.6)
        axes.set_title(key.replace(".", "\n"), pad=3)
    panels[0].set_yticks(places, names)
    panels[0].invert_yaxis()
    figure.supxlabel("per cent per per cent", fontsize=8)
    if path is not None:
        save(figure, path)
    return figure
