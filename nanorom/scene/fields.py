"""Validated attrs fields and the way between TOML tables and classes made of them.

A section is a frozen attrs class; each field knows its full key ("material.density") and checks
its own value, so a scene from a file and one written in Python meet the same rules and messages.
"""

from __future__ import annotations

import difflib
import json
import numbers
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

import attrs

from nanorom.errors import SceneError
from nanorom.scene.units import to_si, wrong
from nanorom.types import Array

Section = TypeVar("Section")
Limit = tuple[str, Callable[[float], bool]]

POSITIVE: Limit = ("greater than 0", lambda x: x > 0)
NOT_NEGATIVE: Limit = ("0 or more", lambda x: x >= 0)
SHARE: Limit = ("0 or more and less than 1", lambda x: 0 <= x < 1)
ANY: Limit = ("any", lambda x: True)

OPTIONAL = {"optional": True}  # metadata of a field that may be None, whatever its default
TABLES = "tables"  # key of a field's metadata: the name of its array of tables
READER = "read"  # key of a field's metadata: the function that checks what is given
LARGEST_FILE = 1_000_000  # bytes of a TOML file; a larger one is something else


def within(low: float, high: float) -> Limit:
    """Strictly between two numbers."""
    return f"greater than {low:g} and less than {high:g}", lambda x: low < x < high


def read_quantity(value: Any, unit: str, key: str, limit: Limit = ANY) -> float:
    """A quantity in SI within its limit; raises SceneError."""
    number = to_si(value, unit, key)
    if not limit[1](number):
        raise wrong(key, value, limit[0])
    return number


def read_quantities(value: Any, unit: str, key: str, limit: Limit = ANY) -> tuple[float, ...]:
    """One quantity or a list of them, as a tuple; raises SceneError."""
    if not is_list(value):
        return (read_quantity(value, unit, key, limit),)
    if len(value) == 0:
        raise wrong(key, list(value), "at least one value")
    return tuple(read_quantity(v, unit, f"{key}[{n}]", limit) for n, v in enumerate(value, 1))


def read_place(value: Any, key: str) -> tuple[float, float]:
    """A list of x and y in m; raises SceneError."""
    if not is_list(value) or len(value) != 2:
        raise wrong(key, value, "a list of two lengths, x and y")
    x, y = (read_quantity(each, "m", key) for each in value)
    return x, y


