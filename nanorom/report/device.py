"""What sweeps tell of a device, as text."""

from __future__ import annotations

import numpy as np

from nanorom.measurement.device.identify import Fitted, SweepIdentification
from nanorom.measurement.sweeps.peaks import CONFIDENCE
from nanorom.report.text import table
from nanorom.scene.units import MEANINGS, scaled

ALIKE = 0.9  # of a correlation, from which it is told
MOST_DIGITS = 12


def device_text(found: SweepIdentification) -> str:
    """Values with their intervals, what is not told, correlations, falls, what is left."""
    rows = [_row(found, title) for title in found.estimate]
    head = ("found", "value", f"+- ({CONFIDENCE:.0%})", "unit")
    modes = [(name, *_value(f, "Hz")) for name, f in zip(found.label, found.frequency.tolist())]
    parts = [table([head, *rows]), table([("mode", "frequency", ""), *modes])]
    if found.level:
        parts.append(
            f"drive: per unit of a level in {found.level}"
            if found.level in MEANINGS
            else f"drive: at level {found.level}"
        )
    parts += [_open(each.titles) for each in found.open]
    parts += _alike(found)
    parts.append("\n".join(filter(None, map(_fall, found.parts))))
    if found.choices:
        told = [(c.name, f"{c.evidence:+.1f}", "taken" if c.taken else "") for c in found.choices]
        parts.append(table([("model", "evidence", ""), *told]))
    parts.append(
        f"noise {found.noise:.2g} of the largest amplitude; {found.evaluations} devices, "
        f"{found.explored} diagrams"
    )
    if found.misfit:
        parts.append(
            "what is left is more than noise: another mode, or another nonlinearity, that the "
            "model lacks; the intervals do not count that"
        )
    return "\n\n".join(filter(None, parts))


def _row(found: SweepIdentification, title: str) -> tuple[str, str, str, str]:
    estimate, unit = found.estimate[title], found.unit[title]
    factor, told = scaled(estimate.value, unit) if unit in MEANINGS else (1.0, unit)
    digits = 6
    if 0 < estimate.interval < np.inf and estimate.value:
        ratio = np.log10(abs(estimate.value) / estimate.interval)
        digits = int(np.clip(ratio + 3, 2, MOST_DIGITS))
    width = f"{factor * estimate.interval:.2g}" if np.isfinite(estimate.interval) else "open"
    return title, f"{factor * estimate.value:.{digits}g}", width, told


def _value(value: float, unit: str) -> tuple[str, str]:
    factor, told = scaled(value, unit)
    return f"{factor * value:.7g}", told


def _open(titles: tuple[str, ...]) -> str:
    names = ", ".join(titles)
    if len(titles) == 1:
        return f"not told by these data: {names}"
    return (
        f"not told apart by these data: {names}; any one of them, measured in another way, tells "
        "the others"
    )


def _alike(found: SweepIdentification) -> list[str]:
    """Pairs of numbers whose errors go together."""
    titles, rows = list(found.estimate), []
    for i, first in enumerate(titles):
        for j, second in enumerate(titles[:i]):
            value = float(found.correlation[i, j])
            if abs(value) > ALIKE and np.isfinite(found.estimate[first].interval):
                rows.append((second, first, f"{value:+.3f}"))
    return [table([("correlated", "with", ""), *rows])] if rows else []


def _fall(part: Fitted) -> str:
    lines = []
    for before, after, fold, early in part.falls:
        low, high = (" ".join(_value(f, "Hz")) for f in sorted((before, after)))
        told = f"sweep {part.trace.level} {part.trace.direction} falls between {low} and {high}"
        if np.isfinite(fold):
            told += f"; fitted fold {' '.join(_value(fold, 'Hz'))}"
            told += ", which it does not reach" if early else ""
        lines.append(told)
    return "\n".join(lines)
