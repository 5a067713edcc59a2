"""Isolas: branches of a level to which no other branch of it leads, reached from other levels.

Where a neighbouring level has a piece that no branch leads to, and more orbits at a frequency than
a level itself, they start Newton's method there: what lies on no branch known so far is on an
isola, or leads to one. (Most are found by their folds, see `merging`.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nanorom.continuation.diagrams.diagram import Branch, Diagram
from nanorom.continuation.orbits.harmonics import resize, turned
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.types import Array

FREQUENCIES = 96  # at which orbits are counted
MOST_SEEDS = 24  # of one level for another
TINY = 1e-300  # size of a branch of rest


def seeds_for(diagram: Diagram, others: Sequence[Diagram]) -> list[PeriodicOrbit]:
    """Orbits of pieces of other levels that no branch leads to, at frequencies where those levels
    have more orbits than this one.
    """
    seeds: list[PeriodicOrbit] = []
    for other in others:
        wanted: dict[tuple[int, int], PeriodicOrbit] = {}
        for multiple in sorted({branch.period_multiple for branch in other.branches}):
            theirs = [i for i, b in enumerate(other.branches) if b.period_multiple == multiple]
            alone = [i for i in theirs if i > 0 and other.branches[i].parent is None]
            if not alone:
                continue
            ours = [b for b in diagram.branches if b.period_multiple == multiple]
            ends = np.concatenate([other.branches[i].omega for i in theirs])
            grid = np.linspace(ends.min(), ends.max(), FREQUENCIES + 2)[1:-1]
            known = sum((_crossings(branch, grid).sum(axis=0) for branch in ours), np.zeros(1))
            found = [_crossings(other.branches[i], grid) for i in theirs]
            more = sum(crossed.sum(axis=0) for crossed in found) > known
            for i in alone:
                crossed = found[theirs.index(i)]
                for k in np.flatnonzero((crossed & more).any(axis=1)):
                    wanted[i, int(k)] = other.branches[i].orbit(int(k))
        chosen = np.linspace(0, len(wanted) - 1, min(MOST_SEEDS, len(wanted))).astype(int)
        orbits = list(wanted.values())
        seeds += [orbits[i] for i in chosen]
    return seeds


def _crossings(branch: Branch, grid: Array) -> Array:
    """Whether a branch passes the frequencies (m,) between two of its points, (n - 1, m)."""
    above = branch.omega[:, None] > grid
    return np.asarray(above[1:] != above[:-1])


def is_near(branch: Branch, orbit: PeriodicOrbit) -> bool:
    """Whether an orbit is as near to a point of a branch as that is to its neighbours."""
    p = orbit.period_multiple
    if branch.period_multiple != p or len(branch) < 2:
        return False
    harmonics = max(orbit.harmonics, max((len(c) - 1) // 2 for c in branch.coefficients))
    points = np.stack([resize(c, harmonics) for c in branch.coefficients])
    size = max(float(np.abs(points).max()), TINY)
    frequency = branch.omega / branch.omega.max()

    def apart(coefficients: Array, omega: Array | float) -> Array:
        aside = np.abs(coefficients).max(axis=(-2, -1)) / size
        return np.asarray(np.maximum(aside, np.abs(omega)))

    steps = apart(np.diff(points, axis=0), np.diff(frequency))
    spacing = np.maximum(np.append(steps, 0.0), np.append(0.0, steps))
    for shift in range(p):
        moved = turned(resize(orbit.coefficients, harmonics), 2 * np.pi * shift / p)
        gaps = apart(points - moved, frequency - orbit.omega / branch.omega.max())
        if (gaps < spacing).any():
            return True
    return False
