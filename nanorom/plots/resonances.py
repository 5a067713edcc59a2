"""Measured resonances beside the fitted ones (step I of the paper)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from nanorom.plots.names import spread
from nanorom.plots.style import (
    COLUMN,
    save,
    scaled,
    styled,
)

if TYPE_CHECKING:
    from nanorom.measurement.identify import Identification

APART = 0.035  # of the axis: names nearer than this are moved apart


@styled
def resonance_figure(found: Identification, path: str | Path | None = None) -> Figure:
    """Draw the measured and fitted spectrum and their differences, (and write the picture)."""
    factor, unit = scaled(found.fitted, "Hz")
    measured, fitted = factor * found.measured.frequency, factor * found.fitted
    figure = Figure(figsize=(COLUMN, 0.9 * COLUMN), layout="constrained")
    lines, differences = figure.subplots(2, 1, sharex=True, height_ratios=[1, 1.3])

    lines.vlines(fitted, 0, 1, color="C0", linewidth=1.6, label="fitted")
    lines.vlines(measured, 0, 1, color="C3", linewidth=0.8, linestyle="--", label="measured")
    span = fitted.max() - fitted.min()
    lines.set_xlim(fitted.min() - 0.07 * span, fitted.max() + 0.07 * span)
    lines.set_ylim(0, 1)
    lines.set_yticks([])
    places = spread(fitted, 1.14 * APART * span)
    for x, place, name in zip(fitted, places, found.label):
        lines.annotate(
            name,
            (x, 1),
            (place, 1.18),
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=6,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "linewidth": 0.4, "color": "0.5"},
        )
    lines.legend(loc="upper center", bbox_to_anchor=(0.5, 0.02), ncol=2)

    error = found.measured.uncertainty
    differences.errorbar(
        fitted,
        100 * found.difference,
        yerr=None if error is None else 100 * error / found.fitted,
        fmt="o",
        color="C3",
        markersize=3,
        linewidth=0.8,
    )
    differences.axhline(0, color="C0", linewidth=1)
    differences.set_ylabel("measured/fitted - 1 (%)")
    differences.set_xlabel(f"frequency ({unit})")
    if path is not None:
        save(figure, path)
    return figure
