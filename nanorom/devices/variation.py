"""What a study varies: values of a grid for a key of a scene, or a distribution to draw from."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import attrs
import numpy as np
from scipy.special import ndtri

from nanorom.scene import fields as v
from nanorom.scene.places import look, put
from nanorom.scene.spread import Spread
from nanorom.scene.units import of_any_dimension, wrong
from nanorom.types import Array

SPAN = ("from", "to", "count", "spacing")
SPREAD = ("mean", "deviation")
SPACINGS = ("linear", "log")
MOST = 100_000  # rows of a study
OUTERMOST = 1e-12  # probability on either side of a normal distribution that is not drawn
ALLOWED = (
    "a list of values, { from, to, count } for a grid, { from, to } or { mean, deviation } to draw "
    'from, or "10 nm +- 3 %"'
)
_QUANTITY = re.compile(r"\s*[+-]?\.?\d")

# ways to say one thing: a key of a section takes the place of these others
INSTEAD = {
    "tension.value": ("x", "y", "xy", "stress"),
    "tension.stress": ("value", "x", "y", "xy"),
    "accuracy.tolerance": ("degree", "mesh_size"),
    "modes.count": ("select",),
    "modes.select": ("count",),
}


@attrs.frozen(eq=False)
class Variation:
    """What one key of a scene takes.

    unit: in SI, "" where none was given; values: of a grid, numbers in SI or whatever else a scene
    has there; quantile: of a distribution, from a probability (n,) to numbers (n,) in SI; ends:
    between which it is even, in SI.
    """

    key: str
    unit: str
    values: tuple[Any, ...] = ()
    quantile: Callable[[Array], Array] | None = None
    ends: tuple[float, float] | None = None

    def put(self, document: dict[str, Any], value: Any) -> None:
        """Give the key of a scene's tables a value; raises SceneError if there is no such place."""
        put(document, self.key, value, self.unit)
        *path, _ = self.key.split(".")
        table = look(document, ".".join(path))
        for other in INSTEAD.get(self.key, ()):
            table.pop(other, None)


def variations(given: Any) -> list[Variation]:
    """What a table of keys says, in its order; raises SceneError.

    Keys are "plate.thickness", or tables within tables.
    """
    if not isinstance(given, Mapping) or not given:
        raise wrong("vary", given, "a table of keys of a scene, such as plate.thickness")
    return [_variation(key, value) for key, value in _flat(given)]


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        nested = isinstance(value, Mapping) and not set(value) & {*SPAN, *SPREAD}
        if nested and value:
            yield from _flat(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def _variation(key: str, given: Any) -> Variation:
    if v.is_list(given) and not isinstance(given, Mapping):
        return _grid(key, list(np.asarray(given).tolist() if hasattr(given, "dtype") else given))
    spread = Spread.taken(given, f"vary.{key}")
    if isinstance(given, Mapping) and set(given) == set(SPREAD):
        spread = Spread.of(given["mean"], given["deviation"], f"vary.{key}")
    if spread is not None:
        return spread_of(key, spread)
    if isinstance(given, Mapping) and {"from", "to"} <= set(given) <= set(SPAN):
        return _span(key, given)
    raise wrong(f"vary.{key}", given, ALLOWED)


def _grid(key: str, given: list[Any]) -> Variation:
    if not given:
        raise wrong(f"vary.{key}", given, "at least one value")
    numbers = all(
        _QUANTITY.match(value) is not None
        if isinstance(value, str)
        else isinstance(value, (int, float)) and not isinstance(value, bool)
        for value in given
    )
    if not numbers or all(isinstance(value, int) for value in given):  # words, counts
        return Variation(key, "", tuple(given))
    values, unit = _numbers(key, given)
    return Variation(key, unit, tuple(values))


def _numbers(key: str, given: list[Any]) -> tuple[list[float], str]:
    """Quantities in SI, and the unit that all have."""
    read = [of_any_dimension(value, f"vary.{key}") for value in given]
    units = {unit for _, unit in read} - {""}  # plain numbers are in SI
    if len(units) > 1:
        raise wrong(f"vary.{key}", given, "quantities of one dimension")
    return [number for number, _ in read], "".join(units)


def _span(key: str, given: Mapping[str, Any]) -> Variation:
    (low, high), unit = _numbers(key, [given["from"], given["to"]])
    spacing = v.read_choice(given.get("spacing", "linear"), f"vary.{key}.spacing", SPACINGS)
    if spacing == "log" and min(low, high) <= 0:
        raise wrong(f"vary.{key}", dict(given), "ends greater than 0 with spacing = log")

    def between(share: Array) -> Array:
        if spacing == "log":
            return np.asarray(low ** (1 - share) * high**share)
        return np.asarray((1 - share) * low + share * high)

    if "count" not in given:
        return Variation(key, unit, quantile=between, ends=(low, high))
    count = v.read_integer(given["count"], f"vary.{key}.count", 2, MOST)
    return Variation(key, unit, tuple(between(np.linspace(0.0, 1.0, count)).tolist()))


def spread_of(key: str, spread: Spread) -> Variation:
    """What a key takes of a normal distribution."""

    def normal(share: Array) -> Array:
        tail = np.clip(share, OUTERMOST, 1 - OUTERMOST)
        return np.asarray(spread.mean + spread.deviation * ndtri(tail))

    return Variation(key, spread.unit, quantile=normal)
