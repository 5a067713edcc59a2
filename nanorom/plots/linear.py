"""Linear responses of one or several models, with the names of the modes at their peaks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from nanorom.errors import ModelError
from nanorom.plots.names import NAMES_HEIGHT, name_lines
from nanorom.plots.style import (
    COLUMN,
    save,
    scaled,
    styled,
)
from nanorom.rom.linear import linear_response
from nanorom.rom.model import ReducedModel

POINTS = 4000


@styled
def linear_figure(
    models: Mapping[str, ReducedModel],
    force: Mapping[str, np.ndarray],
    limits: Mapping[str, tuple[float, float]],
    position: Sequence[float],
    path: str | Path | None = None,
) -> Figure:
    """Draw the deflection at a position against drive frequency, (and write the picture).

    models, force, limits : by title, a model, its modal forces (L,) in N and the frequencies in Hz
    to draw between; position : (x, y) in m where the motion is read out.  Raises ModelError
    without shapes.
    """
    figure = Figure(figsize=(COLUMN, 0.25 + 0.62 * COLUMN * len(models)), layout="constrained")
    panels = figure.subplots(len(models), 1, squeeze=False)[:, 0]
    unit, name = scaled([high for _, high in limits.values()], "Hz")
    for axes, (title, model) in zip(panels, models.items()):
        low, high = limits[title]
        if model.shapes is None:
            raise ModelError("shapes: the model has none, so there is no deflection to read out")
        inside = (model.frequency >= low) & (model.frequency <= high)
        near = [f * np.linspace(0.95, 1.05, 201) for f in model.frequency[inside]]
        frequency = np.unique(np.concatenate([np.linspace(low, high, POINTS), *near]))
        frequency = frequency[(frequency >= low) & (frequency <= high)]
        amplitude = linear_response(model, force[title], frequency)
        deflection = np.abs(amplitude @ model.shapes.at(position))
        length = scaled(deflection, "m")
        axes.semilogy(unit * frequency, length[0] * deflection, color="C0")
        axes.set_xlim(unit * low, unit * high)
        axes.set_ylabel(f"deflection ({length[1]})")
        axes.set_title(title, pad=NAMES_HEIGHT)
        name_lines(axes, unit * model.frequency[inside], list(np.array(model.label)[inside]))
    panels[-1].set_xlabel(f"drive frequency ({name})")
    if path is not None:
        save(figure, path)
    return figure
