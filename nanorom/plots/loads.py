"""Deflection and frequencies against a static load."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from nanorom.loadcurve import UNITS, LoadCurve
from nanorom.plots.style import COLUMN, save, scaled, styled


@styled
def load_curve(curve: LoadCurve, path: str | Path | None = None) -> Figure:
    """Draw the centre's deflection above, the frequencies below (and write the picture)."""
    figure = Figure(figsize=(COLUMN, 1.1 * COLUMN), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    load, load_unit = scaled(curve.load, UNITS[curve.quantity])
    deflection, deflection_unit = scaled(curve.centre, "m")
    frequency, frequency_unit = scaled(curve.frequency, "Hz")
    above.plot(curve.load * load, curve.centre * deflection, ".-")
    above.set_ylabel(f"deflection of the centre ({deflection_unit})")
    for number, values in enumerate(curve.frequency.T, 1):
        below.plot(curve.load * load, values * frequency, ".-", label=f"mode {number}")
    below.set_ylabel(f"frequency ({frequency_unit})")
    below.set_xlabel(f"{curve.quantity} ({load_unit})")
    below.legend()
    if path is not None:
        save(figure, path)
    return figure
