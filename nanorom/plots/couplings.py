"""Couplings of the modes at a glance: how much the motion of one mode stiffens another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from nanorom.plots.style import COLUMN, save, styled
from nanorom.rom.model import ReducedModel
from nanorom.rom.tables import CoefficientTable

DARK = 0.6  # of the colour map: text on darker cells is white


@styled
def coupling_figure(
    model: ReducedModel, normalisation: str = "force", path: str | Path | None = None
) -> Figure:
    """Draw b_rss of equation r as a table of colours, b_rrr on the diagonal.

    A mode s of squared amplitude x adds b_rss x q_r to the force on mode r (r not s).
    """
    table = CoefficientTable.of(model, 3, normalisation)
    place = {product: row for row, product in enumerate(table.products)}
    size = model.size
    values = np.array(
        [
            [table.values[place[tuple(sorted((r + 1, s + 1, s + 1)))], r] for s in range(size)]
            for r in range(size)
        ]
    )
    high = 0.2 * COLUMN + 0.115 * COLUMN * size
    figure = Figure(figsize=(COLUMN, high), layout="constrained")
    axes = figure.add_subplot()
    drawn = axes.imshow(np.abs(values), cmap="viridis_r", norm=LogNorm(), aspect="auto")
    for (r, s), value in np.ndenumerate(values):
        dark = drawn.norm(abs(value)) > DARK
        axes.text(s, r, f"{value:.3g}", ha="center", va="center", fontsize=6,
                  color="white" if dark else "black")  # fmt: skip
    axes.set_xticks(range(size), model.label)
    axes.set_yticks(range(size), model.label)
    axes.set_xlabel("moving mode s")
    axes.set_ylabel("equation of mode r")
    axes.grid(False)
    bar = figure.colorbar(drawn, ax=axes, pad=0.02)
    bar.set_label(f"b$_{{rss}}$ ({table.unit.replace('^2', '²').replace('^3', '³')})", size=7)
    if path is not None:
        save(figure, path)
    return figure
