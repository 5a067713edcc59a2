"""Motions of all modes from those of the oscillators that a manifold's masters are."""

from __future__ import annotations

import numpy as np

from nanorom.rom.manifold.equations import Equations
from nanorom.rom.manifold.invariance import Expansion
from nanorom.rom.manifold.oscillators import coordinates
from nanorom.types import Array, Numbers


def lifted(
    equations: Equations,
    expansion: Expansion,
    state: Array,
    omega: float,
    multiple: int,
    levels: tuple[float, float],
) -> Array:
    """q (n, L) at equal instants of a period, in units of the equations.

    expansion : of style "graph"; state (n, 2m): masters and their velocities there; omega: of the
    drive, `multiple` turns of which make the period; levels: of the direct and the parametric
    drive.  To what the manifold says is added how slaves answer the drive where the masters move,
    linearly.
    """
    half, basis = state.shape[1] // 2, equations.basis
    z = state @ coordinates(basis.rates[expansion.masters][:half])[:half].T
    u = expansion.monomials.values(np.concatenate([z, z.conj()], axis=1)) @ expansion.shape
    angle = 2 * np.pi * multiple / len(z) * np.arange(len(z))
    moved = state[:, :half] @ (2 * basis.shapes[:, expansion.masters[:half]].real).T
    force = levels[0] * equations.direct + levels[1] * moved @ equations.parametric.T
    push = (np.cos(angle)[:, None] * force) @ basis.inverse.T
    push[:, expansion.masters] = 0.0
    order = np.fft.fftfreq(len(z), 1.0 / len(z))[:, None]
    answer = np.fft.fft(push, axis=0) / (1j * order * omega / multiple - basis.rates)
    whole: Numbers = u + np.fft.ifft(answer, axis=0)
    return np.asarray((whole @ basis.shapes.T).real)
