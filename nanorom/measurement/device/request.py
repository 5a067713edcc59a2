"""What is asked of a fit of sweeps: names of unknowns, levels, read-out; what the rest then is."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.measurement.data import MeasuredResponse
from nanorom.measurement.sweeps.traces import level_ratio
from nanorom.measurement.unknowns import PAIR, UNKNOWNS, Unknown
from nanorom.scene.patterns import DIRECT
from nanorom.scene.scene import Scene
from nanorom.scene.units import to_si

# numbers beside the film's: whether they may be one for each mode, and their meaning
BESIDE = {
    "quality_factor": (True, "of all losses that go with the velocity"),
    "material_time": (False, "relaxation time of a viscous film: nonlinear damping"),
    "drive": (True, "force by level: a factor on the scene's pattern, or N per unit of a level"),
    "readout": (True, "amplitude as measured by the deflection"),
    "phase": (True, "what the instrument adds to phases, in rad; sought where they are measured"),
    "offset": (False, "what the instrument's frequencies are too high by, in Hz"),
}
EACH = "s"  # ends the name of an unknown that is one for each mode


@attrs.frozen(eq=False)
class Request:
    """What is sought and known.

    film: unknowns of the scene's film; beside: names of others, with whether each mode has its own;
    levels: level as in the file -> number that multiplies the drive; pattern: as of
    `parameters.Known`; unit: of a level, "" where it is a ratio or a plain number.
    """

    film: tuple[Unknown, ...]
    beside: dict[str, bool]
    levels: dict[str, float]
    pattern: str
    unit: str

    @classmethod
    def of(
        cls, scene: Scene, measured: MeasuredResponse, unknowns: Sequence[str] | None, modes: int
    ) -> Request:
        """Of names, usual ones if left out, for a number of modes; raises SceneError."""
        names = usual(scene, measured, modes) if unknowns is None else tuple(unknowns)
        film, beside = _read(names)
        measures_phase = all(trace.phase is not None for trace in measured.traces)
        if measures_phase:
            beside.setdefault("phase", True)
        elif "phase" in beside:
            raise SceneError(
                "unknowns: found phase without phases in all data; allowed: a column of them, or "
                "of both quadratures, in every file"
            )
        if measured.unit != "m" and "readout" not in beside:
            raise SceneError(
                f"unknowns: found amplitudes in {measured.unit or 'no unit'} without readout; "
                "allowed: readout or readouts among the unknowns, or lengths"
            )
        if "quality_factor" not in beside and not (scene.damping and scene.damping.quality_factor):
            raise SceneError(
                "damping.quality_factor: missing; allowed: [damping] in the scene, or "
                "quality_factor among the unknowns"
            )
        given = list(dict.fromkeys(trace.level for trace in measured.traces))
        pattern = "" if beside.get("drive") or scene.drive is None else scene.drive.direct_pattern
        unit = DIRECT[pattern].unit if pattern in DIRECT else ""
        absolute = _levels_in(given, unit) if unit else None
        if absolute is None and "drive" not in beside:
            own = f"levels in {unit}" if unit else "a [drive] in the scene, which tells their unit"
            raise SceneError(
                f"unknowns: found levels {', '.join(map(repr, given[:3]))} without drive; allowed: "
                f"drive or drives among the unknowns, or {own}"
            )
        if "drive" in beside and not pattern and not beside["drive"] and modes > 1:
            raise SceneError(
                "unknowns: found drive for several modes of a scene without [drive]; allowed: "
                "drives, one for each mode, or a pattern in [drive]"
            )
        levels, unit = (absolute, unit) if absolute is not None else _ratios(given)
        return cls(film, beside, levels, pattern, unit)


def usual(scene: Scene, measured: MeasuredResponse, modes: int) -> tuple[str, ...]:
    """What is sought if nothing is said."""
    same = scene.tension.x == scene.tension.y
    film = ("tension",) if same or modes == 1 else PAIR
    found = [*film, "youngs_modulus", "quality_factor" + EACH]
    pattern = "" if scene.drive is None else scene.drive.direct_pattern
    given = [trace.level for trace in measured.traces]
    if not pattern or pattern not in DIRECT or _levels_in(given, DIRECT[pattern].unit) is None:
        found.append("drive" + EACH)
    if measured.unit != "m":
        found.append("readout" + EACH)
    return tuple(found)


def _read(names: Sequence[str]) -> tuple[tuple[Unknown, ...], dict[str, bool]]:
    allowed = [n for n in UNKNOWNS if n not in BESIDE]
    allowed += [n + end for n, (each, _) in BESIDE.items() for end in ("", EACH)[: 1 + each]]
    film, beside = [], dict[str, bool]()
    for name in names:
        if name not in allowed:
            raise SceneError(f"unknowns: found {name!r}; allowed: {', '.join(allowed)}")
        if name in UNKNOWNS and name not in BESIDE:
            film.append(UNKNOWNS[name])
            continue
        own = name if name in BESIDE else name[: -len(EACH)]
        if own in beside:
            raise SceneError(f"unknowns: found {own} twice; give one of {own}, {own}{EACH}")
        beside[own] = name != own
    for i, unknown in enumerate(film):
        for other in film[:i]:
            if set(unknown.sets) & set(other.sets):
                raise SceneError(f"unknowns: found {other.name} beside {unknown.name}; give one")
        if not unknown.key:
            raise SceneError(f"unknowns: found {unknown.name}, by which no model has derivatives")
    return tuple(film), beside


def _levels_in(levels: Sequence[str], unit: str) -> dict[str, float] | None:
    """Levels in SI if all are quantities of a unit."""
    found = {}
    for level in levels:
        try:
            found[level] = to_si(level, unit, "level")
        except SceneError:  # of another dimension: then levels are ratios
            return None
    plain = [level for level in levels if level.replace(".", "").strip("+-").isdigit()]
    return None if plain else found  # a number without a unit is a ratio, too


def _ratios(levels: Sequence[str]) -> tuple[dict[str, float], str]:
    """Levels by the largest of all, as amplitudes; raises SceneError."""
    found = {level: 1.0 if len(levels) == 1 else level_ratio(level) for level in levels}
    for level, value in found.items():
        if value is None or not value > 0 or not np.isfinite(value):
            raise SceneError(
                f"level: found {level!r}; allowed: numbers greater than 0, with a unit such as "
                "dBm, mV, Pa, which the force goes with"
            )
    largest = max(float(v) for v in found.values() if v is not None)
    top = next(level for level, value in found.items() if value == largest)
    return {level: float(v or 0.0) / largest for level, v in found.items()}, top
