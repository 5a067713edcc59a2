"""A table of sensitivities as a designer reads it: per cent per per cent."""

from __future__ import annotations

import math

import numpy as np

from nanorom.report.text import table
from nanorom.results.sensitivity import Sensitivity
from nanorom.scene.units import tabulated

NOTHING = 1e-9  # of a deviation: what round-off leaves of a share that is none


def sensitivity_text(found: Sensitivity) -> str:
    """Value of every quantity, and its change in per cent for each per cent of every key."""
    rows = [("quantity", "value", "unit", *found.by)]
    for name, value, unit, slopes in zip(found.of, found.value, found.unit, found.relative):
        (told,), shown = tabulated([value], unit, 6)
        cells = (f"{slope:+.4f}" if math.isfinite(slope) else "-" for slope in slopes)
        rows.append((name, told, shown, *cells))
    text = f"{table(rows)}\n\nper cent of the quantity for each per cent of a number of the scene"
    if found.error.any():
        text += f"; by differences of reductions, right to {found.worst:.0e}"
    return f"{text}\n\n{_spread(found)}" if found.source else text


def _spread(found: Sensitivity) -> str:
    """How widely quantities are spread, and which key it is by."""
    rows = [("quantity", "value", "deviation", "unit", "per cent", *found.source)]
    for name, value, unit, wide, row in zip(
        found.of, found.value, found.unit, found.deviation, found.share
    ):
        row = np.where(np.abs(row) < NOTHING * wide, 0.0, row)
        told, shown = tabulated([value, wide, *row], unit, 6)
        cells = tabulated(row, unit, 4)[0] if unit in ("", "1") else told[2:]
        share = f"{100 * wide / abs(value):.3f}" if value else "-"
        rows.append((name, told[0], told[1], shown, share, *cells))
    return f"{table(rows)}\n\nstandard deviations, to first order; the last columns by each key"
