"""The comb of a drive: its spectrum against drive frequency, as a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from nanorom.continuation.comb import Comb
from nanorom.plots.style import COLUMN, save, styled
from nanorom.types import Array

FLOOR = 1e-4  # of the largest line: what the colours reach down to


@styled
def comb_figure(
    comb: Comb, path: str | Path | None = None, shape: Array | None = None, unit: float = 1.0
) -> Figure:
    """Draw the lines of a comb over drive frequency in colours of their size.

    shape: values (L,) of the mode shapes at the point that is watched, whose largest contributions
    are added; the first mode if left out. unit: of the frequencies, in those of the comb.
    """
    weights = np.eye(comb.amplitude.shape[2])[0] if shape is None else np.abs(np.asarray(shape))
    sizes = comb.amplitude @ weights
    top = float(sizes.max()) or 1.0
    figure = Figure(figsize=(COLUMN, 0.85 * COLUMN), layout="constrained")
    axes = figure.subplots()
    order = np.argsort(comb.omega)
    image = axes.pcolormesh(
        comb.omega[order] / unit,
        comb.frequency / unit,
        np.maximum(sizes[order].T, FLOOR * top),
        norm=LogNorm(FLOOR * top, top),
        cmap="magma",
        shading="nearest",
        rasterized=True,
    )
    axes.grid(False)
    axes.set_xlabel("drive frequency")
    axes.set_ylabel("frequency of the line")
    figure.colorbar(image, ax=axes, label="amplitude")
    if path is not None:
        save(figure, path)
    return figure
