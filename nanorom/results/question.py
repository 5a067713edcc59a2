"""What is asked of a model: the drive, the range, the damping; and the equations that follow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import aimed, driven
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep

if TYPE_CHECKING:
    from nanorom.continuation import ModalSystem


@attrs.frozen
class Question:
    """Levels and range, as in a scene; a model's own damping is used unless one is given."""

    drive: Drive
    sweep: Sweep
    damping: Damping | None = None

    def of(self, model: ReducedModel) -> tuple[ModalSystem, tuple[float, float], dict[str, Any]]:
        """The modal equations, the range of omega in rad/s, and options of the continuation."""
        model = aimed(model, self.drive)
        if self.damping is not None:
            model = model.with_damping(self.damping)
        system = driven(model, self.drive)
        start, stop = self.sweep.hertz(float(model.frequency[0]))
        options = {"depth": self.sweep.depth, "tolerance": self.sweep.tolerance}
        known = {name: value for name, value in options.items() if value is not None}
        return system, (2 * np.pi * start, 2 * np.pi * stop), known
