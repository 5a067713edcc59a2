"""Quantities of a model by the names that people give them: f1, m1, k2, b111, Q1, beta1, f2/f1.

A mode is its place in the model, from 1, or its name in brackets, f(f11c).  b112 is the paper's
coefficient of q1 q1 q2 in the equation of its first mode, b112@2 that in the equation of mode 2.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.rom.coefficients import Coefficients, place
from nanorom.rom.manifold import coefficients as effective
from nanorom.rom.names import index_of
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.rom.model import ReducedModel


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
class Kind:
    """What a letter stands for: its unit, how many modes it names, and what it is.

    array: it is an entry of an array, in which it is linear; else it follows from a whole model.
    """

    unit: str
    modes: int
    read: Callable[..., float]
    array: bool = True
    example: str = ""


@attrs.frozen
class Quantity:
    """A number of a model: its name, its unit, and how it is read off.

    linear: in the arrays, so that derivatives of these give its own.
    """

    name: str
    unit: str
    linear: bool
    of: Callable[[Any], float]


def quality_factor(model: ReducedModel, mode: int) -> float:
    """omega m / c of a mode by its place from 0; raises ModelError without damping."""
    damping = float(model.damping[mode, mode])
    if not damping > 0:
        raise ModelError("Q: the model has no damping; give damping.quality_factor, or losses")
    return 2 * np.pi * float(model.frequency[mode] * model.mass[mode]) / damping


def onset(model: ReducedModel, mode: int) -> float:
    """Amplitude in m at which bistability begins: a^2 = 8 k/(3 sqrt(3) Q |beta|).

    Of the Duffing oscillator with the effective coefficient; Postma et al. 2005,
    doi:10.1063/1.1929098.
    """
    k = float(model.mass[mode]) * (2 * np.pi * float(model.frequency[mode])) ** 2
    cubic = abs(effective.oscillator(model, mode).cubic)
    square = 8 * k / (3 * np.sqrt(3) * quality_factor(model, mode) * cubic) if cubic else np.inf
    return float(np.sqrt(square))


def _shift(model: ReducedModel, mode: int, other: int) -> float:
    return effective.shift(model, mode, other) / (2 * np.pi)


def _of_state(name: str) -> Callable[[ReducedModel], float]:
    def read(model: ReducedModel) -> float:
        if name not in model.static:
            raise ModelError(f"of: the model has no {name}; its film is flat, without a load")
        return float(model.static[name])

    return read


KINDS = {
    "f": Kind("Hz", 1, lambda a, r: float(a.frequency[r])),
    "m": Kind("kg", 1, lambda a, r: float(a.mass[r])),
    "k": Kind("N/m", 1, lambda a, r: float(a.stiffness[r, r])),
    "b": Kind("N/m^3", 3, lambda a, *_: np.nan, example="b111, b112@2"),  # of an equation, below
    "J": Kind("N", 1, lambda a, r: float(a[r]), example="J1.pressure"),
    "P": Kind("N/m", 2, lambda a, r, s: float(a[r, s]), example="P11.tension"),
    "Q": Kind("1", 1, quality_factor, array=False),
    "beta": Kind("N/m^3", 1, lambda a, r: effective.oscillator(a, r).cubic, array=False),
    "delta": Kind("N/m^5", 1, lambda a, r: effective.oscillator(a, r).quintic, array=False),
    "eta": Kind("N s/m^3", 1, lambda a, r: effective.oscillator(a, r).damping, array=False),
    "chi": Kind("Hz/m^2", 2, _shift, array=False, example="chi12"),
    "onset": Kind("m", 1, onset, array=False),
    "deflection": Kind("m", 0, _of_state("largest_deflection"), False, "deflection"),
    "mean_tension": Kind("N/m", 0, _of_state("mean_tension"), False, "mean_tension"),
}
PATTERNS = {"J": "drive", "P": "parametric"}
_EXAMPLES = ", ".join(kind.example or f"{name}1" for name, kind in KINDS.items())
ALLOWED = f"{_EXAMPLES}, with names f(f11c), quotients f2/f1"
_INSIDE = r"(?:[^()]|\([^()]*\))*"  # names of modes may have brackets of their own, f((1,1))
_BARE = "|".join(f"(?<={name})" for name, kind in KINDS.items() if kind.modes == 0)
NAME = rf"({'|'.join(KINDS)})(?:(\d+)|\(({_INSIDE})\)|{_BARE})(?:@(\w+))?(?:\.(\w+))?"
_NAME = re.compile(NAME)
_COMMA = re.compile(r",(?![^()]*\))")


def check_names(names: Sequence[str]) -> None:
    """Raise ModelError for what is no name of a quantity, or quotient of two, of any model."""
    for name in names:
        if not all(_NAME.fullmatch(part.strip()) for part in name.split("/", 1)):
            raise ModelError(f"of: found {name!r}; allowed: {ALLOWED}")


def quantities(name: str, labels: Sequence[str]) -> tuple[Quantity, ...]:
    """The quantity of a name, or the two of a quotient; raises ModelError."""
    return tuple(_quantity(part.strip(), labels, name) for part in name.split("/", 1))


def value(name: str, model: Arrays, labels: Sequence[str]) -> tuple[float, str]:
    """Of a name, in its unit, or that of a quotient, and the unit; raises ModelError."""
    first, *second = quantities(name, labels)
    if not second:
        return first.of(model), first.unit
    return first.of(model) / second[0].of(model), quotient(first.unit, second[0].unit)


def slope(name: str, arrays: Arrays, change: Arrays, labels: Sequence[str]) -> float:
    """Change of a quantity that is linear, with that of the arrays, in its unit; or of a quotient.

    Raises ModelError.
    """
    first, *second = quantities(name, labels)
    if not second:
        return first.of(change)
    lower = second[0].of(arrays)
    return first.of(change) / lower - first.of(arrays) / lower**2 * second[0].of(change)


def unit_of(name: str) -> str:
    """Unit of a name that is that of a single quantity, "" of another text."""
    match = _NAME.fullmatch(name)
    return "" if match is None else KINDS[match[1]].unit


def linear(name: str, labels: Sequence[str]) -> bool:
    """Whether a quantity, or both of a quotient, are entries of arrays; raises ModelError."""
    return all(quantity.linear for quantity in quantities(name, labels))


def quotient(first: str, second: str) -> str:
    """Unit of a quotient."""
    return "1" if first == second else f"{first} / ({second})"


def _quantity(name: str, labels: Sequence[str], whole: str) -> Quantity:
    match = _NAME.fullmatch(name)
    if match is None:
        raise ModelError(f"of: found {whole!r}; allowed: {ALLOWED}")
    letter, digits, names, equation, pattern = match.groups()
    kind = KINDS[letter]
    parts: list[str] = [digits] if digits and kind.modes == 1 else list(digits or "")
    if names is not None:
        split = kind.modes > 1  # a comma may be a part of a single name: f0,1
        parts = [part.strip() for part in _COMMA.split(names)] if split else [names]
    aimed = letter in PATTERNS
    if len(parts) != kind.modes or (equation and letter != "b") or bool(pattern) != aimed:
        raise ModelError(f"of: found {whole!r}; allowed: {ALLOWED}")
    modes = [_place(labels, part, whole) for part in parts]
    if letter == "b":
        own = modes[0] if equation is None else _place(labels, equation, whole)
        indices = tuple(sorted(modes))
        return Quantity(
            name, kind.unit, True, lambda a: Coefficients(a.cubic[own - 1], labels)[indices]
        )
    at = tuple(mode - 1 for mode in modes)
    if aimed:
        return Quantity(
            name,
            kind.unit,
            True,
            lambda a: kind.read(_pattern(getattr(a, PATTERNS[letter]), pattern, whole), *at),
        )
    return Quantity(name, kind.unit, kind.array, lambda a: kind.read(a, *at))


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
