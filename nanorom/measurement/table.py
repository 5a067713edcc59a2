"""Text files of numbers as laboratories write them: separators, commas, comments, encodings."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from nanorom.errors import FileError, SceneError
from nanorom.measurement.columns import (
    COMMA,
    POINT,
    SYNONYMS,
    Heading,
    is_missing,
    is_number,
    is_unit,
    meant,
)
from nanorom.scene.units import to_si
from nanorom.types import Array

LARGEST_FILE = 50_000_000  # bytes
COMMENTS = ("#", "%", "!", "//")
SAMPLE = 200  # lines from which separator and heading are found
SPACES = " "  # stands for any white space as separator
_DECIMAL = re.compile(r"[-+]?[\d.]*,\d+(?:[eE][-+]?\d{1,4})?(?=\s|$)")  # at the start of a cell
_WITH_UNIT = re.compile(r"[-+]?[\d.,]+(?:[eE][-+]?\d+)?\s*([^\d\s].*)")

Line = tuple[int, str]  # number in the file, from 1, and text


class Table:
    """Columns of a text file, by what they mean.

    path; line (n,): numbers in the file of the rows; headings: of the columns.
    """

    def __init__(self, path: str | Path, chosen: Mapping[str, str] | None = None) -> None:
        self.path = Path(path)
        self._chosen = dict(chosen or {})
        for quantity in self._chosen:
            if quantity not in SYNONYMS:
                raise FileError(f"columns: found {quantity!r}; allowed: {', '.join(SYNONYMS)}")
        lines = list(enumerate(_text(self.path).splitlines(), 1))
        kept = [line for line in lines if line[1].strip() and not _is_comment(line[1])]
        if not kept:
            raise self._without_data()
        separator = _separator([text for _, text in kept[:SAMPLE]])
        try:
            rows = [(number, _cells(text, separator)) for number, text in kept]
        except csv.Error as error:
            raise FileError(f"{path}: not a table of text: {error}") from None
        titles, rows = self._titles(lines, rows, separator)
        self.headings = [Heading.of(title) for title in titles]
        if rows and _are_units(rows[0][1]):  # a line of units below the names
            units = rows.pop(0)[1]
            self.headings = [
                Heading(own.name, own.text, own.unit or unit)
                for own, unit in zip(self.headings, [*units, *[""] * len(titles)])
            ]
        while rows and _is_farewell(rows[-1][1], len(titles)):
            rows.pop()
        if not rows:
            raise self._without_data()
        self.line = [number for number, _ in rows]
        self._rows = [row for _, row in rows]
        self._meant = meant(self.headings, self._chosen)

    def _without_data(self) -> FileError:
        return FileError(
            f"{self.path}: found no data; expected a line of column names, then values"
        )

    def _titles(
        self, lines: Sequence[Line], rows: list[tuple[int, list[str]]], separator: str
    ) -> tuple[list[str], list[tuple[int, list[str]]]]:
        """The line that names the columns, a comment perhaps, and the rows below it.

        What instruments write before it is left out.
        """
        for place, (_, row) in enumerate(rows[:SAMPLE]):
            if _names_columns(row, self._chosen):
                return row, rows[place + 1 :]
        first, width = rows[0][0], len(rows[0][1])
        for _, text in reversed([line for line in lines if line[0] < first]):
            row = _heading_cells(text.strip().lstrip("#%!/ \t"), separator, width)
            if _names_columns(row, {}):
                return row, rows
        if all(is_number(cell) for cell in rows[0][1]):  # no names: columns by their numbers
            return [f"column {number + 1}" for number in range(width)], rows
        return rows[0][1], rows[1:]

    def __contains__(self, quantity: str) -> bool:
        """Whether there is a column of a quantity."""
        return bool(self._meant.get(quantity))

    def _column(self, quantity: str) -> int:
        """Number of the column of a quantity, from 0; raises FileError."""
        own, titles = self._meant.get(quantity, []), [heading.text for heading in self.headings]
        if not own:
            raise FileError(
                f"{self.path}: found no column {quantity!r}; it has {', '.join(titles)}; say "
                f"which it is with --columns {quantity}=NAME or rename it"
            )
        if len(own) > 1:
            several = ", ".join(titles[i] for i in own)
            raise FileError(
                f"{self.path}: {quantity}: found {several}; say which with --columns "
                f"{quantity}=NAME"
            )
        return own[0]

    def unit(self, quantity: str) -> str:
        """Unit in the heading of a quantity, or ""; raises FileError if it has no column."""
        return self.headings[self._column(quantity)].unit

    def unit_of_cells(self, quantity: str) -> str:
        """Unit behind the first value of a quantity, or ""."""
        cell = next((cell for cell in self.text(quantity) if not is_missing(cell)), "")
        found = _WITH_UNIT.fullmatch(cell)
        return found[1] if found and is_unit(found[1]) else ""

    def text(self, quantity: str) -> list[str]:
        """A column as it stands; empty strings where there is none."""
        if quantity not in self:
            return [""] * len(self._rows)
        column = self._column(quantity)
        return [row[column] if column < len(row) else "" for row in self._rows]

    def numbers(self, quantity: str, unit: str, default: str = "") -> Array:
        """A column in an SI unit, or as it stands where that is ""; NaN where a value is missing.

        ``default`` is the unit of a heading that has none.  Raises FileError.
        """
        shown = (self.unit(quantity) or default) if unit else ""
        cells = self.text(quantity)
        commas = [cell for cell in cells if COMMA.fullmatch(cell)]
        if commas and any("." in cell for cell in cells if POINT.fullmatch(cell)):
            point = next(cell for cell in cells if "." in cell and POINT.fullmatch(cell))
            raise FileError(
                f"{self.path}: {quantity}: found {commas[0]!r} and {point!r}; use one decimal sign"
            )
        values = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            if is_missing(cell):
                continue
            if decimal := _DECIMAL.match(cell):
                number = decimal[0].replace(".", "").replace(",", ".")
                cell = number + cell[decimal.end() :]
            if POINT.fullmatch(cell):
                cell = f"{cell.lower().replace('d', 'e')} {shown}"
            elif not unit:  # the same behind every value
                cell = cell.removesuffix(self.unit_of_cells(quantity))
            try:
                values[row] = to_si(cell, unit or "1", f"line {self.line[row]}, {quantity}")
            except SceneError as error:
                raise FileError(f"{self.path}: {error}") from None
        return values


def _is_farewell(row: Sequence[str], columns: int) -> bool:
    """Whether a line is no row of so many columns but words, as some programs end their files."""
    return len(row) < columns and not any(map(is_number, row))


def _names_columns(row: Sequence[str], chosen: Mapping[str, str]) -> bool:
    """Whether a line has the name of a frequency or a time."""
    if all(map(is_number, row)):
        return False
    found = meant([Heading.of(cell) for cell in row], chosen)
    return bool(found.get("frequency") or found.get("time"))


def _text(path: Path) -> str:
    """The text of a file in UTF-8 or UTF-16 with their marks, else in Latin-1; raises FileError."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FileError(f"{path}: larger than {LARGEST_FILE // 1_000_000} MB")
        content = path.read_bytes()
    except FileNotFoundError:
        raise FileError(f"{path}: no such file") from None
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error}") from None
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    if b"\0" in content:
        raise FileError(f"{path}: not a table of text: it has bytes of zero")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:  # each byte is then a letter of Western Europe
        return content.decode("cp1252", errors="replace")


