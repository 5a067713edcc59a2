"""From a reduced model to its response: continuation level by level, resumed where it stopped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.continuation import add_isolas, explore_each
from nanorom.results.response import Progress, Response
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import aimed
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep


def respond(
    model: ReducedModel,
    drive: Drive,
    sweep: Sweep,
    damping: Damping | None = None,
    progress: Progress | None = None,
    processes: int | None = None,
    path: str | Path | None = None,
) -> Response:
    """Follow the periodic response over a frequency range at every drive level, isolas included
    to which the orbits of neighbouring levels lead.

    Parameters
    ----------
    model : reduced model; its own damping is used unless ``damping`` is given.
    drive, sweep : levels and range, as in a scene.
    progress : called as progress("drive levels", done, total) after every level.
    processes : how many levels are followed at once, None for one per core.
    path : `response.h5`, to which every level is saved as it is finished. Levels that an
        interrupted run with the same model and excitation left there are not computed again.

    Raises
    ------
    ContinuationError, ModelError, SceneError, FileError
        If a branch cannot be followed, a drive pattern is missing, the range is empty, or the file
        cannot be written.
    """
    from nanorom.results import responsefile

    if damping is not None:
        model = model.with_damping(damping)
    system = aimed(model, drive).system(drive.direct_pattern, drive.parametric_pattern)
    start, stop = sweep.hertz(float(model.frequency[0]))
    omega = (2 * np.pi * start, 2 * np.pi * stop)
    options: dict[str, Any] = {"depth": sweep.depth, "tolerance": sweep.tolerance}
    options = {name: value for name, value in options.items() if value is not None}

    empty = Response(
        diagrams=(), drive=drive, sweep=sweep, frequency=model.frequency, label=model.label
    )
    key = responsefile.key_of(system, omega, options)
    found = {} if path is None else responsefile.resume(path, empty, key)
    total = len(drive.levels)
    missing = [number for number in range(total) if number not in found]

    def report() -> None:
        if progress is not None:
            progress("drive levels", len(found), total)

    report()
    levels = [drive.levels[number] for number in missing]
    with responsefile.growing(empty, key, found) as file:
        for place, diagram in explore_each(system, omega, levels, processes, **options):
            found[missing[place]] = diagram
            if path is not None:
                responsefile.add(file, path, missing[place], diagram)
            report()
    diagrams = [found[number] for number in range(total)]
    whole = add_isolas(system, omega, diagrams, processes, **options)
    response = attrs.evolve(empty, diagrams=tuple(whole))
    if path is not None and whole != diagrams:
        responsefile.save(response, path, key)
    return response
