"""The file `response.h5`: branches and special points of every drive level."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import h5py
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation import (
    Branch,
    Diagram,
    ModalSystem,
    SpecialPoint,
    Unexplored,
)
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.errors import FileError
from nanorom.files import hdf5
from nanorom.results.response import Response
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Excitation
from nanorom.scene.fields import parse_toml
from nanorom.version import version

FORMAT = "nanorom-response"
FORMAT_VERSION = 1
NONE = -1  # index of a parent or an origin that there is not
MOST_BRANCHES = 10_000
KEY = "key"  # attribute: what the levels were computed from, so that a run can go on


def save(response: Response, path: str | Path, key: str | None = None) -> None:
    """Write the response, whole or not at all; raises FileError."""
    with hdf5.create(path, FORMAT, FORMAT_VERSION) as file:
        _write_head(file, response)
        if key is not None:
            file.attrs[KEY] = key
        for number, diagram in enumerate(response.diagrams):
            _write_diagram(file.create_group(f"level/{number}"), diagram)


def load(path: str | Path) -> Response:
    """Read a response; raises FileError naming the file and what is wrong with it."""
    with hdf5.opened(path, FORMAT, FORMAT_VERSION) as file:
        response, total = _read_head(file)
        levels = hdf5.group(file, "level")
        done = [number for number in range(total) if str(number) in levels]
        # a run that was interrupted says what it is the beginning of
        if len(done) < total and KEY not in file.attrs or not done:
            raise FileError(f"level/{min(set(range(total)) - set(done))}: missing")
        size = len(response.frequency)
        drive = response.drive
        return attrs.evolve(
            response,
            diagrams=tuple(_read_diagram(hdf5.group(file, f"level/{n}"), size) for n in done),
            drive=drive if len(done) == total else _some_levels(drive, done),
            unfinished=total - len(done),
        )


def key_of(system: ModalSystem, omega: tuple[float, float], options: dict[str, Any]) -> str:
    """What a response depends on beside its levels, as a digest."""
    digest = hashlib.sha256(repr((version(), omega, sorted(options.items()))).encode())
    for field in attrs.fields(ModalSystem):
        digest.update(np.ascontiguousarray(getattr(system, field.name)).tobytes())
    return digest.hexdigest()


def resume(path: str | Path, response: Response, key: str) -> dict[int, Diagram]:
    """Diagrams that a run of the same key and levels left in a file, by number of the level."""
    try:
        with hdf5.opened(path, FORMAT, FORMAT_VERSION) as file:
            if not _continues(file, response, key):
                return {}
            levels, size = hdf5.group(file, "level"), len(response.frequency)
            return {int(n): _read_diagram(hdf5.group(levels, n), size) for n in levels}
    except FileError:  # nothing to continue; it is replaced as any earlier result
        return {}


@contextmanager
def growing(response: Response, key: str, known: Mapping[int, Diagram]) -> Iterator[h5py.File]:
    """A file in memory that holds some levels, for `add`."""
    with hdf5.new(FORMAT, FORMAT_VERSION) as file:
        _write_head(file, response)
        file.attrs[KEY] = key
        for number, diagram in known.items():
            _write_diagram(file.create_group(f"level/{number}"), diagram)
        yield file


def add(file: h5py.File, path: str | Path, number: int, diagram: Diagram) -> None:
    """Save one more level; until it is whole, what is at the path stays. Raises FileError."""
    _write_diagram(file.create_group(f"level/{number}"), diagram)
    hdf5.store(file, path)


def _continues(file: h5py.File, response: Response, key: str) -> bool:
    same = hdf5.text(file.attrs.get(KEY, "")) == key
    return same and hdf5.text(file.attrs["excitation"]) == _excitation(response)


def _excitation(response: Response) -> str:
    return Excitation(drive=response.drive, sweep=response.sweep).to_toml()


def _some_levels(drive: Drive, numbers: list[int]) -> Drive:
    direct, parametric = zip(*(drive.levels[number] for number in numbers))
    return attrs.evolve(drive, direct=direct, parametric=parametric)


def _write_head(file: h5py.File, response: Response) -> None:
    file.attrs["excitation"] = _excitation(response)
    hdf5.write(file, "frequency", response.frequency, "Hz")
    hdf5.write_names(file, "label", response.label)
    file.create_group("level")


def _read_head(file: h5py.File) -> tuple[Response, int]:
    """A response without its diagrams, and how many levels it has when it is complete."""
    excitation = Excitation.from_dict(parse_toml(hdf5.text(file.attrs["excitation"])))
    frequency = hdf5.read(file, "frequency", (None,))
    response = Response(
        diagrams=(),
        drive=excitation.drive,
        sweep=excitation.sweep,
        frequency=frequency,
        label=hdf5.read_names(file, "label", len(frequency)),
    )
    return response, len(excitation.drive.levels)


def _write_diagram(level: h5py.Group, diagram: Diagram) -> None:
    level.attrs.update(direct=diagram.direct, parametric=diagram.parametric)
    level.attrs["branches"] = len(diagram.branches)
    for number, branch in enumerate(diagram.branches):
        group = level.create_group(f"branch/{number}")
        group.attrs["period_multiple"] = branch.period_multiple
        group.attrs["ending"] = branch.ending
        for name in ("parent", "origin"):
            index = getattr(branch, name)
            group.attrs[name] = NONE if index is None else index
        for name, unit in (("omega", "rad/s"), ("amplitude", "m")):
            hdf5.write(group, name, getattr(branch, name), unit)
        hdf5.write(group, "stable", np.asarray(branch.stable, dtype=np.uint8))
        hdf5.write(group, "multipliers", np.asarray(branch.multipliers, dtype=complex))
        _write_ragged(group, branch.coefficients, branch.amplitude.shape[1])
    _write_points(level.create_group("special_points"), diagram)
    _write_unexplored(level.create_group("unexplored"), diagram)


def _write_points(group: h5py.Group, diagram: Diagram) -> None:
    points = diagram.special_points
    size = diagram.branches[0].amplitude.shape[1] if diagram.branches else 0
    hdf5.write_names(group, "type", tuple(point.type for point in points))
    for name in ("omega", "branch", "period_multiple"):
        hdf5.write(group, name, np.array([getattr(point, name) for point in points]))
    for name, width in (("amplitude", size), ("multipliers", 2 * size), ("state", 2 * size)):
        values = np.array([getattr(point, name) for point in points]).reshape(-1, width)
        hdf5.write(group, name, values)
    _write_ragged(group, [point.coefficients for point in points], size)


def _write_unexplored(group: h5py.Group, diagram: Diagram) -> None:
    for name in ("kind", "why"):
        hdf5.write_names(group, name, tuple(getattr(u, name) for u in diagram.unexplored))
    hdf5.write(group, "omega", np.array([u.omega for u in diagram.unexplored]), "rad/s")


def _read_unexplored(level: h5py.Group) -> list[Unexplored]:
    """What was not explored; files of before say nothing of it."""
    if "unexplored" not in level:
        return []
    group = hdf5.group(level, "unexplored")
    kinds = hdf5.read_names(group, "kind", None)
    reasons = hdf5.read_names(group, "why", len(kinds))
    omega = _finite(group, "omega", (len(kinds),))
    return [Unexplored(*each) for each in zip(kinds, map(float, omega), reasons)]


def _write_ragged(group: h5py.Group, arrays: list[NDArray[Any]], size: int) -> None:
    """Fourier coefficients (2H + 1, L) of all orbits, one after the other; H differs."""
    hdf5.write(group, "rows", np.array([len(array) for array in arrays], dtype=np.int64))
    hdf5.write(group, "coefficients", np.concatenate([np.empty((0, size)), *arrays]))


def _read_diagram(level: h5py.Group, size: int) -> Diagram:
    count = hdf5.integer(level, "branches", 0, MOST_BRANCHES)
    branches = []
    for number in range(count):
        group = hdf5.group(level, f"branch/{number}")
        omega = _finite(group, "omega", (None,))
        n = len(omega)
        parent = hdf5.integer(group, "parent", NONE, count - 1)
        origin = hdf5.integer(group, "origin", NONE, None)
        branches.append(
            Branch(
                omega=omega,
                amplitude=_finite(group, "amplitude", (n, size)),
                stable=hdf5.read(group, "stable", (n,), kinds="ub").astype(bool),
                multipliers=hdf5.read(group, "multipliers", (n, 2 * size), kinds="c"),
                period_multiple=hdf5.integer(group, "period_multiple", 1, None),
                parent=None if parent == NONE else parent,
                origin=None if origin == NONE else origin,
                coefficients=_read_ragged(group, n, size),
                ending=hdf5.text(group.attrs.get("ending", "")),
            )
        )
    return Diagram(
        branches=branches,
        special_points=_read_points(hdf5.group(level, "special_points"), size, count),
        direct=_level(level, "direct"),
        parametric=_level(level, "parametric"),
        unexplored=_read_unexplored(level),
    )


def _read_points(group: h5py.Group, size: int, branches: int) -> list[SpecialPoint]:
    types = hdf5.read_names(group, "type", None)
    n = len(types)
    for kind in types:
        if kind not in KINDS:
            raise FileError(f"special_points: found type {kind!r}")
    on = hdf5.read(group, "branch", (n,))
    if n and not 0 <= on.min() <= on.max() < branches:
        raise FileError("special_points: a point lies on no branch")
    columns: dict[str, Any] = {
        "omega": _finite(group, "omega", (n,)),
        "amplitude": _finite(group, "amplitude", (n, size)),
        "multipliers": hdf5.read(group, "multipliers", (n, 2 * size), kinds="fc"),
        "state": _finite(group, "state", (n, 2 * size)),
        "coefficients": _read_ragged(group, n, size),
    }
    multiples = hdf5.read(group, "period_multiple", (n,))
    return [
        SpecialPoint(
            type=types[i],
            branch=int(on[i]),
            period_multiple=int(multiples[i]),
            **{name: column[i] for name, column in columns.items()},
        )
        for i in range(n)
    ]


def _read_ragged(group: h5py.Group, count: int, size: int) -> list[NDArray[np.float64]]:
    rows = hdf5.read(group, "rows", (count,), kinds="iu")
    if count and rows.min() < 1:
        raise FileError("rows: an orbit without coefficients")
    flat = hdf5.read(group, "coefficients", (int(rows.sum()), size))
    return np.split(flat, np.cumsum(rows)[:-1]) if count else []


def _finite(group: h5py.Group, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    array = hdf5.read(group, name, shape)
    if not np.isfinite(array).all():
        raise FileError(f"{name}: contains NaN or infinite entries")
    return array


def _level(group: h5py.Group, name: str) -> float:
    value = float(group.attrs[name])
    if not 0 <= value < np.inf:
        raise FileError(f"{name}: found {value}; expected a finite level")
    return value
