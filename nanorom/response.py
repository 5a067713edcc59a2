"""Frequency responses of a reduced model at several drive levels (step V of the paper)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.aim import aimed
from nanorom.continuation import Diagram, add_isolas, explore_each
from nanorom.excitation import Damping, Drive, Sweep
from nanorom.rom import ReducedModel

Progress = Callable[[str, int, int], None]  # stage, done, of how many

SPECIAL_POINTS = {
    "LP": "fold",
    "PD": "period doubling",
    "NS": "Neimark-Sacker",
    "BP": "branch point",
}


@attrs.frozen(eq=False, kw_only=True)
class Response:
    """The response diagrams of one model, one per drive level.

    diagrams: omega in rad/s, amplitudes (n, L) in m; drive: the levels; frequency: (L,) natural
    frequencies in Hz; label: mode names. Read from the file of a run that has not ended, it holds
    the levels finished so far, and ``unfinished`` counts the others.
    """

    diagrams: tuple[Diagram, ...]
    drive: Drive
    sweep: Sweep
    frequency: NDArray[np.float64]
    label: tuple[str, ...]
    unfinished: int = 0

    def save(self, path: str | Path) -> None:
        """Write `response.h5`, whole or not at all; raises FileError."""
        from nanorom import responsefile

        responsefile.save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Response:
        """Read `response.h5`; raises FileError if it is not a sound response."""
        from nanorom import responsefile

        return responsefile.load(path)


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
    from nanorom import responsefile

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
