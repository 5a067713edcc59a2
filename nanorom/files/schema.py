"""What a result holds, declared once beside the field that holds it.

A result is an attrs class.  The metadata of a field say what it is: an array with its axes, its
unit and its meaning, a family of arrays, a part with fields of its own, or a note.  Checks,
the selection of modes, reading and writing (`nanorom.files.stored`), the tables of the
documentation and the repr all follow from that declaration:

    cubic: Array = attrs.field(
        converter=as_tensor, metadata=array("L, L, L, L", "N/m^3", "B", symmetry=POTENTIAL)
    )
    outside_cubic: Array | None = attrs.field(  # a default of None: the file may lack it
        default=None, converter=as_optional, metadata=array(..., path="outside/cubic")
    )
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import ModelError

SCHEMA = "schema"  # key of a field's metadata
# what lengths count
AXES = {
    "L": "modes",
    "K": "modes outside",
    "N": "modes of the larger model",
    "S": "thermal modes",
    "P": "points",
    "C": "triangles",
    "n": "rows",
    "g": "growths",
    "M": "multipliers, 2 L and those of states of first order",
    "t": "parts",
    "p": "keys",
    "q": "quantities",
    "s": "searches",
    "d": "spreads",
}
SYMMETRIC = "symmetric"
POTENTIAL = "symmetric in all indices"  # a force that derives from a potential
KINDS = {"number": "fiu", "whole": "iu", "complex": "fc", "flag": "ub", "name": "OSU"}

Lengths = dict[str, int]  # of the axes that are known


class Source(Protocol):
    """Where the content of a result is taken from: a file, or another result."""

    def has(self, path: str) -> bool:
        """Whether there is an array or a group at a path."""

    def names(self, path: str) -> list[str]:
        """Members of a group."""

    def array(self, path: str, item: Item) -> Any:
        """An array."""

    def note(self, path: str, kind: str) -> Any:
        """A text, or facts by name."""


class Sink(Protocol):
    """Where the content of a result is put."""

    def group(self, path: str) -> None:
        """Begin a group, which may stay empty."""

    def array(self, path: str, item: Item, value: Any) -> None:
        """Put an array."""

    def note(self, path: str, kind: str, value: Any) -> None:
        """Put a text, or facts by name."""


def _axes(words: str | tuple[str, ...]) -> tuple[str, ...]:
    if isinstance(words, tuple):
        return words
    return tuple(word.strip() for word in words.split(",") if word.strip())


@attrs.frozen
class Item:
    """One array: axes by the letter of their length ("L, 2L", "P, 3"; none for a number).

    kind: a key of KINDS; finite: NaN and infinity are refused; optional: the file may lack it;
    path: where it is in a file, by default under the field's name.
    """

    axes: tuple[str, ...] = attrs.field(converter=_axes)
    unit: str
    meaning: str
    kind: str = "number"
    symmetry: str = ""
    finite: bool = True
    optional: bool = False
    path: str = ""

    def shape(self, lengths: Mapping[str, int]) -> tuple[int | None, ...]:
        """The shape that it must have, None where any length will do."""
        return tuple(_length(axis, lengths) for axis in self.axes)

    def fit(self, path: str, shape: Sequence[int], lengths: Lengths) -> None:
        """Raise ModelError unless a shape fits; note the lengths that it is the first to have."""
        expect_shape(path, shape, self.shape(lengths))
        for axis, length in zip(self.axes, shape):
            if axis.isalpha():
                lengths.setdefault(axis, length)
        expect_shape(path, shape, self.shape(lengths))

    def give(self, path: str, value: Any, sink: Sink) -> None:
        if value is not None:
            sink.array(path, self, value)

    def take(self, path: str, source: Source) -> Any:
        return None if self.optional and not source.has(path) else source.array(path, self)

    def items(self, path: str) -> Iterator[tuple[str, Item]]:
        yield path, self


@attrs.frozen
class Family:
    """Arrays of one kind, by names that are free."""

    item: Item
    path: str = ""

    def give(self, path: str, value: Mapping[str, Any], sink: Sink) -> None:
        if value or not self.item.optional:
            sink.group(path)
        for name, array in value.items():
            sink.array(f"{path}/{name}", self.item, array)

    def take(self, path: str, source: Source) -> dict[str, Any]:
        if self.item.optional and not source.has(path):
            return {}
        return {name: source.array(f"{path}/{name}", self.item) for name in source.names(path)}

    def items(self, path: str) -> Iterator[tuple[str, Item]]:
        yield f"{path}/NAME", self.item


@attrs.frozen
class Members:
    """Arrays by names that are known, each of which may be missing."""

    known: Mapping[str, Item]
    path: str = ""

    def give(self, path: str, value: Mapping[str, Any], sink: Sink) -> None:
        for name, array in value.items():
            if name not in self.known:
                raise ModelError(f"{path}: found {name!r}; allowed: {', '.join(self.known)}")
            sink.array(f"{path}/{name}", self.known[name], array)

    def take(self, path: str, source: Source) -> dict[str, Any]:
        paths = {name: f"{path}/{name}" for name in self.known}
        return {n: source.array(at, self.known[n]) for n, at in paths.items() if source.has(at)}

    def items(self, path: str) -> Iterator[tuple[str, Item]]:
        return ((f"{path}/{name}", item) for name, item in self.known.items())


@attrs.frozen
class Part:
    """A result within a result, which may be missing."""

    cls: type[Any]
    path: str = ""

    def give(self, path: str, value: Any, sink: Sink) -> None:
        if value is not None:
            give(value, sink, path)

    def take(self, path: str, source: Source) -> Any:
        return self.cls(**take(self.cls, source, path)) if source.has(path) else None

    def items(self, path: str) -> Iterator[tuple[str, Item]]:
        for name, entry in entries(self.cls).items():
            yield from entry.items(f"{path}/{entry.path or name}")


@attrs.frozen
class Note:
    """What is no array: "text", "number", "words" (texts by name) or "facts" (the same of any)."""

    kind: str
    meaning: str
    path: str = ""

    def give(self, path: str, value: Any, sink: Sink) -> None:
        sink.note(path, self.kind, value)

    def take(self, path: str, source: Source) -> Any:
        return source.note(path, self.kind)

    def items(self, path: str) -> Iterator[tuple[str, Item]]:
        return iter(())


Entry = Item | Family | Members | Part | Note


def array(axes: str, unit: str, meaning: str, **options: Any) -> dict[str, Any]:
    """Metadata of a field that is an array."""
    return {SCHEMA: Item(axes, unit, meaning, **options)}


def family(axes: str, unit: str, meaning: str, **options: Any) -> dict[str, Any]:
    """Metadata of a field that is a dictionary of arrays of one kind."""
    return {SCHEMA: Family(Item(axes, unit, meaning, **options))}


def members(known: Mapping[str, Item]) -> dict[str, Any]:
    """Metadata of a field that is a dictionary of arrays by known names."""
    return {SCHEMA: Members(known)}


def part(cls: type[Any]) -> dict[str, Any]:
    """Metadata of a field that is a result itself, or None."""
    return {SCHEMA: Part(cls)}


def note(kind: str, meaning: str) -> dict[str, Any]:
    """Metadata of a field that is no array."""
    return {SCHEMA: Note(kind, meaning)}


def renamed(metadata: Mapping[str, Any], axis: str, other: str) -> dict[str, Any]:
    """Metadata of an array, or of a dictionary of such, with another letter for an axis."""

    def item(own: Item) -> Item:
        return attrs.evolve(own, axes=tuple(other if a == axis else a for a in own.axes))

    entry = metadata[SCHEMA]
    if isinstance(entry, Family):
        return {SCHEMA: attrs.evolve(entry, item=item(entry.item))}
    return {SCHEMA: item(entry)}


def entries(cls: type[Any]) -> dict[str, Entry]:
    """What the fields of a class are, by name, in their order."""
    found: dict[str, Entry] = {}
    for field in attrs.fields(cls):
        entry = field.metadata.get(SCHEMA)
        if isinstance(entry, Item) and field.default is None:
            entry = attrs.evolve(entry, optional=True)
        if entry is not None:
            found[field.name] = entry
    return found


def give(content: Any, sink: Sink, under: str = "") -> None:
    """Put all that a result holds into a sink."""
    for name, entry in entries(type(content)).items():
        entry.give(_join(under, entry.path or name), getattr(content, name), sink)


def take(cls: type[Any], source: Source, under: str = "") -> dict[str, Any]:
    """Arguments of a result's class from a source."""
    return {
        name: entry.take(_join(under, entry.path or name), source)
        for name, entry in entries(cls).items()
    }


