"""Linear responses of one or several models, with the names of the modes at their peaks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from nanorom import aim
from nanorom.errors import ModelError
from nanorom.linear import linear_response
from nanorom.plots.resonances import spread
from nanorom.plots.style import COLUMN, save, scaled, styled
from nanorom.rom import ReducedModel

POINTS = 4000
NAMES_APART = 0.042  # of the axis


@styled
def linear_figure(
    models: Mapping[str, ReducedModel],
    force: Mapping[str, np.ndarray],
    limits: tuple[float, float],
    position: Sequence[float],
    path: str | Path | None = None,
) -> Figure:
    """Draw the deflection at a position against drive frequency, (and write the picture).

    models, force : by title, a model and its modal forces (L,) in N; limits : in Hz; position :
    (x, y) in m where the motion is read out.  Raises ModelError without shapes.
    """
    figure = Figure(figsize=(COLUMN, 0.25 + 0.62 * COLUMN * len(models)), layout="constrained")
    panels = figure.subplots(len(models), 1, sharex=True, squeeze=False)[:, 0]
    unit, name = scaled(limits[1], "Hz")
    for axes, (title, model) in zip(panels, models.items()):
        if model.shapes is None:
            raise ModelError("shapes: the model has none, so there is no deflection to read out")
        inside = (model.frequency >= limits[0]) & (model.frequency <= limits[1])
        near = [f * np.linspace(0.95, 1.05, 201) for f in model.frequency[inside]]
        frequency = np.unique(np.concatenate([np.linspace(*limits, POINTS), *near]))
        frequency = frequency[(frequency >= limits[0]) & (frequency <= limits[1])]
        amplitude = linear_response(model, force[title], frequency)
        deflection = np.abs(amplitude @ aim.point(model.shapes, position))
        length = scaled(deflection, "m")
        axes.semilogy(unit * frequency, length[0] * deflection, color="C0")
        axes.set_xlim(unit * limits[0], unit * limits[1])
        axes.set_ylabel(f"deflection ({length[1]})")
        top = axes.get_ylim()[1]
        width = NAMES_APART * unit * (limits[1] - limits[0])
        peaks = unit * model.frequency[inside]
        for x, place, label in zip(peaks, spread(peaks, width), np.array(model.label)[inside]):
            axes.axvline(x, color="0.75", linewidth=0.5, zorder=0)
            axes.text(place, top * 1.1, label, rotation=90, ha="center", va="bottom", fontsize=6)
        axes.set_title(title, pad=22)
    panels[-1].set_xlabel(f"drive frequency ({name})")
    if path is not None:
        save(figure, path)
    return figure
