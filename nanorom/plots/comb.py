"""The comb of a drive: its spectrum against drive frequency, as a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from nanorom.continuation.comb import Comb
from nanorom.plots.style import COLUMN, save, styled
from nanorom.scene.units import scaled
from nanorom.types import Array

FLOOR = 1e-4  # of the largest line: what the colours reach down to


@styled
def comb_figure(
    comb: Comb,
    path: str | Path | None = None,
    shape: Array | None = None,
    unit: float = 1.0,
    name: str = "",
    length: str = "",
) -> Figure:
    """Draw the lines of a comb over drive frequency in colours of their size.

    shape: values (L,) of the mode shapes at the point that is watched, whose largest contributions
    are added; the mode that moves most if left out. unit: of the frequencies, in those of the
    comb; name: what that unit is called; length: the unit of the amplitudes, such as m.
    """
    amplitude = np.nan_to_num(comb.amplitude)  # of what left all bounds
    mode = int(amplitude.max(axis=(0, 1)).argmax())
    weights = np.eye(amplitude.shape[2])[mode] if shape is None else np.abs(np.asarray(shape))
    sizes = amplitude @ weights
    factor, size_unit = scaled(sizes, length)
    sizes = factor * sizes
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
    told = f" ({name})" if name else ""
    axes.set_xlabel(f"drive frequency{told}")
    axes.set_ylabel(f"frequency of the line{told}")
    figure.colorbar(image, ax=axes, label=f"amplitude ({size_unit})" if size_unit else "amplitude")
    if path is not None:
        save(figure, path)
    return figure
