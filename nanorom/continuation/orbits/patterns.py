"""Which modes act on which through the nonlinear terms of a system: its tensors as yes and no."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nanorom.continuation.scaled import ScaledSystem, of_tensors

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Patterns:
    """`quadratic` (L, L, L) and `cubic` (L, L, L, L), the nonlinear damping with it: whether the
    modes of the last indices together act on that of the first.
    """

    quadratic: Flags
    cubic: Flags

    def from_two(self, one: Flags, two: Flags) -> Flags:
        """Modes (L,) excited by a quadratic product of modes of two sets (L,)."""
        return np.asarray(self.quadratic[:, one][:, :, two].any(axis=(1, 2)))

    def from_three(self, one: Flags, two: Flags, three: Flags) -> Flags:
        """Modes (L,) excited by a cubic product of modes of three sets."""
        return np.asarray(self.cubic[:, one][:, :, two][..., three].any(axis=(1, 2, 3)))

    def through(self, one: Flags, two: Flags) -> Flags:
        """Which mode acts on which (L, L) by a cubic product with modes of two sets."""
        return np.asarray(self.cubic[:, one][:, :, two].any(axis=(1, 2)))


def patterns(system: ScaledSystem) -> Patterns:
    """The patterns of a system, found once."""
    known = of_tensors(system)
    if "patterns" not in known:
        cubic = system.cubic != 0
        if system.has_loss:
            cubic |= system.loss != 0
            cubic |= (system.loss != 0).swapaxes(1, 2)
        known["patterns"] = Patterns(system.quadratic != 0, cubic | cubic.swapaxes(1, 2))
    found: Patterns = known["patterns"]
    return found