class Leaf(NamedTuple):
    """An array of a result: where it is, what it is, and its value."""

    path: str
    item: Item
    value: Any


def leaves(content: Any, under: str = "") -> list[Leaf]:
    """All arrays of a result."""
    found = _Leaves()
    give(content, found, under)
    return found.leaves


def check(content: Any, under: str = "") -> None:
    """Raise ModelError unless the arrays of a result fit together and are finite."""
    lengths: Lengths = {}
    for path, item, value in leaves(content, under):
        if item.kind == "name":
            _check_names(path, item, value, lengths)
            continue
        item.fit(path, value.shape, lengths)
        if item.finite:
            expect_finite(path, value)


def expect_shape(path: str, found: Sequence[int], shape: tuple[int | None, ...]) -> None:
    """Raise ModelError unless a shape is the expected one, in which None is any length."""
    if len(found) != len(shape) or any(
        wanted not in (None, length) for wanted, length in zip(shape, found)
    ):
        wanted = ", ".join("any" if length is None else str(length) for length in shape)
        wanted += "," * (len(shape) == 1)
        raise ModelError(f"{path}: found shape {tuple(found)}; expected ({wanted})")


def expect_finite(path: str, array: NDArray[Any]) -> None:
    """Raise ModelError if an array has an entry that is NaN or infinite."""
    if not np.isfinite(array).all():
        raise ModelError(f"{path}: contains NaN or infinite entries")


