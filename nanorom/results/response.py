"""Frequency responses of a reduced model at several drive levels (step V of the paper)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation import Diagram
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep

Progress = Callable[[str, int, int], None]  # stage, done, of how many


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
        from nanorom.results import responsefile

        responsefile.save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Response:
        """Read `response.h5`; raises FileError if it is not a sound response."""
        from nanorom.results import responsefile

        return responsefile.load(path)
