"""Coefficients from tangent stiffnesses at deflected states.

The condensed tangent at a deflection w = sum q_j phi_j, projected on the modes, is

    K_t[r, l] - K[r, l] = 3 sum B_rljk q_j q_k

for a flat film, so that the states +j and (+j, +k) give every coefficient: L(L + 1)/2 states, and
twice the first L where the film is not flat (Perez, Wang and Mignolet 2014,
doi:10.1115/1.4028003).
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.step import StepResult, symmetric


def tangent(cases: FlatCases, amplitude: float) -> StepResult:
    """Cubic coefficients of all modes of the cases. Collective.

    amplitude : of every prescribed mode, in the unit of the plate's ``membrane_stiffness``.
    """
    n = len(cases.modes.parities)
    states = [(j, j) for j in range(n)] + list(combinations(range(n), 2))
    q = np.zeros((n, len(states)))
    for column, (j, k) in enumerate(states):
        q[[j, k], column] = amplitude
    tangents = cases.tangents(q) / (3 * amplitude**2)  # (states, r, l)
    cubic = np.empty((n,) * 4)
    for (j, k), found in zip(states, tangents):
        if j != k:
            found = 0.5 * (found - cubic[:, :, j, j] - cubic[:, :, k, k])
        cubic[:, :, j, k] = cubic[:, :, k, j] = found
    known = cases.in_plane(amplitude)
    return symmetric(np.zeros((n,) * 3), cubic, amplitude, len(states), known)