def _is_comment(text: str) -> bool:
    return text.lstrip().startswith(COMMENTS)


def _separator(lines: Sequence[str]) -> str:
    """What stands between the cells of lines."""
    body = lines[1:] or lines
    for mark in (";", "\t"):
        if 2 * sum(mark in line for line in body) > len(body):
            return mark
    words = [line.split() for line in body]
    width = len(words[-1])
    if width > 1 and all(
        sum(map(is_number, row)) > 1 and not any("," in c and not is_number(c) for c in row)
        for row in words
        if len(row) == width
    ):
        return SPACES
    return ","


def _cells(text: str, separator: str) -> list[str]:
    if separator == SPACES:
        words = text.split()
        return words if all(map(is_number, words)) else _heading_cells(text, separator, 0)
    (row,) = csv.reader([text], delimiter=separator, skipinitialspace=True)
    return [cell.strip() for cell in row]


def _heading_cells(text: str, separator: str, width: int) -> list[str]:
    """Cells of a line of names; between white space, units in brackets belong to the name."""
    if separator != SPACES:
        return [cell.strip() for cell in text.split(separator)]
    ways = [re.findall(r"[^\s(\[]+(?:\s*[(\[][^)\]]*[)\]])?", text), re.split(r"\s{2,}|\t", text)]
    return next((way for way in ways if len(way) == width), ways[0])


def _are_units(row: Sequence[str]) -> bool:
    """Whether a row has units alone."""
    told = [cell.strip("()[] ") for cell in row if cell]
    return bool(told) and all(is_unit(cell) for cell in told) and not any(map(is_number, told))
