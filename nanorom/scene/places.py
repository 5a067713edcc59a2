"""Places among the tables of a scene: keys such as plate.thickness and layer.2.thickness."""

from __future__ import annotations

from typing import Any

from nanorom.errors import SceneError
from nanorom.scene.units import of_any_dimension


def put(document: dict[str, Any], key: str, value: Any, unit: str = "") -> None:
    """Give a key of a scene's tables a value, a number in an SI unit; raises SceneError."""
    *path, name = key.split(".")
    if not path:
        raise SceneError(f"{key}: found no section; allowed: keys such as plate.thickness")
    table: Any = document
    for part in path:
        if isinstance(table, list):
            if not part.isdigit() or not 1 <= int(part) <= len(table):
                raise SceneError(f"{key}: found {part}; allowed: 1 to {len(table)}")
            table = table[int(part) - 1]
        else:
            table = table.setdefault(part, {})
        if not isinstance(table, (dict, list)):
            raise SceneError(f"{key}: {part} has a value, not keys of its own")
    if isinstance(table, list) and not isinstance(look(document, key), float):
        raise SceneError(f"{key}: {path[-1]} are several; give a number, {path[-1]}.1")
    place = int(name) - 1 if isinstance(table, list) else name
    table[place] = f"{value!r} {unit}" if isinstance(value, float) and unit else value


def look(document: dict[str, Any], key: str) -> Any:
    """What stands at a key of a scene's tables, or None."""
    table: Any = document
    for part in key.split("."):
        if isinstance(table, list) and part.isdigit() and 1 <= int(part) <= len(table):
            table = table[int(part) - 1]
        elif isinstance(table, dict) and part in table:
            table = table[part]
        else:
            return None
    return table


def amounts(table: Any, above: str = "") -> dict[str, float]:
    """Numbers other than 0 in some tables, in SI, by their keys; whole ones are counts."""
    if isinstance(table, dict):
        pairs = [(str(name), each) for name, each in table.items()]
    elif isinstance(table, list):
        pairs = [(str(n), each) for n, each in enumerate(table, 1)]
    else:
        value = _amount(table, above)
        return {above: value} if value else {}
    found: dict[str, float] = {}
    for name, each in pairs:
        found |= amounts(each, f"{above}.{name}" if above else name)
    return found


def _amount(value: Any, key: str) -> float:
    """A number in SI, 0 of what is none."""
    if isinstance(value, float):
        return value
    try:
        return of_any_dimension(value, key)[0] if isinstance(value, str) else 0.0
    except SceneError:  # a word
        return 0.0
