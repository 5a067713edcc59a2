"""Rows of a benchmark that takes hours, written as they come: what was interrupted goes on."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TypeVar

import attrs

from nanorom.bench import report
from nanorom.errors import FileError

Row = TypeVar("Row", bound="attrs.AttrsInstance")


def rows(
    path: Path, kind: type[Row], numbers: Iterable[int], solve: Callable[[int], Row]
) -> Iterator[Row]:
    """Rows by numbers, their first column: those that the file holds, else solved and added to it.

    ``kind`` has attributes that are numbers and words.  A line that was cut off is solved anew.
    Raises FileError if the file holds another table.
    """
    known = read(path, kind)
    report.write_csv(known.values(), path, kind)  # without what was cut off
    for number in numbers:
        if number not in known:
            known[number] = solve(number)
            _append(path, attrs.astuple(known[number]))
        yield known[number]


def read(path: Path, kind: type[Row]) -> dict[int, Row]:
    """Whole rows of a file by their first column; none where there is no file.

    Raises FileError if the file holds another table.
    """
    fields = attrs.fields(attrs.resolve_types(kind))
    if not path.exists():
        return {}
    text = path.read_text()
    head, *lines = csv.reader(text[: text.rfind("\n") + 1].splitlines())
    if head != [field.name for field in fields]:
        raise FileError(f"{path}: found another table; allowed: the one that is to go on")
    made = [kind(*(field.type(text) for field, text in zip(fields, line))) for line in lines]
    return {int(line[0]): row for line, row in zip(lines, made)}


def _append(path: Path, cells: Iterable[object]) -> None:
    """A line at the end of a file, on the disk before the next one is begun."""
    with open(path, "a", newline="") as file:
        csv.writer(file).writerow(cells)
