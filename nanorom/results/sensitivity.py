"""Derivatives of what a model says by the numbers of its scene: a table."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.files.whole import atomic_path
from nanorom.types import Array


@attrs.frozen(eq=False, kw_only=True)
class Sensitivity:
    """Values and derivatives.

    of: o names of quantities; unit: of each; value: (o,) in it; by: b keys of the scene; slope:
    (o, b), d value / d ln(key) in the unit of the value.
    """

    of: tuple[str, ...]
    unit: tuple[str, ...]
    value: Array
    by: tuple[str, ...]
    slope: Array

    @property
    def relative(self) -> Array:
        """d ln(of) / d ln(by) (o, b), a ratio: per cent of the quantity per per cent of the key.

        Infinite or not a number for a quantity that is 0.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.slope / self.value[:, None])

    def __getitem__(self, names: tuple[str, str]) -> float:
        """d ln(of) / d ln(by) of table["f1", "plate.thickness"], a ratio; raises ModelError."""
        of, by = names
        if of not in self.of or by not in self.by:
            raise ModelError(
                f"sensitivity: found {of!r}, {by!r}; allowed: {', '.join(self.of)} by "
                f"{', '.join(self.by)}"
            )
        return float(self.relative[self.of.index(of), self.by.index(by)])

    def rows(self) -> Iterator[tuple[str, ...]]:
        """Names of the columns, then a row for each quantity: value, unit, relative derivatives."""
        yield "quantity", "value", "unit", *self.by
        for name, value, unit, row in zip(self.of, self.value, self.unit, self.relative):
            yield name, repr(float(value)), unit, *(repr(float(each)) for each in row)

    def save_csv(self, path: str | Path) -> None:
        """Write the table; raises FileError."""
        with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as f:
            csv.writer(f).writerows(self.rows())
