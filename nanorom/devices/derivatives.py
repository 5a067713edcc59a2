"""Derivatives of what a device has along lines of scenes: exact ones where there are any.

Of a line of scenes, only numbers change to which `nanorom.sensitivity` has exact derivatives, the
chain from the line to the numbers is that of the scene itself.  Elsewhere two more devices are
computed, and their difference is told to be one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.devices.catalogue import Answer, Catalogue
from nanorom.errors import SceneError
from nanorom.scene.scene import Scene
from nanorom.scene.spread import moved, numbers
from nanorom.types import Array

STEP = 2e-3  # of a line: differences of devices, whose meshes leave 1e-6 of what is found
EXPLICIT = 1e-5  # of a line: differences of what a scene says of itself


@attrs.frozen
class Line:
    """Scenes along a parameter: tables at a place, and the ends that it must keep to."""

    tables: Callable[[float], dict[str, Any]]
    low: float = -np.inf
    high: float = np.inf

    def around(self, step: float) -> tuple[float, float]:
        """Places about 0, one step apart from it as far as the ends allow."""
        return max(-step, self.low), min(step, self.high)


@attrs.frozen(eq=False)
class Derivatives:
    """value: by name (lines,); exact: (lines,) flags; why: what there was no exact one for."""

    value: dict[str, Array]
    exact: tuple[bool, ...]
    why: str


def along(
    lines: Sequence[Line], found: Answer, names: Sequence[str], catalogue: Catalogue, where: Path
) -> Derivatives:
    """Derivatives along lines at the device that was found at their place 0, asked with slopes.

    where: directory of the scenes' files.  Raises SceneError where devices beside it cannot be
    computed, Stopped.
    """
    chains = [_chain(line, found.get("slopes", {}), where) for line in lines]
    rest = [line for line, chain in zip(lines, chains) if chain is None]
    ends = [end for line in rest for end in line.around(STEP)]
    tables = [line.tables(end) for line in rest for end in line.around(STEP)]
    answers = catalogue.each(tables)
    for answer in answers:
        if "failure" in answer:
            raise SceneError(f"beside a device there is none: {answer['failure']}")
    columns, pairs = [], iter(zip(ends[::2], ends[1::2], answers[::2], answers[1::2]))
    for chain in chains:
        if chain is None:
            low, high, first, second = next(pairs)
            values = np.array(second["values"]) - np.array(first["values"])
            columns.append(values / (high - low))
        else:
            slopes = [share * np.array(found["slopes"][key]) for key, share in chain.items()]
            columns.append(np.sum(slopes, axis=0) if slopes else np.zeros(len(names)))
    table = np.column_stack(columns) if columns else np.empty((len(names), 0))
    value = dict(zip(names, table))
    return Derivatives(value, tuple(c is not None for c in chains), found.get("inexact", ""))


def _chain(line: Line, slopes: Mapping[str, Any], where: Path) -> dict[str, float] | None:
    """d ln(number) along a line, by number of the scene; None where slopes do not tell all."""
    if not slopes:
        return None
    low, high = line.around(EXPLICIT)
    first, second = (Scene.from_dict(line.tables(place), where) for place in (low, high))
    change = moved(first, second)
    if change is None or not change.keys() <= slopes.keys():
        return None
    middle = numbers(Scene.from_dict(line.tables(0.0), where))
    return {key: step / (high - low) / middle[key] for key, step in change.items()}
