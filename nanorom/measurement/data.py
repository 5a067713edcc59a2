"""Measured data from text files: resonance frequencies, responses, ring-downs.

A line names the columns; a unit may stand behind a name, "frequency (MHz)", "f/MHz", or with every
value.  Names are those of `columns.SYNONYMS`, or are chosen.  Columns that are not known are left
alone, and so are rows without a value.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from nanorom.errors import FileError
from nanorom.measurement.columns import is_decibel, is_length
from nanorom.measurement.table import Table
from nanorom.types import Array

ARBITRARY = "a.u."
DIRECTIONS = {
    "up": ("up", "forward", "fwd", "fw", "increasing", "rising", "hin", "+", "1", "+1", "upsweep"),
    "down": ("down", "backward", "bwd", "bw", "decreasing", "falling", "rück", "-1", "downsweep"),
}
_LEVEL = re.compile(
    r"(?<![A-Za-z0-9.])([-+]?|m(?=\d)|minus_?)(\d+(?:[.,p]\d+)?)\s*_?"
    r"(dBm|dBV|dB|[munµ]?V(?:pp|rms)?|[munµ]?W|[munpµf]?N|[munµk]?Pa|mN/m)(?![A-Za-z])"
)


@attrs.frozen(eq=False)
class Resonances:
    """Measured resonances: frequency (n,) Hz, rising; label (n,), "" where the mode is not known.

    uncertainty: (n,) Hz, one standard deviation, or None where the file has none.
    """

    frequency: Array
    label: tuple[str, ...]
    uncertainty: Array | None = None

    @classmethod
    def from_file(cls, path: str | Path, columns: Mapping[str, str] | None = None) -> Resonances:
        """Read columns frequency, label (optional) and uncertainty (optional); raises FileError.

        columns : of these names, what they are called in the file, or their numbers from 1.
        """
        table = Table(path, columns)
        frequency = _positive(table, "frequency")
        kept = np.flatnonzero(~np.isnan(frequency))
        uncertainty = None
        if "uncertainty" in table:
            uncertainty = table.numbers("uncertainty", "Hz", table.unit("frequency") or "Hz")
            for row in kept:
                if not uncertainty[row] > 0:
                    raise FileError(
                        f"{path}: line {table.line[row]}, uncertainty: found "
                        f"{uncertainty[row]:g}; allowed: greater than 0, or no such column"
                    )
        label = table.text("label")
        known = [label[row] for row in kept if label[row]]
        twice = sorted({name for name in known if known.count(name) > 1})
        if twice:
            raise FileError(f"{path}: label: found {twice[0]!r} more than once")
        order = kept[np.argsort(frequency[kept], kind="stable")]
        return cls(
            frequency[order],
            tuple(label[i] for i in order),
            None if uncertainty is None else uncertainty[order],
        )


@attrs.frozen(eq=False)
class Trace:
    """A measured response in one sweep: frequency (n,) Hz and amplitude (n,), level and direction.

    direction: "up", "down" or "" where it is not known; level: as in the file, with the unit of
    its column; phase: (n,) rad, or None where it was not measured.
    """

    frequency: Array
    amplitude: Array
    level: str
    direction: str
    phase: Array | None = None


@attrs.frozen(eq=False)
class MeasuredResponse:
    """A measured response: its traces, the unit of their amplitudes, rows that had no value.

    unit: "m" where the amplitude is a length, else as in the file ("mV", "a.u.", "dBm"), or "".
    """

    traces: tuple[Trace, ...]
    unit: str
    left_out: int = 0

    @classmethod
    def from_file(
        cls, path: str | Path, columns: Mapping[str, str] | None = None
    ) -> MeasuredResponse:
        """Read columns frequency, amplitude (or x and y), phase, level and sweep.

        The last three are optional.  Level and direction are taken from the file's name where it
        has no such column: "-10dBm_up.csv".
        columns : of these names, what they are called in the file.  Raises FileError.
        """
        table = Table(path, columns)
        if not ("amplitude" in table or "x" in table and "y" in table):
            apart = [heading.text for heading in table.headings if _LEVEL.fullmatch(heading.text)]
            if apart:
                return cls._by_columns(path, columns or {}, apart)
        frequency = _positive(table, "frequency")
        amplitude, unit, phase = _amplitude(table)
        level, direction = _level(table), _direction(table)
        whole = ~(np.isnan(frequency) | np.isnan(amplitude))
        if not whole.any():
            raise FileError(f"{path}: no row has both a frequency and an amplitude")
        kinds = list(zip(level, direction))
        traces = []
        for kind in dict.fromkeys(kind for kind, row in zip(kinds, whole) if row):
            own = whole & np.array([other == kind for other in kinds])
            traces.append(
                Trace(frequency[own], amplitude[own], *kind, None if phase is None else phase[own])
            )
        return cls(tuple(traces), unit, int((~whole).sum()))

    @classmethod
    def _by_columns(
        cls, path: str | Path, columns: Mapping[str, str], levels: Sequence[str]
    ) -> MeasuredResponse:
        """Of a file with a column of amplitudes for each level, which is its name."""
        found = [cls.from_file(path, {**columns, "amplitude": level}) for level in levels]
        traces = [
            attrs.evolve(trace, level=level)
            for level, each in zip(levels, found)
            for trace in each.traces
        ]
        return cls(tuple(traces), "", max(each.left_out for each in found))

    @classmethod
    def from_files(
        cls, paths: Sequence[str | Path], columns: Mapping[str, str] | None = None
    ) -> MeasuredResponse:
        """Read several files as one measurement, such as one for each level; raises FileError."""
        found = [cls.from_file(path, columns) for path in paths]
        units = list(dict.fromkeys(each.unit for each in found))
        if len(units) != 1:
            told = ", ".join(f"{each.unit} in {path}" for path, each in zip(paths, found))
            raise FileError(f"amplitude: found {told or 'no file'}; allowed: one unit in all files")
        traces = [
            trace if trace.level or len(found) == 1 else attrs.evolve(trace, level=Path(path).stem)
            for path, each in zip(paths, found)
            for trace in each.traces
        ]
        return cls(tuple(traces), units[0], sum(each.left_out for each in found))

    @classmethod
    def of(
        cls,
        measured: MeasuredResponse | str | Path | Sequence[str | Path],
        columns: Mapping[str, str] | None = None,
    ) -> MeasuredResponse:
        """A response as it is, or read from one file or several; raises FileError."""
        if isinstance(measured, MeasuredResponse):
            return measured
        one = isinstance(measured, (str, Path))
        return cls.from_files([measured] if one else measured, columns)  # type: ignore[list-item,arg-type]

    def linear(self) -> MeasuredResponse:
        """With amplitudes in place of decibels: by one volt of dBV, else by the largest of all."""
        if not is_decibel(self.unit):
            return self
        volts = self.unit.lower() == "dbv"
        largest = 0.0 if volts else max(float(trace.amplitude.max()) for trace in self.traces)
        traces = [
            attrs.evolve(trace, amplitude=10 ** ((trace.amplitude - largest) / 20))
            for trace in self.traces
        ]
        unit = "V" if volts else f"{ARBITRARY}, from {self.unit}"
        return attrs.evolve(self, traces=tuple(traces), unit=unit)


@attrs.frozen(eq=False)
class RingdownRecord:
    """An amplitude that rings down: time (n,) s, rising; amplitude (n,) in its unit.

    frequency: (n,) Hz of the motion, or None where neither it nor a phase was measured.
    """

    time: Array
    amplitude: Array
    unit: str
    frequency: Array | None = None

    @classmethod
    def from_file(
        cls, path: str | Path, columns: Mapping[str, str] | None = None
    ) -> RingdownRecord:
        """Read columns time, amplitude (or x and y) and frequency (optional).

        columns : of these names, what they are called in the file.  Raises FileError.
        """
        table = Table(path, columns)
        time = table.numbers("time", "s", "s")
        amplitude, unit, _ = _amplitude(table)
        frequency = table.numbers("frequency", "Hz", "Hz") if "frequency" in table else None
        whole = np.flatnonzero(~(np.isnan(time) | np.isnan(amplitude)))
        if is_decibel(unit):
            amplitude = 10 ** ((amplitude - np.nanmax(amplitude)) / 20)
            unit = f"{ARBITRARY}, from {unit}"
        order = whole[np.argsort(time[whole], kind="stable")]
        own = None if frequency is None else frequency[order]
        return cls(time[order], amplitude[order], unit, own)


def has_time(path: str | Path, columns: Mapping[str, str] | None = None) -> bool:
    """Whether a file is a record in time; raises FileError."""
    return "time" in Table(path, columns)


def is_sweep(path: str | Path, columns: Mapping[str, str] | None = None) -> bool:
    """Whether a file has amplitudes against frequency, not named resonances; raises FileError."""
    table = Table(path, columns)
    named = "label" in table and not ("level" in table or "sweep" in table)
    return not named and ("amplitude" in table or ("x" in table and "y" in table))


def _positive(table: Table, quantity: str) -> Array:
    """Frequencies in Hz, NaN where there are none; raises FileError."""
    values = table.numbers(quantity, "Hz", "Hz")
    for line, value in zip(table.line, values.tolist()):
        if value <= 0:
            raise FileError(
                f"{table.path}: line {line}, {quantity}: found a value that is not greater than 0"
            )
    if np.isnan(values).all():
        raise FileError(f"{table.path}: {quantity}: found no number")
    return values


def _amplitude(table: Table) -> tuple[Array, str, Array | None]:
    """Amplitude and its unit, and the phase in rad if it was measured."""
    if "amplitude" not in table and "x" in table and "y" in table:
        unit = table.unit("x")
        x, y = (table.numbers(name, "m" if unit and is_length(unit) else "") for name in "xy")
        return np.hypot(x, y), _named(unit), np.asarray(np.arctan2(y, x))
    unit = table.unit("amplitude") or table.unit_of_cells("amplitude")
    amplitude = table.numbers("amplitude", "m" if unit and is_length(unit) else "")
    phase = None
    if "phase" in table:
        default = "deg"
        if not table.unit("phase") and not table.unit_of_cells("phase"):
            # the half turn that a resonance makes is 3 in one unit and 180 in the other
            largest = np.nanmax(np.abs(table.numbers("phase", "")), initial=0.0)
            default = "rad" if largest <= 2 * np.pi else "deg"
        phase = table.numbers("phase", "rad", default)
    return amplitude, _named(unit), phase


def _named(unit: str) -> str:
    return "m" if unit and is_length(unit) else unit


def _level(table: Table) -> list[str]:
    """Level of each row as text, from its column or from the name of the file."""
    if "level" in table:
        unit = table.unit("level")
        return [f"{cell} {unit}" if cell and unit else cell for cell in table.text("level")]
    found = _LEVEL.search(table.path.stem)
    if found is None:
        return [""] * len(table.line)
    sign = "-" if found[1].startswith(("-", "m")) else ""
    return [f"{sign}{found[2].replace(',', '.').replace('p', '.')} {found[3]}"] * len(table.line)


def _direction(table: Table) -> list[str]:
    """Direction of each row, from its column or from the name of the file; raises FileError."""
    if "sweep" not in table:
        words = set(re.split(r"[\W_]+", table.path.stem.lower()))
        told = [name for name in DIRECTIONS if words & {name, *DIRECTIONS[name][1:3]}]
        return [told[0] if len(told) == 1 else ""] * len(table.line)
    named = {word: name for name, words in DIRECTIONS.items() for word in words}
    found = []
    for line, word in zip(table.line, table.text("sweep")):
        if word and word.lower() not in named:
            raise FileError(f"{table.path}: line {line}, sweep: found {word!r}; allowed: up, down")
        found.append(named.get(word.lower(), ""))
    return found
