"""What peaks and ring-downs of measurements tell, as text and as a table."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from nanorom.measurement.sweeps.peaks import CONFIDENCE, Estimate, Peak
from nanorom.measurement.sweeps.ringdown import Ringdown
from nanorom.report.text import table
from nanorom.scene.units import scaled

HEAD = ("", "value", f"+- ({CONFIDENCE:.0%})", "unit")


def peaks_text(peaks: list[Peak], left_out: int = 0) -> str:
    """Every peak, its numbers with their intervals, and where its sweeps fall."""
    parts = [_peak(number, peak) for number, peak in enumerate(peaks, 1)]
    if left_out:
        parts.append(f"{left_out} rows without a value were left out")
    return "\n\n".join(parts)


def ringdown_text(found: Ringdown) -> str:
    """The numbers of a ring-down with their intervals."""
    named = (
        ("f0", found.frequency, "Hz"),
        ("Q", found.quality_factor, "1"),
        ("decay time of A", found.decay_time, "s"),
        ("start", found.start, found.unit),
        ("duffing b/k", found.duffing, _inverse_square(found.unit)),
        ("nonlinear damping c3/c", found.nonlinear_damping, _inverse_square(found.unit)),
    )
    rows = [_row(name, value, unit) for name, value, unit in named if value is not None]
    return table([HEAD, *rows])


def save_table(peaks: list[Peak], path: Path) -> None:
    """peaks.csv: a row for each peak, values and half widths of their intervals in SI."""
    from nanorom.files.whole import atomic_path

    names = ("frequency", "quality_factor", "linewidth", "duffing", "nonlinear_damping")
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["peak", "unit", *(f"{n}{s}" for n in names for s in ("", "_interval"))])
        for place, peak in enumerate(peaks, 1):
            cells: list[str] = []
            for name in names:
                own = getattr(peak, name)
                found = () if own is None else (own.value, own.interval)
                cells += [repr(float(number)) for number in found] or ["", ""]
            writer.writerow([place, peak.unit, *cells])


def _peak(number: int, peak: Peak) -> str:
    square = _inverse_square(peak.unit)
    rows = [
        _row("f0", peak.frequency, "Hz"),
        _row("Q", peak.quality_factor, "1"),
        _row("linewidth f0/Q", peak.linewidth, "Hz"),
        _row("duffing b/k", peak.duffing, square),
    ]
    if peak.nonlinear_damping is not None:
        rows.append(_row("nonlinear damping c3/c", peak.nonlinear_damping, square))
    for level, force in peak.force.items():
        rows.append(_row(f"drive F/k {level}".strip(), force, peak.unit))
    lines = [f"peak {number}", table([HEAD, *rows])]
    for fall in peak.falls:
        low, high = sorted(fall.rows)
        told = f"{fall.level} {fall.direction}".strip()
        early = ", before its fold" if fall.early else ""
        lines.append(
            f"sweep {told} falls between {_hertz(low)} and {_hertz(high)}{early}; "
            f"fitted fold {_hertz(fall.fold)}"
        )
    lines.append(f"noise {peak.noise:.2g} of the largest amplitude")
    if peak.background:
        lines.append("a background that goes with the drive was seen and taken off")
    if peak.misfit:
        lines.append(
            "what is left is more than noise: more than one mode, or another nonlinearity; "
            "the intervals do not count that"
        )
    return "\n".join(lines)


def _row(name: str, found: Estimate, unit: str) -> tuple[str, str, str, str]:
    """Name, value, interval and unit; units that take prefixes get one."""
    factor, told = (1.0, "" if unit == "1" else unit)
    if unit in ("Hz", "s", "m", "V"):
        factor, told = scaled(found.value, unit)
    if unit == _inverse_square("m"):
        factor, told = 1e-18, "1/nm^2"
    digits = 6
    if found.interval > 0 and found.value != 0 and np.isfinite(found.interval):
        digits = int(np.clip(np.log10(abs(found.value) / found.interval) + 3, 2, 12))
    return name, f"{factor * found.value:.{digits}g}", f"{factor * found.interval:.2g}", told


def _inverse_square(unit: str) -> str:
    return f"1/{unit.split(',')[0] or 'unit'}^2"


def _hertz(value: float) -> str:
    factor, unit = scaled(value, "Hz")
    return f"{factor * value:.7g} {unit}"
