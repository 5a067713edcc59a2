"""Settings of a continuation, and the check of its range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nanorom.continuation.arrays import finite
from nanorom.continuation.budget import Budget
from nanorom.errors import ContinuationError

BOUNDS = {  # of settings: beyond them they say nothing, or nothing can be kept
    "tolerance": (1e-14, 1e-2),
    "harmonics": (3, 650),
    "reach": (1.0, 1e3),
    "depth": (0, 100),
    "steps": (1, 1_000_000),
}


@dataclass(frozen=True)
class Settings:
    """What a user may tune; the defaults need no tuning.

    tolerance: size of the last harmonics relative to the orbit; series: truncation error of a step;
    depth: generations of branches that bifurcate; steps: most steps on one branch;
    harmonics: most harmonics of the response period; reach: how far, as a factor, a bifurcating
    branch may leave the frequency range on either side; step: called with the rate, in units of
    the equations, and the period multiple after every step; budget: work of all branches together.
    """

    tolerance: float = 5e-10
    series: float = 5e-10
    depth: int = 1
    steps: int = 2000
    harmonics: int = 650
    reach: float = 2.0
    step: Callable[[float, int], None] | None = None
    budget: Budget | None = None

    def __post_init__(self) -> None:
        for name, (low, high) in BOUNDS.items():
            value = getattr(self, name)
            if not finite(value) or not low <= value <= high:
                raise ContinuationError(
                    f"{name}: found {value!r}; expected a number from {low:g} to {high:g}"
                )


def check_range(omega: tuple[float, float]) -> tuple[float, float]:
    """The range as two floats; raises ContinuationError unless positive, finite and rising."""
    try:
        low, high = (float(value) for value in omega)
    except (TypeError, ValueError):
        raise ContinuationError("omega: give the range as (low, high)") from None
    if not (np.isfinite(low) and np.isfinite(high) and 0 < low < high):
        raise ContinuationError(
            f"omega: range ({low:g}, {high:g}) must be positive, finite and rising"
        )
    return low, high
