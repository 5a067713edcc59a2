"""Tables, texts and docstrings of what a result holds, from its schema."""

from __future__ import annotations

import textwrap
from typing import Any, TypeVar

import numpy as np

from nanorom.files.schema import Family, Item, Members, Note, Part, entries, leaves

Class = TypeVar("Class", bound=type[Any])
HEAD = ("dataset", "shape", "unit", "meaning")
WIDTH = 96  # characters of a line of a docstring or a repr


def rows(cls: type[Any]) -> list[tuple[str, str, str, str]]:
    """Dataset, shape, unit and meaning of each array that a file of this class may hold, and of
    each of its notes.
    """
    table = []
    for name, entry in entries(cls).items():
        at = entry.path or name
        if isinstance(entry, Note):
            table.append(
                (at, "attributes" if entry.kind == "facts" else "attribute", "", entry.meaning)
            )
        table += [item_row(path, item) for path, item in entry.items(at)]
    return table


def item_row(path: str, item: Item) -> tuple[str, str, str, str]:
    """Dataset, shape, unit and meaning of one array."""
    more = [item.symmetry] if item.symmetry else []
    more += ["optional"] if item.optional else []
    meaning = item.meaning + (f" ({', '.join(more)})" if more else "")
    return path, shape_text(item), "" if item.unit == "1" else item.unit, meaning


def shape_text(item: Item) -> str:
    """The axes as a shape: "(L, L)"."""
    if not item.axes:
        return "number"
    return f"({', '.join(item.axes)}{',' * (len(item.axes) == 1)})"


def markdown(table: list[tuple[str, str, str, str]]) -> str:
    """A table of the rows in Markdown."""
    lines = [f"| {' | '.join(HEAD)} |", "|---|---|---|---|"]
    rows = [[cell.replace("|", r"\|") for cell in row] for row in table]
    lines += [f"| `{path}` | {shape} | {unit} | {text} |" for path, shape, unit, text in rows]
    return "\n".join(lines)


def documented(cls: Class) -> Class:
    """Class decorator: add what the fields are to the docstring, so that it is said once."""
    lines = ["", "    Parameters", "    ----------"]
    for name, entry in entries(cls).items():
        lines += _wrapped(f"{name} : {_said(entry)}")
    cls.__doc__ = (cls.__doc__ or "").rstrip() + "\n" + "\n".join(lines) + "\n"
    return cls


def shown(content: Any) -> list[str]:
    """A line for each array that a result holds: name, shape, unit and what it is."""
    lines = []
    for path, item, value in leaves(content):
        if item.kind != "name":
            shape = "x".join(map(str, np.shape(value))) or "number"
            lines.append((path, shape, "" if item.unit == "1" else item.unit, item.meaning))
    widths = [max((len(line[k]) for line in lines), default=0) for k in range(3)]
    heads = ["  ".join(c.ljust(w) for c, w in zip(line, widths)) for line in lines]
    return [
        f"{head}  {textwrap.shorten(line[3], WIDTH - len(head), placeholder=' ...')}".rstrip()
        for head, line in zip(heads, lines)
    ]


def _said(entry: Any) -> str:
    if isinstance(entry, Note):
        return entry.meaning
    if isinstance(entry, Part):
        return f"{entry.cls.__name__} or None"
    if isinstance(entry, Members):
        return "by name, " + "; ".join(f"{n} {_item(item)}" for n, item in entry.known.items())
    return f"by name, {_item(entry.item)}" if isinstance(entry, Family) else _item(entry)


def _item(item: Item) -> str:
    _, shape, unit, meaning = item_row("", item)
    return f"{shape} {unit}, {meaning}" if unit else f"{shape}, {meaning}"


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="    ", subsequent_indent="        ")
