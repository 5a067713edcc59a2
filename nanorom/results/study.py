"""Quantities of many devices, which differ in keys of their scene: a table and its file."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np

from nanorom.errors import ModelError, NanoromError
from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.schema import array, note
from nanorom.files.whole import atomic_path
from nanorom.types import Array


@layout.documented
@attrs.frozen(eq=False, kw_only=True, repr=False)
class Study:
    """A row for each device: what it has of the keys that vary, and its quantities.

    Raises ModelError if arrays do not fit.
    """

    FORMAT: ClassVar[str] = "nanorom-study"
    FORMAT_VERSION: ClassVar[int] = 1

    scene: str = attrs.field(metadata=note("text", "the scene that is varied, TOML"))
    by: tuple[str, ...] = attrs.field(metadata=array("p", "", "keys that vary", kind="name"))
    by_unit: tuple[str, ...] = attrs.field(
        metadata=array("p", "", 'their SI units, "" where none was given', kind="name")
    )
    words: dict[str, list[str]] = attrs.field(
        factory=dict, metadata=note("words", "by key, its values where they are no numbers")
    )
    setting: Array = attrs.field(
        metadata=array("n, p", "", "values of the keys in SI, or their places from 0 among `words`")
    )
    of: tuple[str, ...] = attrs.field(metadata=array("q", "", "quantities", kind="name"))
    of_unit: tuple[str, ...] = attrs.field(metadata=array("q", "", "their SI units", kind="name"))
    value: Array = attrs.field(
        metadata=array("n, q", "", "NaN where a device failed", finite=False)
    )
    failed: Array = attrs.field(metadata=array("n", "", "whether a device failed", kind="flag"))
    remark: tuple[str, ...] = attrs.field(
        metadata=array("n", "", "why it failed, or what its reduction warned of", kind="name")
    )

    def __attrs_post_init__(self) -> None:
        schema.check(self)
        for key, words in self.words.items():
            if key not in self.by:
                raise ModelError(f"words: found {key!r}; allowed: {', '.join(self.by)}")
            places = self.setting[:, self.by.index(key)]
            if len(places) and not (0 <= places.min() and places.max() < len(words)):
                raise ModelError(f"setting: found a place beyond the {len(words)} words of {key}")

    def __repr__(self) -> str:
        head = f"Study of {len(self)} devices, {int(self.failed.sum())} failed"
        return "\n".join([head, *layout.shown(self)])

    def _repr_html_(self) -> str:
        return stored.html(self)

    def __len__(self) -> int:
        return len(self.setting)

    def __getitem__(self, name: str) -> Any:
        """A column (n,), by the name of a key or a quantity; raises ModelError."""
        if name in self.of:
            return self.value[:, self.of.index(name)]
        if name not in self.by:
            allowed = ", ".join([*self.by, *self.of])
            raise ModelError(f"study: found {name!r}; allowed: {allowed}")
        column = self.setting[:, self.by.index(name)]
        if name not in self.words:
            return column
        return np.array(self.words[name], dtype=object)[column.astype(int)]

    def columns(self) -> dict[str, Any]:
        """Columns (n,) by name: keys, quantities, and what there is to remark."""
        return {name: self[name] for name in (*self.by, *self.of)} | {
            "failed": self.failed,
            "remark": np.array(self.remark, dtype=object),
        }

    def to_pandas(self) -> Any:
        """The columns as a table of pandas; raises NanoromError if pandas is not installed."""
        try:
            import pandas
        except ImportError:
            raise NanoromError("this needs pandas: pip install pandas; or columns()") from None
        return pandas.DataFrame(self.columns())

    def save(self, path: str | Path) -> None:
        """Write an HDF5 file; raises FileError."""
        stored.save(self, path)

    def save_csv(self, path: str | Path) -> None:
        """Write the table, units behind the names, a row for each device; raises FileError."""
        units = dict(zip((*self.by, *self.of), (*self.by_unit, *self.of_unit)))
        columns = self.columns()
        told = {name: unit for name, unit in units.items() if unit not in ("", "1")}
        heads = [f"{name} ({told[name]})" if name in told else name for name in columns]
        cells = [[_cell(value) for value in column] for column in columns.values()]
        with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as f:
            csv.writer(f).writerows([heads, *zip(*cells)])

    @classmethod
    def load(cls, path: str | Path) -> Study:
        """Read an HDF5 file; raises FileError."""
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            return stored.read(cls, file)


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    return repr(float(value)) if np.isfinite(value) else ""