def read_integer(value: Any, key: str, low: int, high: int) -> int:
    """An integer from low to high; raises SceneError."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise wrong(key, value, f"an integer from {low} to {high}")
    number = int(value)
    if not low <= number <= high:
        raise wrong(key, number, f"{low} to {high}")
    return number


def read_choice(value: Any, key: str, options: Iterable[str]) -> str:
    """One of the options; raises SceneError with the nearest one."""
    options = list(options)
    if not isinstance(value, str) or value not in options:
        raise wrong(key, value, " | ".join(options) + did_you_mean(value, options))
    return value


def is_list(value: Any) -> bool:
    """Lists, tuples and arrays, but not strings."""
    return not isinstance(value, str) and hasattr(value, "__len__") and hasattr(value, "__iter__")


def did_you_mean(found: Any, allowed: Iterable[str]) -> str:
    """A hint at the nearest allowed word, or nothing."""
    near = difflib.get_close_matches(str(found), list(allowed), n=1)
    return f' (did you mean "{near[0]}"?)' if near else ""


# -- what fields are given as, for type checkers ---------------------------------------------------


class WithUnits(Protocol):
    """A number with units, as of pint."""

    @property
    def magnitude(self) -> Any: ...

    @property
    def units(self) -> Any: ...


Quantity = str | float | WithUnits  # "2.5 um", or a number in SI


def as_quantity(value: Quantity) -> float:
    """A quantity, in SI. As all of these, `readers` puts the reader of the field in its place."""
    raise _unread()


def as_optional_quantity(value: Quantity | None) -> float | None:
    """A quantity, in SI, or None."""
    raise _unread()


def as_quantities(value: Quantity | Sequence[Quantity] | Array) -> tuple[float, ...]:
    """One quantity or several, in SI."""
    raise _unread()


def as_optional_quantities(
    value: Quantity | Sequence[Quantity] | Array | None,
) -> tuple[float, ...] | None:
    """One quantity or several, in SI, or None."""
    raise _unread()


def as_path(value: str | Path) -> Path:
    """The name of a file."""
    raise _unread()


def as_optional_path(value: str | Path | None) -> Path | None:
    """The name of a file, or None."""
    raise _unread()


def as_optional_integers(value: Sequence[int] | None) -> tuple[int, ...] | None:
    """Integers, or None."""
    raise _unread()


def _unread() -> TypeError:
    return TypeError("a class of fields needs @attrs.frozen(field_transformer=fields.readers)")


# -- what fields are; about: what a key means, for the reference ----------------------------------


def quantity(key: str, unit: str, limit: Limit = POSITIVE, about: str = "") -> dict[str, Any]:
    """Metadata of a field: a quantity, stored in SI."""
    return _metadata(key, lambda v: read_quantity(v, unit, key, limit), limit[0], about, unit)


def quantities(key: str, unit: str, limit: Limit = POSITIVE, about: str = "") -> dict[str, Any]:
    """Metadata of a field: a tuple of quantities, from one or from a list."""
    allowed = f"one or a list, {limit[0]}"
    return _metadata(key, lambda v: read_quantities(v, unit, key, limit), allowed, about, unit)


def place(key: str, about: str = "") -> dict[str, Any]:
    """Metadata of a field: x and y in m."""
    return _metadata(key, lambda v: read_place(v, key), "a list of two lengths", about)


def integer(key: str, low: int, high: int, about: str = "") -> dict[str, Any]:
    """Metadata of a field: an integer from low to high."""
    return _metadata(key, lambda v: read_integer(v, key, low, high), f"{low} to {high}", about)


def choice(key: str, allowed: Iterable[str], about: str = "") -> dict[str, Any]:
    """Metadata of a field: one word of several."""
    return _metadata(key, lambda v: read_choice(v, key, allowed), " | ".join(allowed), about)


def custom(
    key: str,
    read: Callable[[Any], Any],
    allowed: str = "",
    about: str = "",
    unit: str | None = None,
) -> dict[str, Any]:
    """Metadata of a field with its own reader, what that allows and the unit of what it gives."""
    return _metadata(key, read, allowed, about, unit)


def readers(cls: type, fields: list[Any]) -> list[Any]:
    """Transformer of the fields of a class: each gets the reader that its metadata hold.

    A field whose default is None, and one that is `OPTIONAL`, may be None.  The converters that the
    class names say only what may be given, so that type checkers know.
    """
    return [_with_reader(field) if READER in field.metadata else field for field in fields]


def _with_reader(field: Any) -> Any:
    read = field.metadata[READER]
    optional = field.default is None or field.metadata.get("optional")
    return field.evolve(converter=attrs.converters.optional(read) if optional else read)


def _metadata(
    key: str, read: Callable[[Any], Any], allowed: str, about: str, unit: str | None = None
) -> dict[str, Any]:
    name = key.rpartition(".")[2]
    return {"key": name, "unit": unit, "allowed": allowed, "about": about, READER: read}


def _fields(cls: Any) -> dict[str, Any]:
    return {f.metadata["key"]: f for f in attrs.fields(cls) if "key" in f.metadata}


def from_table(cls: type[Section], section: str, table: Any, **more: Any) -> Section:
    """Make a section from its TOML table; raises SceneError on unknown or missing keys.

    A key that Python calls otherwise ("from", an attribute ``start``) may have either name.
    """
    fields = _fields(cls)
    if isinstance(table, Mapping):
        table = _by_key(section, table, {f.name: key for key, f in fields.items() if f.name != key})
    check_keys(section, table, fields)
    for key, field in fields.items():
        if field.default is attrs.NOTHING and key not in table:
            raise SceneError(f"{section}.{key}: missing; allowed keys: {', '.join(fields)}")
    return cls(**{fields[key].name: value for key, value in table.items()}, **more)


def taken(cls: type[Section], section: str, given: Any, short: Callable[[Any], Section]) -> Section:
    """A section as it is, of a table of its keys, or of what ``short`` makes it of."""
    if isinstance(given, cls):
        return given
    return from_table(cls, section, given) if isinstance(given, Mapping) else short(given)


def _by_key(section: str, table: Mapping[str, Any], keys: dict[str, str]) -> dict[str, Any]:
    for name, key in keys.items():
        if name in table and key in table:
            raise SceneError(f"{section}.{name}: found beside {key}, which is the same")
    return {keys.get(name, name): value for name, value in table.items()}


def check_keys(section: str, table: Any, allowed: Iterable[str]) -> None:
    """Raise SceneError unless the table is one and has allowed keys only."""
    if not isinstance(table, Mapping):
        raise wrong(section, table, f"a table [{section}]")
    allowed = list(allowed)
    for key in table:
        if key not in allowed:
            hint = did_you_mean(key, allowed)
            raise SceneError(f"{section}.{key}: unknown key{hint}; allowed: {', '.join(allowed)}")


def parse_toml(text: str) -> dict[str, Any]:
    """A TOML document as a dictionary; raises SceneError."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        reason = str(error).splitlines()[0]
        if isinstance(error, RecursionError):
            reason = "nested too deeply"
        elif "integer string conversion" in reason:
            reason = "an integer of thousands of digits"
        raise SceneError(f"not valid TOML: {reason}") from None


