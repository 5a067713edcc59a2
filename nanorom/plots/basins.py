"""Basins of attraction in a plane of starts, one colour for each motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nanorom.continuation.ensemble.basins import GONE, ROAMING, Basins
from nanorom.plots.style import COLUMN, save, styled

OTHERS = {GONE: ("white", "left all bounds"), ROAMING: ("0.75", "not settled")}
COLOURS = 10  # that tell motions apart; then they begin again


@styled
def basins_figure(
    basins: Basins,
    path: str | Path | None = None,
    names: tuple[str, str] = ("first direction", "second direction"),
) -> Figure:
    """Draw which motion every start settles on, with its share of the starts."""
    figure = Figure(figsize=(COLUMN, 0.95 * COLUMN), layout="constrained")
    axes = figure.subplots()
    numbers = [number for number in OTHERS if (basins.which == number).any()]
    numbers += list(range(len(basins.share)))
    colours = [OTHERS[n][0] if n in OTHERS else f"C{n % COLOURS}" for n in numbers]
    drawn = np.searchsorted(numbers, basins.which)
    axes.pcolormesh(
        basins.first,
        basins.second,
        drawn.T,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(numbers) - 0.5,
        shading="nearest",
        rasterized=True,
    )
    axes.grid(False)
    axes.set_xlabel(names[0])
    axes.set_ylabel(names[1])
    labels = []
    for number in numbers:
        share = 100 * float((basins.which == number).mean())
        name = OTHERS[number][1] if number in OTHERS else f"motion {number + 1}"
        labels.append(f"{name}: {share:.3g} %")
    handles = [Patch(facecolor=c, edgecolor="0.3", label=text) for c, text in zip(colours, labels)]
    axes.legend(handles=handles, loc="upper right")
    if path is not None:
        save(figure, path)
    return figure
