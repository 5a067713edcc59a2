"""A response as one table: every point of every branch, and every special point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from nanorom.continuation import Branch, SpecialPoint
from nanorom.results import readings
from nanorom.results.readings import Output

if TYPE_CHECKING:
    from nanorom.results.response import Response

COLUMNS = ("level", "direct", "parametric", "branch", "period", "stable", "special", "frequency")


def columns(
    response: Response, output: Output | None = None, harmonic: object = 1
) -> dict[str, Any]:
    """The columns by name, each (n,): a row per point.

    output, harmonic : as for `readings.reading`: adds what a lock-in amplifier reads

    level : number of the drive level, from 1; direct, parametric : that level, in its unit
        (``response.drive.units``); branch : number of the branch, from 0; period : of the orbit, in
        periods of the drive; stable : 1, 0, or -1 at special points; special : "" or "LP", ...;
        frequency : of the drive, in Hz; amplitude of MODE : max |q_r| in m, one column per mode.
    With an output, x and y : what goes with cos(k omega t) and -sin(k omega t), in m; phase : ahead
    of cos(k omega t), in rad, without jumps along a branch; decibel : of 1 nm.  Of a response with
    a readout also signal_x, signal_y : the same of its voltage, in V; signal_phase; dbm : its power
    in dB of 1 mW.
    Raises ContinuationError for an output or a harmonic that is not there.
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
    if output is not None:
        read = list(_readings(response, output, harmonic))
        names = [*readings.COLUMNS, *(readings.VOLTAGES if response.readout is not None else ())]
        for name in names:
            table[name] = np.concatenate([each[name] for each in read]) if read else np.empty(0)
    return table


def _readings(response: Response, output: Output, harmonic: object) -> Iterator[dict[str, Any]]:
    """In the order of `_rows`."""
    for diagram in response.diagrams:
        every: list[Branch | SpecialPoint] = [*diagram.branches, *diagram.special_points]
        for orbits in every:
            found = readings.columns(readings.reading(response, orbits, output, harmonic))
            if response.readout is not None:
                volts = readings.signal(response, orbits, output, harmonic)
                found |= readings.voltages(volts, response.readout)
            yield found


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
