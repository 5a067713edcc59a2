"""What a reduced model and a response hold, as text for people and as data for programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nanorom.rom.model import ReducedModel
from nanorom.scene.patterns import DIRECT, PARAMETRIC
from nanorom.scene.patterns.pattern import Pattern

if TYPE_CHECKING:
    from nanorom.measurement.identify import Identification
    from nanorom.results.response import Response


def model_text(model: ReducedModel) -> str:
    """A table of the modes and what the reduction reports about itself."""
    return _table(model_rows(model)) + "\n\n" + _list(model_facts(model))


def model_rows(model: ReducedModel) -> list[tuple[str, ...]]:
    """The modes: names of the columns, their units, and a row for each."""
    rows = [
        (
            str(model.number[r]),
            model.label[r],
            f"{model.frequency[r]:.9e}",
            f"{model.mass[r]:.6e}",
            f"{model.stiffness[r, r]:.6e}",
            _quality(model, r),
            f"{model.quadratic[r, r, r]:.6e}",
            f"{model.cubic[r, r, r, r]:.6e}",
        )
        for r in range(model.size)
    ]
    head = ("mode", "label", "frequency", "mass", "stiffness", "Q", "alpha_rr", "b_rrr")
    units = ("", "", "Hz", "kg", "N/m", "1", "N/m^2", "N/m^3")
    return [head, units, *rows]


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
    rest = {name: value for name, value in model.diagnostics.items() if name != "asymmetry"}
    facts += [(name, _short(rest[name])) for name in sorted(rest)]
    facts += [("made with", ", ".join(f"{k} {v}" for k, v in sorted(model.versions.items())))]
    return facts


def counted(count: int, name: str) -> str:
    """A number of things, "1 mode" and "2 modes"."""
    return f"{count} {name}{'' if count == 1 else 's'}"


def asymmetry_text(model: ReducedModel) -> float:
    """Of the tensors as they were found where that is known; those kept are symmetrised."""
    return float(model.diagnostics.get("asymmetry", model.asymmetry))


def response_text(response: Response) -> str:
    """A table of the special points, level by level."""
    parts = [_list(level_facts(response))]
    for head, units, *rows in (point_rows(response), unexplored_rows(response)):
        parts += [_table([head, units, *rows])] if rows else []
    return "\n\n".join(parts)


def point_rows(response: Response) -> list[tuple[str, ...]]:
    """The special points: names of the columns, their units, and a row for each."""
    head = ("level", "type", "frequency", "amplitude", "largest mode", "period", "branch")
    units = ("", "", "Hz", "m", "", "of drive", "")
    rows = []
    for level, diagram in enumerate(response.diagrams, 1):
        for point in diagram.special_points:
            largest = int(np.argmax(point.amplitude))
            rows.append(
                (
                    str(level),
                    point.type,
                    f"{point.omega / (2 * np.pi):.9e}",
                    f"{point.amplitude[largest]:.6e}",
                    response.label[largest],
                    str(point.period_multiple),
                    str(point.branch),
                )
            )
    return [head, units, *rows]


def unexplored_rows(response: Response) -> list[tuple[str, ...]]:
    """What was not followed or not looked for: names of the columns, units, and a row for each."""
    rows = [
        (str(level), left.kind, f"{left.omega / (2 * np.pi):.6e}", left.why)
        for level, diagram in enumerate(response.diagrams, 1)
        for left in diagram.unexplored
    ]
    return [("level", "not explored", "frequency", "why"), ("", "", "Hz", ""), *rows]


def level_facts(response: Response) -> list[tuple[str, str]]:
    """The drive levels and what was found at each."""
    direct_unit, parametric_unit = response.drive.units
    levels = [
        (
            f"level {n}",
            f"{direct:g} {direct_unit} direct, {parametric:g} {parametric_unit} parametric: "
            f"{len(diagram.branches)} branches, {len(diagram.special_points)} special points"
            + (f", {len(diagram.unexplored)} not explored" if diagram.unexplored else ""),
        )
        for n, ((direct, parametric), diagram) in enumerate(
            zip(response.drive.levels, response.diagrams), 1
        )
    ]
    if response.unfinished:
        levels.append(("to do", f"{response.unfinished} levels; the same command goes on"))
    return levels


def identification_text(found: Identification) -> str:
    """What the measured resonances tell of a film, and how well they are fitted."""
    from nanorom.measurement.identify import CONFIDENCE
    from nanorom.measurement.unknowns import UNKNOWNS

    values = [
        (name, f"{value:.6g}", _interval(found.interval[name]), UNKNOWNS[name].unit)
        for name, value in found.value.items()
    ]
    lines = [
        (label, f"{measured:.9e}", f"{fitted:.9e}", f"{100 * difference:+.4f}")
        for label, measured, fitted, difference in zip(
            found.label, found.measured.frequency, found.fitted, found.difference
        )
    ]
    facts = [
        ("differences", f"{100 * found.noise:.3g} % (standard deviation)"),
        ("evaluations", str(found.evaluations)),
    ]
    parts = [
        _table([("found", "value", f"+- ({CONFIDENCE:.0%})", "unit"), *values]),
        _table([("mode", "measured", "fitted", "difference"), ("", "Hz", "Hz", "%"), *lines]),
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
    return _table([("odds", "chi^2", "noise %", *found.value, "modes"), *rows])


def _quality(model: ReducedModel, r: int) -> str:
    damping = model.damping[r, r]
    if damping == 0:
        return "-"
    return f"{model.mass[r] * 2 * np.pi * model.frequency[r] / damping:.6g}"


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


def _table(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(cell) for cell in column) for column in zip(*rows)]
    return "\n".join(
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths)).rstrip() for row in rows
    )


def _list(facts: Sequence[tuple[str, str]]) -> str:
    width = max(len(name) for name, _ in facts)
    return "\n".join(f"{name.ljust(width)}  {value}" for name, value in facts if value)
