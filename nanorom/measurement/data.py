"""Measured data from CSV files: resonance frequencies, and responses to lay over a model's.

The first line names the columns; a unit may stand behind a name in brackets, "frequency (MHz)",
or with every value.  Columns that are not known are left alone, lines from # on are comments.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import attrs
import numpy as np

from nanorom.errors import FileError, SceneError
from nanorom.scene.units import to_si
from nanorom.types import Array

LARGEST_FILE = 50_000_000  # bytes
_PLAIN = re.compile(r"[-+.\deE]+")
_HEADING = re.compile(r"\s*([A-Za-z_ ]+?)\s*(?:[(\[]\s*(.*?)\s*[)\]])?\s*")


@attrs.frozen(eq=False)
class Resonances:
    """Measured resonances: frequency (n,) Hz, rising; label (n,), "" where the mode is not known.

    uncertainty: (n,) Hz, one standard deviation, or None where the file has none.
    """

    frequency: Array
    label: tuple[str, ...]
    uncertainty: Array | None = None

    @classmethod
    def from_file(cls, path: str | Path) -> Resonances:
        """Read columns frequency, label (optional) and uncertainty (optional); raises FileError."""
        table = _Table(path)
        frequency = table.numbers("frequency", "Hz", "Hz")
        uncertainty = None
        if "uncertainty" in table.columns:
            uncertainty = table.numbers("uncertainty", "Hz", table.units["frequency"] or "Hz")
        if (frequency <= 0).any():
            raise FileError(f"{path}: frequency: found a value that is not greater than 0")
        if uncertainty is not None and (uncertainty <= 0).any():
            raise FileError(f"{path}: uncertainty: found a value that is not greater than 0")
        label = table.text("label")
        known = [name for name in label if name]
        twice = sorted({name for name in known if known.count(name) > 1})
        if twice:
            raise FileError(f"{path}: label: found {twice[0]!r} more than once")
        order = np.argsort(frequency, kind="stable")
        return cls(
            frequency[order],
            tuple(label[i] for i in order),
            None if uncertainty is None else uncertainty[order],
        )


@attrs.frozen(eq=False)
class Trace:
    """A measured response in one sweep: frequency (n,) Hz and amplitude (n,), level and direction.

    direction: "up", "down" or "" where it is not known; level: as in the file.
    """

    frequency: Array
    amplitude: Array
    level: str
    direction: str


@attrs.frozen(eq=False)
class MeasuredResponse:
    """A measured response: its traces, and the unit of their amplitudes.

    unit: "m" where the amplitude is a length, else as in the file ("mV", "a.u.", "dBm").
    """

    traces: tuple[Trace, ...]
    unit: str

    @classmethod
    def from_file(cls, path: str | Path) -> MeasuredResponse:
        """Read columns frequency, amplitude, level and sweep (the last two optional).

        The heading of the amplitude has its unit; sweep is up or down.  Raises FileError.
        """
        table = _Table(path)
        frequency = table.numbers("frequency", "Hz", "Hz")
        if (frequency <= 0).any():
            raise FileError(f"{path}: frequency: found a value that is not greater than 0")
        unit = table.units.get("amplitude", "")
        if "amplitude" in table.columns and not unit:
            raise FileError(
                f"{path}: amplitude: found no unit; name the column 'amplitude (nm)', "
                "'amplitude (mV)' or 'amplitude (a.u.)'"
            )
        amplitude = table.numbers("amplitude", "m" if is_length(unit) else "")
        level, direction = table.text("level"), table.text("sweep")
        for line, word in enumerate(direction, 2):
            if word not in ("up", "down", ""):
                raise FileError(f"{path}: line {line}, sweep: found {word!r}; allowed: up, down")
        kinds = list(zip(level, direction))
        traces = []
        for kind in dict.fromkeys(kinds):
            own = np.array([other == kind for other in kinds])
            traces.append(Trace(frequency[own], amplitude[own], *kind))
        return cls(tuple(traces), "m" if is_length(unit) else unit)


class _Table:
    """Columns of a CSV file as text, with their units."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            if self.path.stat().st_size > LARGEST_FILE:
                raise FileError(f"{path}: larger than {LARGEST_FILE // 1_000_000} MB")
            text = self.path.read_text(encoding="utf-8-sig")
        except FileNotFoundError:
            raise FileError(f"{path}: no such file") from None
        except (OSError, UnicodeDecodeError) as error:
            raise FileError(f"{path}: cannot be read as text: {error}") from None
        kept = [line for line in text.splitlines() if line.strip() and line.strip()[0] != "#"]
        separator = ";" if kept and ";" in kept[0] else ","
        try:
            rows = [[c.strip() for c in row] for row in csv.reader(kept, delimiter=separator)]
        except csv.Error as error:
            raise FileError(f"{path}: not a CSV file: {error}") from None
        if len(rows) < 2:
            raise FileError(f"{path}: found no data; expected a line of column names, then values")
        self.units: dict[str, str] = {}
        self.columns: dict[str, list[str]] = {}
        for number, heading in enumerate(rows[0]):
            match = _HEADING.fullmatch(heading)
            name = (match[1] if match else heading).lower()
            self.units[name] = (match and match[2]) or ""
            self.columns[name] = [row[number] if number < len(row) else "" for row in rows[1:]]

    def text(self, name: str) -> tuple[str, ...]:
        """A column as it stands; empty strings where there is none."""
        length = len(next(iter(self.columns.values())))
        return tuple(self.columns.get(name, [""] * length))

    def numbers(self, name: str, unit: str, default: str = "") -> Array:
        """A column in an SI unit, or as it stands where that is ""; raises FileError.

        ``default`` is the unit of a heading that has none.
        """
        if name not in self.columns:
            found = ", ".join(self.columns)
            raise FileError(f"{self.path}: found no column {name!r}; it has {found}")
        shown = (self.units[name] or default) if unit else ""
        values = []
        for line, cell in enumerate(self.columns[name], 2):
            text = f"{cell} {shown}" if _PLAIN.fullmatch(cell) else cell
            try:
                values.append(to_si(text, unit or "1", f"line {line}, {name}"))
            except SceneError as error:
                raise FileError(f"{self.path}: {error}") from None
        return np.array(values)


def is_length(unit: str) -> bool:
    """Whether a unit is one of length."""
    try:
        to_si(f"1 {unit}", "m", "unit")
    except SceneError:  # of another dimension, or unknown
        return False
    return True
