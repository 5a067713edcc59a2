"""What lies outside the modes, and whether it follows them as statically as it is taken to.

A mode at omega pushes on the rest of its film at rest and at 2 omega, by A q^2 = A a^2/2 (1 + cos 2
omega t).  Two thirds of what the rest adds to the cubic force are the answer to the first, a third
that to the second; the latter is larger by 1/(1 - (2 omega/omega_o)^2), omega_o being the frequency
of that answer.  Beside it stands the whole effective coefficient of the mode, with its own
quadratic term, b - 10/9 alpha^2/k (Nayfeh and Mook 1979, section 4.1).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from nanorom.errors import AccuracyWarning
from nanorom.scene.units import with_unit

ANSWER = 1 / 3  # share of the static answer that moves at twice the frequency
OWN = 10 / 9  # of alpha^2/k
TOLD = 0.1  # change of an effective coefficient, from which it is told
LARGEST = 10.0  # factor that is told at most: at resonance with what is outside there is no other


def dynamics(
    frequency: np.ndarray,
    own: np.ndarray,
    stiffness: np.ndarray,
    quadratic: np.ndarray,
    cubic: np.ndarray,
    outside: np.ndarray,
) -> np.ndarray:
    """Relative change (L,) of each mode's effective cubic coefficient by what does not follow.

    frequency (L,) Hz; own (L,) Hz: of the answer to the square of each mode; stiffness (L, L) N/m,
    quadratic (L, L, L) N/m^2, cubic and outside (L, L, L, L) N/m^3.
    """
    r = np.arange(len(frequency))
    ratio = (2 * frequency / own) ** 2
    larger = np.divide(1.0, 1.0 - ratio, out=np.full(len(r), np.inf), where=ratio != 1.0)
    larger = np.clip(larger, -LARGEST, LARGEST)
    added = outside[r, r, r, r]
    whole = cubic[r, r, r, r] + added - OWN * quadratic[r, r, r] ** 2 / stiffness[r, r]
    change = np.abs(ANSWER * added * (larger - 1.0))
    return np.asarray(np.divide(change, np.abs(whole), out=np.zeros(len(r)), where=whole != 0))


def check(names: Sequence[str], change: np.ndarray, frequency: np.ndarray, own: np.ndarray) -> None:
    """Warn if the effective coefficient of the lowest mode changes by more than `TOLD`.

    Higher modes are most often there for its sake; what they lack is kept beside the model.
    """
    if change[0] <= TOLD:
        return
    warnings.warn(
        f"{names[0]} at {with_unit(frequency[0], 'Hz')} moves the film at twice its frequency "
        f"too; what lies outside the modes answers near {with_unit(own[0], 'Hz')} and does not "
        "follow at once, which "
        f"changes its effective cubic coefficient by about {change[0]:.0%}; take the modes there "
        "too, or "
        '[modes] count = "auto"',
        AccuracyWarning,
        stacklevel=2,
    )
