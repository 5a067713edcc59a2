"""Derivatives of what a model says by the numbers of its scene: a table."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from nanorom.errors import ModelError, SceneError
from nanorom.files.whole import atomic_path
from nanorom.results import special
from nanorom.results.near import Named, Near
from nanorom.rom import quantities
from nanorom.scene.scene import Scene
from nanorom.scene.spread import numbers
from nanorom.types import Array, Progress


@attrs.frozen(eq=False, kw_only=True)
class Sensitivity:
    """Values and derivatives.

    of: o names of quantities; unit: of each; value: (o,) in it; by: b keys of the scene; slope:
    (o, b), d value / d ln(key) in the unit of the value; error: (o, b) of the slope, where it is
    from differences of reductions, 0 where it is exact; source: s keys that are spread; share:
    (o, s), change of each by one standard deviation of each, in the unit of the value.
    """

    of: tuple[str, ...]
    unit: tuple[str, ...]
    value: Array
    by: tuple[str, ...]
    slope: Array
    error: Array
    source: tuple[str, ...] = ()
    share: Array = attrs.field(factory=lambda: np.zeros((0, 0)))

    @property
    def deviation(self) -> Array:
        """Standard deviations (o,) that independent spreads make, in units of the values."""
        squares = np.sum(self.share**2, axis=1) if self.source else np.zeros(len(self.of))
        return np.asarray(np.sqrt(squares))

    @property
    def worst(self) -> float:
        """The largest error of an entry of `relative`, of quantities that are not 0."""
        some = self.value != 0
        return float(np.abs(self.error[some] / self.value[some, None]).max(initial=0.0))

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
        """Names of the columns, then a row for each quantity: value, unit, relative derivatives.

        Where there are spreads, its deviation and the share of each follow, in its unit.
        """
        wide = ("deviation", *(f"by {key}" for key in self.source)) if self.source else ()
        yield "quantity", "value", "unit", *self.by, *wide
        for n, (name, value, unit, row) in enumerate(
            zip(self.of, self.value, self.unit, self.relative)
        ):
            spread = (self.deviation[n], *self.share[n]) if self.source else ()
            yield name, repr(float(value)), unit, *(repr(float(each)) for each in (*row, *spread))

    def save_csv(self, path: str | Path) -> None:
        """Write the table; raises FileError."""
        with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as f:
            csv.writer(f).writerows(self.rows())


def check(scene: Scene, of: Sequence[str] | None) -> None:
    """Raise SceneError where names ask for special points of a scene that has none, ModelError for
    what is no name.
    """
    if any(map(special.is_name, of or ())):
        special.check(scene)
    quantities.check_names([name for name in of or () if not special.is_name(name)])


def table(
    near: Near,
    of: Sequence[str] | None,
    by: Sequence[str] | None,
    spread: Mapping[str, Mapping[str, float]],
    progress: Progress | None,
) -> Sensitivity:
    """Quantities of a scene's model by name, with their derivatives by keys.

    of: all frequencies and own cubic coefficients if left out; by: all keys if left out; spread:
    what each source moves among the numbers of the scene.  Raises SceneError, ModelError.
    """
    modes = range(1, near.model.size + 1)
    usual = [f"f{n}" for n in modes] + [f"b({n},{n},{n})" for n in modes]
    names = tuple(usual if of is None else of)
    named = _special([name for name in names if special.is_name(name)], near, progress)
    for name in names:
        if name not in named:
            named[name] = near.quantity(name)
    keys = list(near.keys)
    slope = np.array([named[name].slope for name in names]).reshape(len(names), -1)
    slope, rough = slope[:, : len(keys)], slope[:, len(keys) :]
    error = np.abs(slope - rough) if rough.size else np.zeros(slope.shape)
    chosen = keys if by is None else list(by)
    places = [keys.index(key) for key in chosen]
    return Sensitivity(
        of=names,
        unit=tuple(named[name].unit for name in names),
        value=np.array([named[name].value for name in names]),
        by=tuple(chosen),
        slope=slope[:, places],
        error=error[:, places],
        source=tuple(spread),
        share=slope @ _moves(near, keys, spread),
    )


def _special(names: list[str], near: Near, progress: Progress | None) -> dict[str, Named]:
    return special.derived(names, near, progress) if names else {}


def _moves(near: Near, keys: list[str], spread: Mapping[str, Mapping[str, float]]) -> Array:
    """d ln(key) (b, s) by one deviation of each source; raises SceneError."""
    known, found = numbers(near.scene), np.zeros((len(keys), len(spread)))
    for column, (source, moved) in zip(found.T, spread.items()):
        for name, change in moved.items():
            if name not in keys:
                raise SceneError(f"spread: {source} moves {name}, which has no derivatives here")
            column[keys.index(name)] = change / known[name]
    return found
