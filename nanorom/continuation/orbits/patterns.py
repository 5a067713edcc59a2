"""Which modes act on which through the nonlinear terms of a system: its tensors as yes and no."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from nanorom.continuation.scaled import ScaledSystem

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


_of_system: WeakKeyDictionary[ScaledSystem, Patterns] = WeakKeyDictionary()


def patterns(system: ScaledSystem) -> Patterns:
    """The patterns of a system, found once."""
    if system not in _of_system:
        cubic = system.cubic != 0
        if system.has_loss:
            cubic |= system.loss != 0
            cubic |= (system.loss != 0).swapaxes(1, 2)
        _of_system[system] = Patterns(system.quadratic != 0, cubic | cubic.swapaxes(1, 2))
    return _of_system[system]
