"""Places among the tables of a scene: keys such as plate.thickness and layer.2.thickness."""

from __future__ import annotations

from typing import Any

from nanorom.errors import SceneError


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
    if not isinstance(table, dict):
        raise SceneError(f"{key}: {path[-1]} are several; give a number, {path[-1]}.1")
    table[name] = f"{value!r} {unit}" if isinstance(value, float) and unit else value


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
