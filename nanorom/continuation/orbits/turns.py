"""Members of a family of orbits that rotations of the system turn into each other.

A generator G (L, L), skew, of a symmetry exp(a G) of the equations makes a family of every orbit
that it moves.  Which member is nearest to another orbit is a question of one angle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nanorom.types import Array

SAMPLES = 64  # of a turn of the fastest pair: the best is refined from there
NEWTON_STEPS = 6
SLOWEST = 1e-6  # of the fastest pair's: slower ones do not turn


def nearest(coefficients: Array, target: Array, generators: Sequence[Array]) -> Array:
    """Coefficients (n, L) turned so that they are nearest to those of another orbit (m, L)."""
    for generator in generators:
        coefficients = _turned(coefficients, target, generator)
    return coefficients


def _turned(coefficients: Array, target: Array, generator: Array) -> Array:
    """The same by one generator, at the angle a of the largest overlap, sum w exp(i s a)."""
    values, vectors = np.linalg.eigh(-1j * generator)
    rows = min(len(coefficients), len(target))
    weights = ((target[:rows] @ vectors) * (coefficients[:rows] @ vectors.conj())).sum(axis=0)
    speeds = np.abs(values[np.abs(values) > SLOWEST * np.abs(values).max()])
    count = int(np.ceil(SAMPLES * speeds.max() / speeds.min()))
    angles = 2 * np.pi / speeds.min() / count * np.arange(count)
    overlap = np.real(np.exp(1j * np.outer(angles, values)) @ weights)
    angle = float(angles[int(overlap.argmax())])
    for _ in range(NEWTON_STEPS):
        terms = weights * np.exp(1j * values * angle)
        slope, bend = np.real(1j * values @ terms), -np.real(values**2 @ terms)
        if not bend < 0:
            break
        angle -= slope / bend
    turn = np.real((vectors * np.exp(1j * values * angle)) @ vectors.conj().T)
    return np.asarray(coefficients @ turn.T)
