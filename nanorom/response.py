"""Frequency responses of a reduced model at several drive levels (step V of the paper)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation import Diagram, explore_levels
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
    frequencies in Hz; label: mode names.
    """

    diagrams: tuple[Diagram, ...]
    drive: Drive
    sweep: Sweep
    frequency: NDArray[np.float64]
    label: tuple[str, ...]

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
    processes: int | None = 1,
) -> Response:
    """Follow the periodic response over a frequency range at every drive level.

    Parameters
    ----------
    model : reduced model; its own damping is used unless ``damping`` is given.
    drive, sweep : levels and range, as in a scene.
    progress : called as progress("drive levels", done, total) after every level.
    processes : how many levels are followed at once, None for one per core. A script that asks
        for more than one must keep its own work under ``if __name__ == "__main__"``.

    Raises
    ------
    ContinuationError, ModelError, SceneError
        If a branch cannot be followed, a drive pattern is missing, or the range is empty.
    """
    if damping is not None:
        model = model.with_damping(damping)
    system = model.system(drive.direct_pattern, drive.parametric_pattern)
    start, stop = sweep.hertz(float(model.frequency[0]))
    omega = (2 * np.pi * start, 2 * np.pi * stop)
    options: dict[str, Any] = {"depth": sweep.depth, "tolerance": sweep.tolerance}
    options = {name: value for name, value in options.items() if value is not None}

    def report(done: int, total: int) -> None:
        if progress is not None:
            progress("drive levels", done, total)

    report(0, len(drive.levels))
    diagrams = explore_levels(system, omega, drive.levels, processes, report, **options)
    return Response(
        diagrams=tuple(diagrams),
        drive=drive,
        sweep=sweep,
        frequency=model.frequency,
        label=model.label,
    )
