"""Linear frequency response of a reduced model: what is measured at low drive."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanorom.rom.model import ReducedModel


def linear_response(
    model: ReducedModel, force: ArrayLike, frequency: ArrayLike
) -> NDArray[np.complex128]:
    """Complex amplitudes q (n, L) in m under modal forces (L,) in N at frequencies (n,) in Hz.

    (K + i omega C - omega^2 M) q = F, motion Re(q exp(i omega t)).
    """
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)[:, None, None]
    dynamic = model.stiffness + 1j * omega * model.damping - omega**2 * np.diag(model.mass)
    right = np.broadcast_to(np.asarray(force, dtype=complex), (len(dynamic), model.size))
    return np.asarray(np.linalg.solve(dynamic, right[..., None])[..., 0])
