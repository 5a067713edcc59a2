"""Motions of modes outside a model that grow along its branches: multipliers of all modes.

They are counted outside the unit circle at orbits along a branch, in the model and with the modes
outside, which are at rest or follow statically.  Where there are more, the motion that grows
fastest tells which modes it is of.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.diagrams.diagram import Branch
from nanorom.continuation.larger.equations import LargerSystem, Seen
from nanorom.continuation.orbits.bifurcations import outside
from nanorom.continuation.orbits.harmonics import Support, resize
from nanorom.types import Array

MOST_ROWS = 32  # orbits of a branch that are looked at
OUTSIDE = 0.2  # share of a growing motion that modes outside have where the model misses it


@attrs.frozen(eq=False)
class Growth:
    """What grows at an orbit of a branch, omega in the user's unit, but not in the model.

    multiplier : modulus; shares (N,) : of each mode in the motion.
    """

    branch: int
    omega: float
    multiplier: float
    shares: Array


def participation(
    larger: LargerSystem, seen: Seen, x: Array, rate: float, multiplier: complex
) -> Array:
    """Share (N,) of each mode in the motion of the multiplier nearest to a number."""
    floquet, support = larger.floquet, seen.support
    full = larger.orbit(seen, x, rate).coefficients
    p = seen.basis.period_multiple
    matrices, _ = floquet.monodromy(full[None], np.array([rate]), p, support)
    values, vectors = np.linalg.eig(matrices[0])
    whole = values if floquet.signs(support) is None else values**2
    vector = vectors[:, int(np.argmin(np.abs(whole - multiplier)))]
    size = larger.scaled.size
    stiffness = np.abs(larger.scaled.stiffness.diagonal())
    energy = np.abs(vector[:size]) ** 2 * stiffness + np.abs(vector[size:]) ** 2
    return np.asarray(energy / energy.sum())


def growths(larger: LargerSystem, number: int, branch: Branch) -> list[Growth]:
    """What grows along a branch, by its number, where it does fastest in each stretch."""
    if not len(branch):
        return []
    rows = np.unique(np.linspace(0, len(branch) - 1, MOST_ROWS).astype(int))
    seen = [larger.seen(branch.orbit(int(row))) for row in rows]
    harmonics = max(each.basis.harmonics for each in seen)
    orbits = [larger.orbit(each, each.x, each.rate).coefficients for each in seen]
    support = Support(np.any([each.support.table for each in seen], axis=0))
    found = larger.floquet.multipliers(
        np.array([resize(orbit, harmonics) for orbit in orbits]),
        np.array([each.rate for each in seen]),
        branch.period_multiple,
        support,
    )
    more = outside(found) > outside(branch.multipliers[rows])
    largest = np.abs(found).max(axis=1)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], more, [False]])))
    result = []
    for first, last in ends.reshape(-1, 2):
        place = first + int(largest[first:last].argmax())
        each, shares = seen[place], np.zeros(larger.scaled.size)
        for multiplier in found[place, : int(outside(found[place]))]:
            share = participation(larger, each, each.x, each.rate, complex(multiplier))
            if share[larger.outside].sum() > OUTSIDE:
                shares = np.maximum(shares, share)
        if shares.any():
            omega, size = float(branch.omega[rows[place]]), float(largest[place])
            result.append(Growth(number, omega, size, shares))
    return result
