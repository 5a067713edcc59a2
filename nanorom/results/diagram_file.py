"""How a response diagram is kept in a group of an HDF5 file: its branches and special points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation import Branch, Diagram, SpecialPoint, Unexplored
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.errors import FileError
from nanorom.files import hdf5
from nanorom.files.schema import Item
from nanorom.files.stored import Reader, Writer

NONE = -1  # index of a parent or an origin that there is not
MOST_BRANCHES = 10_000

MULTIPLIERS = Item(
    "n, M", "1", "Floquet multipliers, largest modulus first", kind="complex", finite=False
)
# Fourier coefficients of all orbits of a table, one after the other: their numbers differ
ROWS = Item("n", "1", "how many Fourier coefficients each orbit has", kind="whole")
COEFFICIENTS = Item("R, L", "m", "those of all orbits, 1, cos, sin, cos 2, ... each")
BRANCH = {
    "omega": Item("n", "rad/s", "drive frequencies"),
    "amplitude": Item("n, L", "m", "max |q_r| over a period"),
    "stable": Item("n", "1", "1 where the orbit is stable", kind="flag"),
    "multipliers": MULTIPLIERS,
}
POINTS = {
    "type": Item("n", "", " | ".join(KINDS), kind="name"),
    "omega": Item("n", "rad/s", "drive frequencies"),
    "branch": Item("n", "1", "numbers of the branches that they lie on, from 0"),
    "period_multiple": Item("n", "1", "periods of the drive in one of the orbit"),
    "amplitude": Item("n, L", "m", "max |q_r| over a period"),
    "multipliers": MULTIPLIERS,
    "state": Item("n, 2L", "m, m/s", "(q, dq/dt) at phase 0 of the drive"),
}
MULTIPLICITY = {  # which files of before do not have
    "multiplicity": Item("n", "1", "how many multipliers, or pairs, are critical", kind="whole"),
}
UNEXPLORED = {
    "kind": Item("n", "", "what was not followed, or not looked for", kind="name"),
    "omega": Item("n", "rad/s", "drive frequency"),
    "why": Item("n", "", "for what reason", kind="name"),
}
ORBITS = {"rows": ROWS, "coefficients": COEFFICIENTS}


TABLES = {
    "level/K/branch/B": BRANCH | ORBITS,
    "level/K/special_points": POINTS | MULTIPLICITY | ORBITS,
    "level/K/unexplored": UNEXPLORED,
}


def write_diagram(level: h5py.Group, diagram: Diagram, size: int) -> None:
    """Write the diagram of a system of ``size`` modes into an empty group."""
    level.attrs.update(direct=diagram.direct, parametric=diagram.parametric)
    level.attrs["branches"] = len(diagram.branches)
    for number, branch in enumerate(diagram.branches):
        group = level.create_group(f"branch/{number}")
        group.attrs["period_multiple"] = branch.period_multiple
        group.attrs["ending"] = branch.ending
        group.attrs["wave"], group.attrs["family"] = branch.wave, branch.family
        for name in ("parent", "origin"):
            index = getattr(branch, name)
            group.attrs[name] = NONE if index is None else index
        _write(group, BRANCH, {name: getattr(branch, name) for name in BRANCH})
        _write_orbits(group, branch.coefficients, size)
    _write_points(level.create_group("special_points"), diagram.special_points, size)
    missing = diagram.unexplored
    columns = {name: [getattr(each, name) for each in missing] for name in UNEXPLORED}
    _write(level.create_group("unexplored"), UNEXPLORED, columns)


def _write_points(group: h5py.Group, points: list[SpecialPoint], size: int) -> None:
    columns = {name: np.array([getattr(point, name) for point in points]) for name in POINTS}
    lengths = {"L": size, "M": len(points[0].multipliers) if points else 0}
    for name, item in POINTS.items():
        if len(item.axes) > 1:  # with no points, the second axis is lost
            columns[name] = columns[name].reshape(len(points), item.shape(lengths)[1] or 0)
    _write(group, POINTS, columns)
    multiplicity = np.array([point.multiplicity for point in points], dtype=np.int64)
    _write(group, MULTIPLICITY, {"multiplicity": multiplicity})
    _write_orbits(group, [point.coefficients for point in points], size)


def read_diagram(level: h5py.Group, size: int) -> Diagram:
    """Read the diagram of a system of ``size`` modes; raises FileError."""
    count = hdf5.integer(level, "branches", 0, MOST_BRANCHES)
    groups = [hdf5.group(level, f"branch/{number}") for number in range(count)]
    return Diagram(
        branches=[_read_branch(group, size, count) for group in groups],
        special_points=_read_points(hdf5.group(level, "special_points"), size, count),
        direct=_level(level, "direct"),
        parametric=_level(level, "parametric"),
        unexplored=_read_unexplored(level, size),
    )


def _read_branch(group: h5py.Group, size: int, count: int) -> Branch:
    columns = _read(group, BRANCH, size)
    parent = hdf5.integer(group, "parent", NONE, count - 1)
    origin = hdf5.integer(group, "origin", NONE, None)
    return Branch(
        **columns,
        period_multiple=hdf5.integer(group, "period_multiple", 1, None),
        parent=None if parent == NONE else parent,
        origin=None if origin == NONE else origin,
        coefficients=_read_orbits(group, len(columns["omega"]), size),
        ending=hdf5.text(group.attrs.get("ending", "")),
        wave=hdf5.text(group.attrs.get("wave", "")),
        family=bool(group.attrs.get("family", False)),
    )


def _read_points(group: h5py.Group, size: int, branches: int) -> list[SpecialPoint]:
    for kind in hdf5.read_names(group, "type", None):
        if kind not in KINDS:
            raise FileError(f"special_points: found type {kind!r}")
    columns = _read(group, POINTS, size)
    n, on = len(columns["type"]), columns["branch"]
    if n and not 0 <= on.min() <= on.max() < branches:
        raise FileError("special_points: a point lies on no branch")
    columns["coefficients"] = _read_orbits(group, n, size)
    known = "multiplicity" in group
    critical = _read(group, MULTIPLICITY, size)["multiplicity"] if known else np.ones(n)
    columns["multiplicity"] = critical
    for name in ("branch", "period_multiple", "multiplicity"):
        columns[name] = [int(number) for number in columns[name]]
    return [SpecialPoint(**{name: c[i] for name, c in columns.items()}) for i in range(n)]


def _read_unexplored(level: h5py.Group, size: int) -> list[Unexplored]:
    """What was not explored; files of before say nothing of it."""
    if "unexplored" not in level:
        return []
    columns = _read(hdf5.group(level, "unexplored"), UNEXPLORED, size)
    rows = zip(columns["kind"], map(float, columns["omega"]), columns["why"])
    return [Unexplored(kind=kind, omega=omega, why=why) for kind, omega, why in rows]


def _write(group: h5py.Group, table: Mapping[str, Item], columns: Mapping[str, Any]) -> None:
    writer = Writer(group)
    for name, item in table.items():
        writer.array(name, item, columns[name])


def _read(group: h5py.Group, table: Mapping[str, Item], size: int) -> dict[str, Any]:
    reader = Reader(group, {"L": size})
    return {name: reader.array(name, item) for name, item in table.items()}


def _write_orbits(group: h5py.Group, orbits: list[NDArray[Any]], size: int) -> None:
    rows = np.array([len(orbit) for orbit in orbits], dtype=np.int64)
    stacked = np.concatenate([np.empty((0, size)), *orbits])
    _write(group, ORBITS, {"rows": rows, "coefficients": stacked})


def _read_orbits(group: h5py.Group, count: int, size: int) -> list[NDArray[np.float64]]:
    reader = Reader(group, {"L": size, "n": count})
    rows = reader.array("rows", ROWS)
    if count and rows.min() < 1:
        raise FileError("rows: an orbit without coefficients")
    reader.lengths["R"] = int(rows.sum())
    flat = reader.array("coefficients", COEFFICIENTS)
    return np.split(flat, np.cumsum(rows)[:-1]) if count else []


def _level(group: h5py.Group, name: str) -> float:
    value = float(group.attrs[name])
    if not 0 <= value < np.inf:
        raise FileError(f"{name}: found {value}; expected a finite level")
    return value
