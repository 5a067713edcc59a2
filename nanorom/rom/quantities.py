"""Quantities of a model by the names that people give them: f1, m1, k2, b111, f2/f1.

A mode is its place in the model, from 1, or its name in brackets, f(f11c).  b112 is the paper's
coefficient of q1 q1 q2 in the equation of its first mode, b112@2 that in the equation of mode 2.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.rom.coefficients import Coefficients, place
from nanorom.rom.names import index_of
from nanorom.types import Array

UNITS = {"f": "Hz", "m": "kg", "k": "N/m", "b": "N/m^3", "J": "N", "P": "N/m"}
ALLOWED = "f1, m1, k1, b111, b112@2, J1.pressure, P11.tension, with names f(f11c), quotients f2/f1"
_NAME = re.compile(r"([fmkbJP])(?:(\d+)|\(([^)]*)\))(?:@(\w+))?(?:\.(\w+))?")


class Arrays(Protocol):
    """What a reduced model has of them; derivatives of them have it, too."""

    @property
    def frequency(self) -> Array: ...  # noqa: D102
    @property
    def mass(self) -> Array: ...  # noqa: D102
    @property
    def stiffness(self) -> Array: ...  # noqa: D102
    @property
    def cubic(self) -> Array: ...  # noqa: D102
    @property
    def drive(self) -> Mapping[str, Array]: ...  # noqa: D102
    @property
    def parametric(self) -> Mapping[str, Array]: ...  # noqa: D102


@attrs.frozen
class Quantity:
    """A number that arrays have, linear in them: its name, its unit, and how it is read off."""

    name: str
    unit: str
    of: Callable[[Arrays], float]


def quantities(name: str, labels: Sequence[str]) -> tuple[Quantity, ...]:
    """The quantity of a name, or the two of a quotient; raises ModelError."""
    return tuple(_quantity(part.strip(), labels, name) for part in name.split("/", 1))


def value(name: str, arrays: Arrays, labels: Sequence[str]) -> tuple[float, str]:
    """Of a name, in its unit, or that of a quotient, and the unit; raises ModelError."""
    first, *second = quantities(name, labels)
    if not second:
        return first.of(arrays), first.unit
    return first.of(arrays) / second[0].of(arrays), quotient(first.unit, second[0].unit)


def slope(name: str, arrays: Arrays, change: Arrays, labels: Sequence[str]) -> float:
    """Change of a named quantity with that of the arrays, in its unit; raises ModelError."""
    first, *second = quantities(name, labels)
    if not second:
        return first.of(change)
    lower = second[0].of(arrays)
    return first.of(change) / lower - first.of(arrays) / lower**2 * second[0].of(change)


def quotient(first: str, second: str) -> str:
    """Unit of a quotient."""
    return "1" if first == second else f"{first} / ({second})"


def _quantity(name: str, labels: Sequence[str], whole: str) -> Quantity:
    match = _NAME.fullmatch(name)
    if match is None:
        raise ModelError(f"of: found {whole!r}; allowed: {ALLOWED}")
    kind, digits, names, equation, pattern = match.groups()
    count = {"b": 3, "P": 2}.get(kind, 1)
    parts: list[str] = names.split(",") if names else [digits] if count == 1 else list(digits)
    if names and count == 1:
        parts = [names]  # its comma may be a part of it: f0,1
    if len(parts) != count or (equation and kind != "b") or bool(pattern) != (kind in "JP"):
        raise ModelError(f"of: found {whole!r}; allowed: {ALLOWED}")
    modes = [_place(labels, part, whole) for part in parts]
    if kind == "b":
        own = modes[0] if equation is None else _place(labels, equation, whole)
        indices = tuple(sorted(modes))
        return Quantity(
            name, UNITS[kind], lambda a: Coefficients(a.cubic[own - 1], labels)[indices]
        )
    at = tuple(mode - 1 for mode in modes)
    readers: dict[str, Callable[[Arrays], Array]] = {
        "f": lambda a: a.frequency,
        "m": lambda a: a.mass,
        "k": lambda a: np.diag(a.stiffness),
        "J": lambda a: _pattern(a.drive, pattern, whole),
        "P": lambda a: _pattern(a.parametric, pattern, whole),
    }
    return Quantity(name, UNITS[kind], lambda a: float(readers[kind](a)[at]))


def _place(labels: Sequence[str], part: str, whole: str) -> int:
    part = part.strip()
    if index_of(labels, part) is not None:
        return place(labels, part, f"of: {whole}")
    if not part.isdigit():
        raise ModelError(
            f"of: found {whole!r}; allowed modes: 1 to {len(labels)}, or {', '.join(labels)}"
        )
    return place(labels, int(part), f"of: {whole}")


def _pattern(patterns: Mapping[str, Array], name: str, whole: str) -> Array:
    if name not in patterns:
        raise ModelError(f"of: found {whole!r}; allowed patterns: {', '.join(patterns)}")
    return patterns[name]
