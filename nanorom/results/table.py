"""A response as one table: every point of every branch, and every special point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from nanorom.results.response import Response

COLUMNS = ("level", "direct", "parametric", "branch", "period", "stable", "special", "frequency")


def columns(response: Response) -> dict[str, Any]:
    """The columns by name, each (n,): a row per point.

    level : number of the drive level, from 1; direct, parametric : that level, in its unit
        (``response.drive.units``); branch : number of the branch, from 0; period : of the orbit, in
        periods of the drive; stable : 1, 0, or -1 at special points; special : "" or "LP", ...;
        frequency : of the drive, in Hz; amplitude of MODE : max |q_r| in m, one column per mode.
    """
    rows = list(_rows(response))
    table: dict[str, Any] = {
        name: np.concatenate([np.atleast_1d(row[i]) for row in rows]) if rows else np.empty(0)
        for i, name in enumerate(COLUMNS)
    }
    size = len(response.label)
    amplitude = np.concatenate([row[-1].reshape(-1, size) for row in rows]) if rows else []
    for name, values in zip(response.label, np.reshape(amplitude, (-1, size)).T):
        table[f"amplitude of {name}"] = values
    return table


def headings(response: Response) -> dict[str, str]:
    """What the columns are called in files: their names with their units."""
    direct, parametric = response.drive.units
    units = {"direct": direct, "parametric": parametric, "frequency": "Hz"}
    units |= {f"amplitude of {name}": "m" for name in response.label}
    named = [*COLUMNS, *(f"amplitude of {name}" for name in response.label)]
    return {name: f"{name} ({units[name]})" if name in units else name for name in named}


def _rows(response: Response) -> Iterator[tuple[Any, ...]]:
    levels = zip(response.drive.levels, response.diagrams)
    for level, ((direct, parametric), diagram) in enumerate(levels, 1):
        for number, branch in enumerate(diagram.branches):
            same = (np.full(len(branch), x) for x in (level, direct, parametric, number))
            period, none = np.full(len(branch), branch.period_multiple), np.full(len(branch), "")
            stable = np.asarray(branch.stable, dtype=int)
            yield (*same, period, stable, none, branch.frequency, branch.amplitude)
        for point in diagram.special_points:
            place = (level, direct, parametric, point.branch, point.period_multiple)
            yield (*place, -1, point.type, point.frequency, point.amplitude)
