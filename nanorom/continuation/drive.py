"""Drives with several harmonics of one frequency, each with a phase of its own.

    F(t, q) = sum_k (direct_level^p_k J_k + parametric_level^p_k P_k q) cos(k omega t + phase_k)

The system's own patterns J and P are the term k = 1 with phase 0. A degenerate parametric amplifier
has its signal there and its pump at k = 2; a gate's (V + v cos omega t)^2 has terms 0, 1 and 2,
of which the first and the last go with the square of v.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from nanorom.continuation.arrays import checked, finite, square
from nanorom.errors import ContinuationError
from nanorom.types import Array

HIGHEST = 20  # harmonic of a drive: beyond, orbits of 150 harmonics are too few
HIGHEST_POWER = 4  # of a level: a square is what fields act with, its square what that modulates
CARRIER = 1  # place of cos(omega t) among the terms 1, cos, sin, cos 2, ...


@attrs.frozen(eq=False)
class Drive:
    """One harmonic of the drive, as an entry of `drives` of a `ModalSystem`.

    harmonic: k, from 0 (a constant force) to 20; phase: of cos(k omega t + phase), in rad.
    direct (L,): J_k, force pattern at direct level 1; parametric (L, L) or (L,): P_k, stiffness
    pattern at parametric level 1; states (S,): what the states of first order are fed with at
    direct level 1, in their units by time; power: p_k, from 1, of the level that it goes with. What
    is left out is zero.
    """

    harmonic: int = 1
    phase: float = 0.0
    direct: Any = None
    parametric: Any = None
    states: Any = None
    power: int = 1

    def __attrs_post_init__(self) -> None:
        if self.power not in range(1, HIGHEST_POWER + 1):
            raise ContinuationError(
                f"drives: found power {self.power!r}; allowed a whole number from 1 to "
                f"{HIGHEST_POWER}"
            )
        if self.harmonic not in range(HIGHEST + 1):
            raise ContinuationError(
                f"drives: found harmonic {self.harmonic!r}; allowed a whole number from 0 to "
                f"{HIGHEST}"
            )
        if not finite(self.phase) or (self.harmonic == 0 and self.phase != 0):
            raise ContinuationError(
                f"drives: found phase {self.phase!r} of harmonic {self.harmonic}; allowed a finite "
                "number in rad, and 0 of a constant force"
            )

    def filled(self, size: int, states: int) -> Drive:
        """The same drive of `size` modes with all its arrays; raises ContinuationError."""
        return attrs.evolve(
            self,
            direct=_or_zeros(self.direct, size, "drives.direct"),
            parametric=square(
                0.0 if self.parametric is None else self.parametric, size, "drives.parametric"
            ),
            states=_or_zeros(self.states, states, "drives.states"),
        )


def _or_zeros(value: object, size: int, name: str) -> Array:
    return np.zeros(size) if value is None else checked(value, (size,), name)


def terms(drives: Sequence[Drive], name: str, own: Array, level: float = 1.0) -> Array:
    """Patterns (..., 2K + 1) by the terms 1, cos, sin, cos 2, ... of the drive's angle omega t.

    name: which array of the drives; own (...): the pattern of the term cos(omega t) beside them;
    level: at which they are those per unit of it.
    """
    highest = max([1, *(drive.harmonic for drive in drives)])
    result = np.zeros((*own.shape, 2 * highest + 1))
    result[..., CARRIER] = own
    for drive in drives:
        pattern = level ** (drive.power - 1) * np.asarray(getattr(drive, name))
        cosine = max(2 * drive.harmonic - 1, 0)
        result[..., cosine] += np.cos(drive.phase) * pattern
        if drive.harmonic:
            result[..., cosine + 1] -= np.sin(drive.phase) * pattern
    return result


def padded(pattern: Array, columns: int) -> Array:
    """Terms (..., 2K + 1) with zeros for higher harmonics; a pattern alone is that of cos(omega
    t).
    """
    missing = columns - pattern.shape[-1]
    return np.pad(pattern, [(0, 0)] * (pattern.ndim - 1) + [(0, missing)])
