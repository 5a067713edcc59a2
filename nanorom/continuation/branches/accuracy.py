"""How accurate the steps of a branch must be: as small as the damping is what an orbit hangs on.

At resonance inertia and stiffness cancel and the damping force alone, 1/Q of either, holds the
drive: a residual that is small beside the stiffness may still be as large as the damping force, and
an orbit of a false amplitude would pass. So residuals and truncation are bounded by the damping.
Round-off is not: in the direction that the damping holds, Newton's method comes no closer than Q
times round-off.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.orbits.harmonics import Support
from nanorom.continuation.orbits.linear import free_motions
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings

CORRECTED = 1e-7  # of an orbit from which a step begins: the last change; the series does the rest
SOLVED = 1e-10  # of an orbit by itself: the last change
AT_END = 1e-6  # of the orbit: residual at the end of a step
LITTLE = 1e-3  # damping, as 1/Q, below which it bounds the accuracy
SMALL_CHANGE = 1e-2  # of the damping: last change, which the next one would square
SMALL_FORCE = 1e-5  # of the damping force: residual, and truncation of a series
BESIDE = 2e-2  # of the damping, that multipliers which meet may be off by
MULTIPLIERS = (1e-11, 1e-8)  # finest and coarsest truncation of them
TERMS = 1e-13  # of the orbit: round-off of a residual with all its terms
ROUND_OFF = 1e-15  # of the orbit: round-off of a change, before it is divided by the damping


@attrs.frozen
class Accuracy:
    """Sizes relative to the orbit: last changes of Newton's method at the start of a step and of an
    orbit by itself, truncation of a series, residual at the end of a step.

    loss : 1/Q of the least damped mode, which a disturbance of the orbit may excite
    sharp : whether the last change of Newton's method turns the Jacobian by more than the damping
        of the moving modes allows: then a series needs that of its own point
    """

    loss: float
    sharp: bool
    corrected: float = CORRECTED
    solved: float = SOLVED
    series: float = AT_END
    residual: float = AT_END

    @classmethod
    def of(cls, system: ScaledSystem, support: Support, settings: Settings) -> Accuracy:
        """What the least damped of the moving modes asks for."""
        moving = least_loss(system.restrict(np.flatnonzero(support.table.any(axis=1))))
        if moving > LITTLE:
            return cls(least_loss(system), False, series=settings.series)
        closest = ROUND_OFF / moving
        return cls(
            least_loss(system),
            True,
            corrected=max(min(CORRECTED, SMALL_CHANGE * moving), closest),
            solved=max(SOLVED, closest),
            series=max(min(settings.series, SMALL_FORCE * moving), TERMS),
            residual=max(min(AT_END, SMALL_FORCE * moving), TERMS),
        )

    @property
    def tongues(self) -> bool:
        """Whether tongues may be too narrow to be found by sampling."""
        return self.loss <= LITTLE


def least_loss(system: ScaledSystem) -> float:
    """1/Q of the least damped free motion, at most 1."""
    size = system.size
    if not size:
        return 1.0
    values = free_motions(system, np.zeros(size))[0]
    return float(np.clip((2 * np.abs(values.real) / np.abs(values)).min(), ROUND_OFF, 1.0))


def truncation(system: ScaledSystem) -> float:
    """To what multipliers are to be known that tell where special points may be: where two meet,
    each is off by the root.
    """
    return float(np.clip((BESIDE * least_loss(system)) ** 2, *MULTIPLIERS))
