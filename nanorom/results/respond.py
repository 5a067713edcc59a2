"""From a reduced model to its response: continuation level by level, resumed where it stopped."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import h5py
import numpy as np

from nanorom.continuation import Course, Diagram, ModalSystem, Unexplored, add_isolas, explore_each
from nanorom.errors import AccuracyWarning, FileError
from nanorom.files import hdf5, stored
from nanorom.launch import interactive, seldom, watched
from nanorom.results.diagram_file import read_diagram
from nanorom.results.larger import estimated
from nanorom.results.question import Question
from nanorom.results.response import (
    EXCITATION,
    KEY,
    Response,
    with_levels,
    write_head,
    write_level,
)
from nanorom.rom.model import ReducedModel
from nanorom.rom.range import check_range
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Excitation, Sweep
from nanorom.scene.fields import Quantity
from nanorom.scene.instrument import Instrument
from nanorom.scene.units import with_unit
from nanorom.types import Progress
from nanorom.version import version

NO_ISOLAS = "isolas are not looked for along curves of folds where the film's heat has states"


def _empty(model: ReducedModel, asked: Excitation) -> Response:
    """A response without its diagrams."""
    return Response(
        diagrams=(),
        drive=asked.drive,
        sweep=asked.sweep,
        frequency=model.frequency,
        label=model.label,
        readout=asked.readout,
    )


def respond(
    model: ReducedModel | str | Path,
    drive: Drive | Quantity | Sequence[Quantity] | Mapping[str, Any] | None = None,
    sweep: Sweep | Sequence[Quantity] | Mapping[str, Any] | None = None,
    damping: Damping | float | Sequence[float] | Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    processes: int | None = None,
    path: str | Path | None = None,
    readout: Instrument | None = None,
) -> Response:
    """Follow the periodic response over a frequency range at every drive level, isolas included
    to which the orbits of neighbouring levels lead; estimated in a larger model where the model
    has one.

    Parameters
    ----------
    model : reduced model, or its file; its own damping is used unless ``damping`` is given.
    drive, sweep : levels and range, as in a scene; those of the scene that the model was reduced
        from if left out.  A drive may be its direct levels, "5 Pa" or a list of such, a sweep its
        two ends, a damping its quality factor, and each a table as in a scene file.
    progress : called as progress("drive levels", done, total) after every level, and every second
        with what a level under way has come to in place of "drive levels".
    processes : how many levels are followed at once, None for one per core.
    path : `response.h5`, to which every level is saved as it is finished. Levels that an
        interrupted run with the same model and excitation left there are not computed again.
        Without one, Ctrl-C at a prompt or in a notebook returns the levels that are done.
    readout : kept with the response, whose tables and pictures then tell voltages.

    Raises
    ------
    ContinuationError, ModelError, SceneError, FileError
        If a branch cannot be followed, a drive pattern is missing, the range is empty, or the file
        cannot be written.
    """
    model = stored.given(ReducedModel, model)
    check_range(model.diagnostics)
    asked = Excitation.asked(model.scene, drive, sweep, damping, readout)
    return _followed(model, asked, progress, processes, path)


def _followed(
    model: ReducedModel,
    asked: Excitation,
    progress: Progress | None,
    processes: int | None,
    path: str | Path | None,
) -> Response:
    """The response of a model to what is asked of it, saved level by level."""
    question = Question(asked.drive, asked.sweep, asked.damping)
    system, omega, options = question.of(model)
    empty = _empty(model, asked)
    key = key_of(system, omega, options)
    found = {} if path is None else resume(path, empty, key)
    levels = asked.drive.levels
    total = len(levels)
    missing = {number: levels[number] for number in range(total) if number not in found}
    with watched(progress) as told, growing(empty, key, found) as file:
        told("drive levels", len(found), total)
        try:
            numbers, watch = list(missing), _watch(told, list(missing), found, total)
            given = system, omega, list(missing.values()), processes, watch
            for place, diagram in explore_each(*given, **options):
                number = numbers[place]
                found[number] = _of_modes(diagram, model.size, omega[0])
                if path is not None:
                    add(file, path, number, found[number], empty)
                told("drive levels", len(found), total)
        except KeyboardInterrupt:
            if path is not None or not found or not interactive():
                raise
            return _interrupted(empty, found)
    diagrams = [found[number] for number in range(total)]
    saved = [(diagram, len(diagram.unexplored)) for diagram in diagrams]
    if system.states is None:
        diagrams = add_isolas(system, omega, diagrams, processes, **options)
    response = estimated(attrs.evolve(empty, diagrams=tuple(diagrams)), model, question)
    now = [(diagram, len(diagram.unexplored)) for diagram in diagrams]
    if path is not None and (now != saved or response.estimates):
        response.save(path, key)
    return response


def _of_modes(diagram: Diagram, count: int, omega: float) -> Diagram:
    """A diagram of L = ``count`` modes without temperatures; curves of folds begin at whole orbits,
    with them, so that none lead to isolas.
    """
    if not diagram.branches or diagram.branches[0].amplitude.shape[1] == count:
        return diagram
    modes = diagram.of_modes(count)
    modes.unexplored.append(Unexplored("isola", omega, NO_ISOLAS))
    return modes


def _watch(
    told: Progress, numbers: Sequence[int], found: Mapping[int, Diagram], total: int
) -> Callable[[int, Course], None]:
    """Tells now and then what levels under way, of these numbers, have come to."""

    @seldom
    def watch(place: int, course: Course) -> None:
        told(_stage(numbers[place], course), len(found), total)

    return watch


def _stage(number: int, course: Course) -> str:
    """What a level, by its number from 0, has come to, in words."""
    at = with_unit(course.omega / (2 * np.pi), "Hz", 4)
    branches = f"{course.branches} branch" + "es" * (course.branches != 1)
    points = f"{course.points} special point" + "s" * (course.points != 1)
    return f"drive level {number + 1}: {branches}, {points}, at {at}"


def _interrupted(empty: Response, found: Mapping[int, Diagram]) -> Response:
    """At a prompt without a file, Ctrl-C leaves the levels that are done."""
    response = with_levels(empty, found)
    warnings.warn(
        f"interrupted: {response.unfinished} of {len(empty.drive.levels)} drive levels are missing",
        AccuracyWarning,
        stacklevel=4,
    )
    return response


def key_of(system: ModalSystem, omega: tuple[float, float], options: dict[str, Any]) -> str:
    """What a response depends on beside its levels, as a digest."""
    digest = hashlib.sha256(repr((version(), omega, sorted(options.items()))).encode())
    for name, array in system.arrays().items():
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(array).reshape(-1).data)
    return digest.hexdigest()


def resume(path: str | Path, response: Response, key: str) -> dict[int, Diagram]:
    """Diagrams that a run of the same key and levels left in a file, by number of the level."""
    try:
        with hdf5.opened(path, Response.FORMAT, Response.FORMAT_VERSION) as file:
            if not _continues(file, response, key):
                return {}
            levels, size = hdf5.group(file, "level"), len(response.frequency)
            return {int(n): read_diagram(hdf5.group(levels, n), size) for n in levels}
    except FileError:  # nothing to continue; it is replaced as any earlier result
        return {}


@contextmanager
def growing(response: Response, key: str, known: Mapping[int, Diagram]) -> Iterator[h5py.File]:
    """A file in memory that holds some levels, for `add`."""
    with hdf5.new(Response.FORMAT, Response.FORMAT_VERSION) as file:
        write_head(file, response, key)
        for number, diagram in known.items():
            write_level(file, number, diagram, response)
        yield file


def add(
    file: h5py.File, path: str | Path, number: int, diagram: Diagram, response: Response
) -> None:
    """Save one more level; until it is whole, what is at the path stays. Raises FileError."""
    write_level(file, number, diagram, response)
    hdf5.store(file, path)


def _continues(file: h5py.File, response: Response, key: str) -> bool:
    same = hdf5.text(file.attrs.get(KEY, "")) == key
    return same and hdf5.text(file.attrs[EXCITATION]) == response.excitation
