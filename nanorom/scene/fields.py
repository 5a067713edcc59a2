"""Validated attrs fields and the way between TOML tables and classes made of them.

A section is a frozen attrs class; each field knows its full key ("material.density") and checks
its own value, so a scene from a file and one written in Python meet the same rules and messages.
"""

from __future__ import annotations

import difflib
import json
import numbers
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import attrs

from nanorom.errors import SceneError
from nanorom.scene.units import to_si, wrong

Section = TypeVar("Section")
Limit = tuple[str, Callable[[float], bool]]

POSITIVE: Limit = ("greater than 0", lambda x: x > 0)
NOT_NEGATIVE: Limit = ("0 or more", lambda x: x >= 0)
ANY: Limit = ("any", lambda x: True)

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


def quantity(key: str, unit: str, limit: Limit = POSITIVE, **options: Any) -> Any:
    """Field: a quantity, stored in SI. With a default of None it may be left out.

    This and the other kinds of field take ``about``, what the key means, for the reference.
    """
    return _field(key, options, lambda v: read_quantity(v, unit, key, limit), unit, limit[0])


def quantities(key: str, unit: str, limit: Limit = POSITIVE, **options: Any) -> Any:
    """Field: a tuple of quantities, from one or from a list."""
    allowed = f"one or a list, {limit[0]}"
    return _field(key, options, lambda v: read_quantities(v, unit, key, limit), unit, allowed)


def integer(key: str, low: int, high: int, **options: Any) -> Any:
    """Field: an integer from low to high."""
    return _field(key, options, lambda v: read_integer(v, key, low, high), None, f"{low} to {high}")


def choice(key: str, allowed: Iterable[str], **options: Any) -> Any:
    """Field: one word of several."""
    return _field(key, options, lambda v: read_choice(v, key, allowed), None, " | ".join(allowed))


def custom(key: str, read: Callable[[Any], Any], allowed: str = "", **options: Any) -> Any:
    """Field with its own reader."""
    return _field(key, options, read, None, allowed)


def _field(
    key: str, options: dict[str, Any], read: Callable[[Any], Any], unit: str | None, allowed: str
) -> Any:
    about = options.pop("about", "")
    optional = options.get("default", attrs.NOTHING) is None
    return attrs.field(
        converter=attrs.converters.optional(read) if optional else read,
        metadata={
            "key": key.rpartition(".")[2],
            "unit": unit,
            "allowed": allowed,
            "about": about,
        },
        **options,
    )


def _fields(cls: Any) -> dict[str, Any]:
    return {f.metadata["key"]: f for f in attrs.fields(cls) if "key" in f.metadata}


def from_table(cls: type[Section], section: str, table: Any, **more: Any) -> Section:
    """Make a section from its TOML table; raises SceneError on unknown or missing keys."""
    fields = _fields(cls)
    check_keys(section, table, fields)
    for key, field in fields.items():
        if field.default is attrs.NOTHING and key not in table:
            raise SceneError(f"{section}.{key}: missing; allowed keys: {', '.join(fields)}")
    return cls(**{fields[key].name: value for key, value in table.items()}, **more)


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
    """TOML of an object whose fields are sections; those at None are left out."""
    sections = {field.name: getattr(parts, field.name) for field in attrs.fields(type(parts))}
    return "\n".join(
        f"[{name}]\n{to_table(section)}\n" for name, section in sections.items() if section
    )


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
        known = {key: getattr(value, field.name) for key, field in _fields(type(value)).items()}
        value = {key: each for key, each in known.items() if each is not None}
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{to_toml_value(str(k))} = {to_toml_value(v)}" for k, v in value.items())
        return f"{{ {pairs} }}"
    if isinstance(value, tuple):
        return "[" + ", ".join(to_toml_value(v) for v in value) + "]"
    if isinstance(value, (int, float)):
        return repr(value)
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