def read_text(path: Path) -> str:
    """The text of a TOML file; raises SceneError if there is none."""
    try:
        if not path.exists():
            raise SceneError(f"{path}: no such file")
        if not path.is_file():
            raise SceneError(f"{path}: not a file")
        if path.stat().st_size > LARGEST_FILE:
            raise SceneError(f"{path}: larger than {LARGEST_FILE} bytes, not a scene file")
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise SceneError(f"{path}: not a text file (UTF-8)") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"{path}: cannot be read: {error}") from None


def to_tables(parts: Any) -> str:
    """TOML of an object whose fields are sections; those at None are left out.

    A tuple of sections is an array of tables, under the key that its field's metadata name.
    """
    lines = []
    for field in attrs.fields(type(parts)):
        section = getattr(parts, field.name)
        if isinstance(section, tuple):
            lines += [f"[[{field.metadata[TABLES]}]]\n{to_table(each)}\n" for each in section]
        elif section is not None:
            lines.append(f"[{field.name}]\n{to_table(section)}\n")
    return "\n".join(lines)


def to_table(section: Any) -> str:
    """TOML lines of a section's fields, units as comments, fields at None left out."""
    shape = getattr(section, "shape", None)
    lines = [f"shape = {to_toml_value(shape)}"] if shape else []
    for key, field in _fields(type(section)).items():
        value = getattr(section, field.name)
        if value is not None:
            unit = field.metadata["unit"]
            comment = f"  # {unit}" if unit not in (None, "1") else ""
            lines.append(f"{key} = {to_toml_value(value)}{comment}")
    return "\n".join(lines)


def to_toml_value(value: Any) -> str:
    """A value as TOML."""
    if attrs.has(type(value)) and _fields(type(value)):
        known = {"shape": getattr(value, "shape", None)}
        known |= {key: getattr(value, field.name) for key, field in _fields(type(value)).items()}
        value = {key: each for key, each in known.items() if each is not None}
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{to_toml_value(str(k))} = {to_toml_value(v)}" for k, v in value.items())
        return f"{{ {pairs} }}"
    if isinstance(value, tuple):
        return "[" + ", ".join(to_toml_value(v) for v in value) + "]"
    if isinstance(value, (int, float)):
        return repr(value)
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
