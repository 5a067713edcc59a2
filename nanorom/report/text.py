"""What a reduced model and a response hold, as text for people and as data for programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from nanorom.report import estimates
from nanorom.results import cut
from nanorom.rom.model import ReducedModel
from nanorom.scene.patterns import DIRECT, PARAMETRIC
from nanorom.scene.patterns.pattern import Pattern
from nanorom.scene.units import scaled, tabulated, with_unit
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.measurement.identify import Identification
    from nanorom.results.response import Response

UNITS = {"in_plane_frequency": "Hz", "outside_frequency": "Hz"}  # of diagnostics that have one


def model_text(model: ReducedModel) -> str:
    """A table of the modes and what the reduction reports about itself."""
    return table(model_rows(model)) + "\n\n" + _list(model_facts(model))


def model_rows(model: ReducedModel) -> list[tuple[str, ...]]:
    """The modes: names of the columns, their units, and a row for each."""
    quadratic, cubic = (np.einsum(f"{'r' * t.ndim}->r", t) for t in (model.quadratic, model.cubic))
    columns = (
        ("frequency", model.frequency, "Hz", 10),
        ("mass", model.mass, "kg", 7),
        ("stiffness", np.diag(model.stiffness), "N/m", 7),
        ("Q", _quality(model), "1", 6),
        ("alpha_rr", quadratic, "N/m^2", 7),
        ("b_rrr", cubic, "N/m^3", 7),
    )
    head, *told = zip(*(_column(*column) for column in columns))
    units, *rows = told
    modes = zip(map(str, model.number), model.label)
    named = [(*mode, *row) for mode, row in zip(modes, rows)]
    return [("mode", "label", *head), ("", "", *units), *named]


def _column(name: str, values: ArrayLike, unit: str, digits: int) -> list[str]:
    """A column of a table: its name, its unit, and its cells."""
    cells, scaled_unit = tabulated(values, unit, digits)
    return [name, scaled_unit, *cells]


def model_facts(model: ReducedModel) -> list[tuple[str, str]]:
    """What the reduction reports about itself, by name."""
    facts = [
        ("modes", str(model.size)),
        ("method", f"{model.method or 'unknown'}, in-plane {model.in_plane or 'unknown'}"),
        ("normalisation", "max |phi| = 1, q in m, forces in N"),
        ("asymmetry", f"{asymmetry_text(model):.1e}"),
        ("drive", _patterns(model.drive, DIRECT)),
        ("parametric", _patterns(model.parametric, PARAMETRIC)),
    ]
    facts += [(f"Q of {name}", _short(1 / inverse)) for name, inverse in model.losses.items()]
    rest = {name: value for name, value in model.diagnostics.items() if name != "asymmetry"}
    facts += [(name, _diagnostic(name, rest[name])) for name in sorted(rest)]
    facts += [("made with", ", ".join(f"{k} {v}" for k, v in sorted(model.versions.items())))]
    return facts


def _diagnostic(name: str, value: Any) -> str:
    known = name in UNITS and isinstance(value, float)  # a file may hold anything there
    return with_unit(value, UNITS[name]) if known else _short(value)


def counted(count: int, name: str, several: str = "") -> str:
    """A number of things, "1 mode" and "2 modes"."""
    return f"{count} {name}" if count == 1 else f"{count} {several or name + 's'}"


def asymmetry_text(model: ReducedModel) -> float:
    """Of the tensors as they were found where that is known; those kept are symmetrised."""
    return float(model.diagnostics.get("asymmetry", model.asymmetry))


def response_text(response: Response) -> str:
    """A table of the special points, level by level."""
    parts = [_list(level_facts(response))]
    for head, units, *rows in (point_rows(response), unexplored_rows(response)):
        parts += [table([head, units, *rows])] if rows else []
    return "\n\n".join(parts)


def point_rows(response: Response) -> list[tuple[str, ...]]:
    """The special points: names of the columns, their units, and a row for each."""
    points = [(n, p) for n, d in enumerate(response.diagrams, 1) for p in d.special_points]
    largest = [int(np.argmax(point.amplitude)) for _, point in points]
    columns: tuple[list[str], ...] = (
        ["level", "", *(str(level) for level, _ in points)],
        ["type", "", *(point.type for _, point in points)],
        _column("frequency", [point.frequency for _, point in points], "Hz", 10),
        _column("amplitude", [p.amplitude[r] for (_, p), r in zip(points, largest)], "m", 7),
        ["largest mode", "", *(response.label[r] for r in largest)],
        ["period", "of drive", *(str(point.period_multiple) for _, point in points)],
        ["branch", "", *(str(point.branch) for _, point in points)],
    )
    if response.estimates:
        found = [
            estimates.cells(response, n - 1, response.estimated(n - 1, point))
            for n, point in points
        ]
        columns += (
            ["estimated error", "frequency, amplitude", *(error for error, _ in found)],
            ["made by", "outside", *(names for _, names in found)],
        )
    return list(zip(*columns))


def unexplored_rows(response: Response) -> list[tuple[str, ...]]:
    """What was not followed or not looked for: names of the columns, units, and a row for each."""
    missing = [(n, left) for n, d in enumerate(response.diagrams, 1) for left in d.unexplored]
    columns = (
        ["level", "", *(str(level) for level, _ in missing)],
        ["not explored", "", *(left.kind for _, left in missing)],
        _column("frequency", [left.omega / (2 * np.pi) for _, left in missing], "Hz", 7),
        ["why", "", *(left.why for _, left in missing)],
    )
    return list(zip(*columns))


def level_facts(response: Response) -> list[tuple[str, str]]:
    """The drive levels and what was found at each."""
    levels = []
    for n, (level, diagram) in enumerate(zip(response.drive.told, response.diagrams), 1):
        found = f"{counted(len(diagram.branches), 'branch', 'branches')}, "
        found += counted(len(diagram.special_points), "special point")
        if diagram.unexplored:
            found += f", {len(diagram.unexplored)} not explored"
        levels.append((f"level {n}", f"{level}: {found}"))
    if cut_peaks := cut.told(response):
        levels.append(("still rising", f"where the range ends: {cut_peaks}"))
    levels += estimates.facts(response)
    if response.unfinished:
        levels.append(("to do", f"{response.unfinished} levels; the same command goes on"))
    return levels


def identification_text(found: Identification) -> str:
    """What the measured resonances tell of a film, and how well they are fitted."""
    from nanorom.measurement.identify import CONFIDENCE
    from nanorom.measurement.unknowns import UNKNOWNS

    values = []
    for name, value in found.value.items():
        factor, unit = scaled(value, UNKNOWNS[name].unit)
        interval = _interval(factor * found.interval[name])
        values.append((name, f"{factor * value:.6g}", interval, unit))
    both, hertz = tabulated([found.measured.frequency, found.fitted], "Hz", 10)
    measured, fitted = both[: len(found.label)], both[len(found.label) :]
    differences = [f"{100 * difference:+.4f}" for difference in found.difference]
    lines = list(zip(found.label, measured, fitted, differences))
    facts = [
        ("differences", f"{100 * found.noise:.3g} % (standard deviation)"),
        ("evaluations", str(found.evaluations)),
    ]
    parts = [
        table([("found", "value", f"+- ({CONFIDENCE:.0%})", "unit"), *values]),
        table([("mode", "measured", "fitted", "difference"), ("", hertz, hertz, "%"), *lines]),
        _list(facts),
    ]
    if found.rivals:
        parts += ["Not excluded:", _rivals(found)]
    return "\n\n".join(parts)


def _rivals(found: Identification) -> str:
    """Other assignments: their values, how well they fit, and which modes they take."""
    rows = [
        (
            f"{rival.odds:.2g}",
            f"{rival.chi2:.3g}",
            f"{100 * rival.noise:.3g}",
            *(f"{value:.4g}" for value in rival.value.values()),
            " ".join(rival.label),
        )
        for rival in found.rivals
    ]
    return table([("odds", "chi^2", "noise %", *found.value, "modes"), *rows])


def _quality(model: ReducedModel) -> Array:
    """(L,) quality factors, infinite where nothing damps."""
    damping = np.diag(model.damping)
    with np.errstate(divide="ignore"):
        return np.asarray(model.mass * 2 * np.pi * model.frequency / damping)


def _interval(width: float) -> str:
    return f"{width:.2g}" if np.isfinite(width) else "unknown"


def _patterns(names: Iterable[str], kinds: Mapping[str, type[Pattern]]) -> str:
    return ", ".join(f"{n} ({kinds[n].unit})" if n in kinds else n for n in names) or "none"


def _short(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{k} {_short(v)}" for k, v in value.items())
    if isinstance(value, (float, np.floating)):
        return f"{value:.4g}"
    if isinstance(value, np.ndarray):
        return ", ".join(_short(v) for v in value.tolist())
    return str(value)


def table(rows: Sequence[Sequence[str]]) -> str:
    """Rows of cells as lines, columns aligned on the right."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows)]
    return "\n".join(
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths)).rstrip() for row in rows
    )


def _list(facts: Sequence[tuple[str, str]]) -> str:
    width = max(len(name) for name, _ in facts)
    return "\n".join(f"{name.ljust(width)}  {value}" for name, value in facts if value)
