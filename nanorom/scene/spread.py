"""Spreads: how far numbers of a scene may be off in a device that is made.

A quantity of a scene that is written "10 nm +- 3 %" has its mean for everybody; what it is off by,
one standard deviation, is kept in the scene's section [spread] by what it moves: the numbers of
the scene.  A stress moves both tensions, a thickness beside a stress the tensions, too.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.places import put
from nanorom.scene.units import of_any_dimension, to_si, wrong

MOVED = 1e-4  # of a deviation: numbers of a scene are smooth functions of what is written
_SPREAD = re.compile(r"(.+?)\s*(?:\+-|\+/-|±)\s*(.+)")
_PERCENT = re.compile(r"(.+?)\s*%")


@attrs.frozen
class Spread:
    """A mean and a standard deviation in SI; unit: "" for plain numbers."""

    mean: float
    deviation: float
    unit: str

    @classmethod
    def taken(cls, value: Any, key: str) -> Spread | None:
        """Of a text such as "10 nm +- 3 %" or "10 nm +- 0.3 nm", or None; raises SceneError."""
        match = _SPREAD.fullmatch(value.strip()) if isinstance(value, str) else None
        return None if match is None else cls.of(match[1], match[2], key)

    @classmethod
    def of(cls, mean: Any, deviation: Any, key: str) -> Spread:
        """Of a mean, and a deviation in per cent or of the same dimension; raises SceneError."""
        middle, unit = of_any_dimension(mean, key)
        share = _PERCENT.fullmatch(deviation.strip()) if isinstance(deviation, str) else None
        if share is not None:
            wide = abs(middle) * to_si(float(of_any_dimension(share[1], key)[0]), "1", key) / 100
        else:
            wide, other = of_any_dimension(deviation, key)
            if unit and other and unit != other:
                raise wrong(key, f"{mean} +- {deviation}", "quantities of one dimension")
            unit = unit or other
        if not wide > 0:
            raise wrong(key, deviation, "a deviation greater than 0")
        return cls(middle, wide, unit)


def _read(value: Any) -> dict[str, dict[str, float]]:
    key = "spread.deviation"
    if not isinstance(value, Mapping) or not all(isinstance(x, Mapping) for x in value.values()):
        raise wrong(key, value, "a table of tables, of numbers of the scene by what is written")
    return {
        str(source): {str(name): to_si(x, "1", f"{key}.{source}") for name, x in moved.items()}
        for source, moved in value.items()
    }


@attrs.frozen(field_transformer=v.readers)
class Spreads:
    """What numbers of a scene are off by; deviation: by what was written with +-, by number, SI."""

    deviation: Mapping[str, Mapping[str, float]] = attrs.field(
        metadata=v.custom(
            "spread.deviation",
            _read,
            allowed="written by the program",
            about='what each quantity that is written "10 nm +- 3 %" moves, by one standard '
            "deviation in SI, among the numbers of the scene",
        )
    )


def taken(document: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Spread]]:
    """A copy of a scene's tables with means alone, and the spreads by key; raises SceneError."""
    plain = copy.deepcopy(dict(document))
    found = {}
    for key, table, name in _texts(plain, ""):
        spread = Spread.taken(table[name], key)
        if spread is not None:
            found[key] = spread
            table[name] = f"{spread.mean!r} {spread.unit}".strip() if spread.unit else spread.mean
    return plain, found


def tables_of(scene: Any, written: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Tables of a scene in SI; with layers, which a scene has as one film, as they are written.

    written : tables that it was read from.
    """
    own = v.parse_toml(scene.to_toml())
    if written is None or "layer" not in written:
        return own
    settings = ("modes", "reduction", "accuracy")
    return taken(written)[0] | {name: own[name] for name in settings if name in own}


def _texts(table: Any, above: str) -> Iterator[tuple[str, Any, Any]]:
    """Key, table and name in it of every text."""
    if isinstance(table, dict):
        pairs = [(str(name), name, value) for name, value in table.items()]
    else:
        pairs = [(str(n + 1), n, value) for n, value in enumerate(table)]
    for shown, name, value in pairs:
        if isinstance(value, (dict, list)):
            yield from _texts(value, f"{above}{shown}.")
        elif isinstance(table, dict):
            yield f"{above}{shown}", table, name


def resolved(
    document: Mapping[str, Any], spreads: Mapping[str, Spread], read: Callable[[Any], Any]
) -> Spreads:
    """What numbers of a scene the spreads of its tables move; read: a scene of tables.

    Raises SceneError where something else moves than numbers.
    """
    found = {}
    for key, spread in spreads.items():
        ends = []
        for side in (1, -1):
            tables = copy.deepcopy(dict(document))
            put(tables, key, spread.mean + side * MOVED * spread.deviation, spread.unit)
            ends.append(numbers(read(tables)))
        moved = {name: (ends[0][name] - ends[1][name]) / (2 * MOVED) for name in ends[0]}
        found[key] = {name: change for name, change in moved.items() if change}
        if not found[key]:
            raise SceneError(f"{key}: found a spread of what is no number of the scene")
    return Spreads(found)


def spreads_of(scene: Any, given: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """What each spread of a scene, and each that is given for its numbers, moves among these.

    given: "3 %", or a deviation in its unit, by number of the scene, of both parts of "tension".
    Raises SceneError.
    """
    found = {} if scene.spread is None else {k: dict(x) for k, x in scene.spread.deviation.items()}
    known = numbers(scene)
    for key, value in given.items():
        names = [key] if key in known else []
        if key == "tension":
            names = [name for name in known if name.startswith("tension.") and known[name]]
        if not names:
            hint = v.did_you_mean(key, known)
            raise SceneError(f"spread: found {key!r}{hint}; allowed: {', '.join(known)}")
        found[key] = {name: _deviation(scene, name, known[name], value) for name in names}
    return found


def _deviation(scene: Any, name: str, mean: float, value: Any) -> float:
    section, _, field = name.partition(".")
    unit = getattr(attrs.fields(type(getattr(scene, section))), field).metadata.get("unit")
    whole = f"{mean!r} {unit}" if unit not in (None, "1") else mean
    return Spread.of(whole, value, f"spread.{name}").deviation


def numbers(scene: Any) -> dict[str, float]:
    """Every number of a scene's sections by its key."""
    found = {}
    for field in attrs.fields(type(scene)):
        section = getattr(scene, field.name)
        if attrs.has(type(section)):
            for each in attrs.fields(type(section)):
                value = getattr(section, each.name)
                if isinstance(value, float):
                    found[f"{field.name}.{each.name}"] = value
    return found


def moved(first: Any, second: Any) -> dict[str, float] | None:
    """What numbers two scenes differ by, second less first; None where they differ otherwise."""
    low, high = numbers(first), numbers(second)
    if low.keys() != high.keys():
        return None
    sections = {}
    for field in attrs.fields(type(first)):
        section = getattr(second, field.name)
        if attrs.has(type(section)):
            same = {n: low[f"{field.name}.{n}"] for n in _names(section, field.name, low)}
            sections[field.name] = attrs.evolve(section, **same)
    if attrs.evolve(second, **sections) != first:
        return None
    return {name: high[name] - low[name] for name in low if high[name] != low[name]}


def _names(section: Any, above: str, known: Mapping[str, float]) -> list[str]:
    return [f.name for f in attrs.fields(type(section)) if f"{above}.{f.name}" in known]
