"""A device that was looked for: what was asked, every device on the way, the best, its spread."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.schema import array, note
from nanorom.files.whole import atomic_path
from nanorom.types import Array

NONE = -1  # place of the best search where none reached what must hold


@layout.documented
@attrs.frozen(eq=False, kw_only=True, repr=False)
class Design:
    """The best device of several searches, or a front of two objectives; raises ModelError.

    Formulas are in SI, with "" as the unit of those that are no single quantity.
    """

    FORMAT: ClassVar[str] = "nanorom-design"
    FORMAT_VERSION: ClassVar[int] = 1

    scene: str = attrs.field(metadata=note("text", "the scene that was varied, TOML"))
    best: str = attrs.field(metadata=note("text", "the scene of the best device, TOML"))
    wish: dict[str, list[str]] = attrs.field(
        metadata=note("words", "what is to be small or large, and what must hold")
    )
    by: tuple[str, ...] = attrs.field(metadata=array("p", "", "keys that vary", kind="name"))
    by_unit: tuple[str, ...] = attrs.field(metadata=array("p", "", "their SI units", kind="name"))
    low: Array = attrs.field(metadata=array("p", "", "their lower bounds in SI"))
    high: Array = attrs.field(metadata=array("p", "", "their upper bounds in SI"))
    of: tuple[str, ...] = attrs.field(metadata=array("q", "", "formulas", kind="name"))
    of_unit: tuple[str, ...] = attrs.field(metadata=array("q", "", "their SI units", kind="name"))
    search: Array = attrs.field(
        metadata=array("n", "1", "search that each device was computed in", kind="whole")
    )
    setting: Array = attrs.field(metadata=array("n, p", "", "values of the keys in SI"))
    value: Array = attrs.field(metadata=array("n, q", "", "values of the formulas"))
    violation: Array = attrs.field(
        metadata=array("n", "1", "by how much the least met condition is missed, relative")
    )
    ended_setting: Array = attrs.field(
        metadata=array("s, p", "", "keys where each search ended", finite=False)
    )
    ended_value: Array = attrs.field(
        metadata=array("s, q", "", "formulas there; NaN where it found no device", finite=False)
    )
    ended_violation: Array = attrs.field(
        metadata=array("s", "1", "violation there, infinite where it found no device", finite=False)
    )
    reached: Array = attrs.field(
        metadata=array("s", "", "whether all conditions are met there", kind="flag")
    )
    front: Array = attrs.field(
        metadata=array("s", "", "whether it is the best, or on the front", kind="flag")
    )
    remark: tuple[str, ...] = attrs.field(
        metadata=array("s", "", "why it ended before a best device, or found none", kind="name")
    )
    chosen: int = attrs.field(
        converter=int, metadata=note("number", "place of the best search from 0; -1: none")
    )
    slope: Array = attrs.field(
        metadata=array("q, p", "", "derivatives of formulas by keys at the best", finite=False)
    )
    exact: Array = attrs.field(
        metadata=array("p", "", "whether these are exact, not differences", kind="flag")
    )
    finer: Array = attrs.field(
        metadata=array("q", "", "formulas of the best at a tenth of the tolerance", finite=False)
    )
    source: tuple[str, ...] = attrs.field(
        metadata=array("d", "", "keys that are spread in devices that are made", kind="name")
    )
    source_unit: tuple[str, ...] = attrs.field(
        metadata=array("d", "", "their SI units", kind="name")
    )
    spread: Array = attrs.field(metadata=array("d", "", "one standard deviation of each, in SI"))
    share: Array = attrs.field(
        metadata=array("q, d", "", "change of each formula by one deviation of each key")
    )
    made: dict[str, Any] = attrs.field(
        factory=dict, metadata=note("facts", "share of devices that meet the conditions")
    )
    told: str = attrs.field(default="", metadata=note("text", "what there is to remark"))

    def __attrs_post_init__(self) -> None:
        schema.check(self)
        if not NONE <= self.chosen < len(self.remark):
            raise ModelError(f"chosen: found {self.chosen}; there are {len(self.remark)} searches")

    def __repr__(self) -> str:
        head = f"Design of {len(self.by)} keys: {'; '.join(self.asked)}"
        return "\n".join([head, *layout.shown(self)])

    def _repr_html_(self) -> str:
        return stored.html(self)

    @property
    def asked(self) -> list[str]:
        """What was wished, a line each."""
        return [f"{word} {text}".strip() for word, texts in self.wish.items() for text in texts]

    @property
    def found(self) -> dict[str, float]:
        """Keys and formulas of the best device in SI; raises ModelError if there is none."""
        if self.chosen == NONE:
            raise ModelError("design: no device was found that meets the conditions")
        row = (*self.ended_setting[self.chosen], *self.ended_value[self.chosen])
        return dict(zip((*self.by, *self.of), map(float, row)))

    def __getitem__(self, name: str) -> float:
        """A key or a formula of the best device in SI; raises ModelError."""
        found = self.found
        if name not in found:
            raise ModelError(f"design: found {name!r}; allowed: {', '.join(found)}")
        return found[name]

    @property
    def deviation(self) -> Array:
        """Standard deviations (q,) of the best's formulas, in their units, in devices made."""
        return np.asarray(np.sqrt(np.sum(self.share**2, axis=1)))

    def save(self, path: str | Path) -> None:
        """Write an HDF5 file; raises FileError."""
        stored.save(self, path)

    def save_csv(self, path: str | Path) -> None:
        """Write every device on the way, units behind the names; raises FileError."""
        names, units = (*self.by, *self.of), (*self.by_unit, *self.of_unit)
        heads = [f"{n} ({u})" if u not in ("", "1") else n for n, u in zip(names, units)]
        columns = np.column_stack([self.setting, self.value, self.violation]).tolist()
        rows = [[int(own), *map(repr, row)] for own, row in zip(self.search, columns)]
        with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as f:
            csv.writer(f).writerows([["search", *heads, "violation"], *rows])

    @classmethod
    def load(cls, path: str | Path) -> Design:
        """Read an HDF5 file; raises FileError."""
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            return stored.read(cls, file)