def picked(content: Any, axis: str, places: Sequence[int]) -> dict[str, Any]:
    """The fields that have an axis, of the places (0-based) along it alone."""
    source = _Picked({leaf.path: leaf for leaf in leaves(content)}, axis, np.array(places))
    return {
        name: entry.take(entry.path or name, source)
        for name, entry in entries(type(content)).items()
        if any(axis == _parse(own)[1] for _, item in entry.items(name) for own in item.axes)
    }


def _check_names(path: str, item: Item, value: Sequence[str], lengths: Lengths) -> None:
    (expected,) = item.shape(lengths)
    if expected is not None and len(value) != expected:
        counted = AXES.get(item.axes[0], "rows")
        raise ModelError(f"{path}: found {len(value)} names for {expected} {counted}")


def _length(axis: str, lengths: Mapping[str, int]) -> int | None:
    factor, letter = _parse(axis)
    if not letter:
        return factor
    return factor * lengths[letter] if letter in lengths else None


def _parse(axis: str) -> tuple[int, str]:
    """Factor and letter of the length of an axis such as "3", "L" or "2L"."""
    letter = axis.lstrip("0123456789")
    return int(axis[: len(axis) - len(letter)] or 1), letter


def _join(under: str, name: str) -> str:
    return f"{under}/{name}" if under else name


class _Leaves:
    """A sink that keeps the arrays."""

    def __init__(self) -> None:
        self.leaves: list[Leaf] = []

    def group(self, path: str) -> None:
        pass

    def array(self, path: str, item: Item, value: Any) -> None:
        self.leaves.append(Leaf(path, item, value))

    def note(self, path: str, kind: str, value: Any) -> None:
        pass


@attrs.frozen
class _Picked:
    """Some places along one axis of another result."""

    known: Mapping[str, Leaf]
    axis: str
    places: NDArray[np.intp]

    def has(self, path: str) -> bool:
        return any(known == path or known.startswith(f"{path}/") for known in self.known)

    def names(self, path: str) -> list[str]:
        return [known[len(path) + 1 :] for known in self.known if known.startswith(f"{path}/")]

    def array(self, path: str, item: Item) -> Any:
        value = self.known[path].value
        if item.kind == "name":
            return [value[place] for place in self.places]
        for number, axis in enumerate(item.axes):
            factor, letter = _parse(axis)
            if letter == self.axis:  # "2L": as many blocks of all modes
                blocks = np.arange(factor) * (value.shape[number] // factor)
                value = value.take((blocks[:, None] + self.places).ravel(), axis=number)
        return value

    def note(self, path: str, kind: str) -> Any:
        # never asked for: `picked` takes entries that have an axis, and no note has one
        raise NotImplementedError("notes have no axes")
