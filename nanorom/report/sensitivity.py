"""A table of sensitivities as a designer reads it: per cent per per cent."""

from __future__ import annotations

import math

from nanorom.report.text import table
from nanorom.results.sensitivity import Sensitivity
from nanorom.scene.units import tabulated


def sensitivity_text(found: Sensitivity) -> str:
    """Value of every quantity, and its change in per cent for each per cent of every key."""
    rows = [("quantity", "value", "unit", *found.by)]
    for name, value, unit, slopes in zip(found.of, found.value, found.unit, found.relative):
        (told,), shown = tabulated([value], unit, 6)
        cells = (f"{slope:+.4f}" if math.isfinite(slope) else "-" for slope in slopes)
        rows.append((name, told, shown, *cells))
    return f"{table(rows)}\n\nper cent of the quantity for each per cent of a number of the scene"
