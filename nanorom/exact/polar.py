"""What any finite-element code needs to compare a drum's tensor: unique shapes.

An eigensolver gives pairs in any rotation and modes in any scale and sign.  Here they are made
unique from their values along two rays only, by the known order of a drum's modes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.exact import drum
from nanorom.types import Array

Evaluate = Callable[[Array], Array]  # points (m, 2) -> values (L, m) of all modes

POINTS = 401  # on a ray
FIT = 4  # points to either side of the largest value through which its top is fitted


def nodal_diameters(kappa: float, count: int) -> list[int]:
    """Of the ``count`` lowest modes of a drum with T R^2/D = kappa, and of the last one's twin."""
    found: list[int] = []
    for _, p, _ in drum.plate_roots(kappa, count):
        if len(found) < count:
            found += [p] * (1 if p == 0 else 2)
    return found


def unique(diameters: list[int], evaluate: Evaluate) -> Array:
    """Matrix C (L, L): shapes @ C are cos before sin, max |phi| = 1, positive there.

    diameters: nodal diameters of the modes in order, pairs as two equal entries.
    """
    r = np.linspace(0, 1, POINTS) * (1 - 1e-9)
    along = evaluate(np.column_stack([r, 0 * r]))
    matrix = np.zeros((len(diameters),) * 2)
    mode = 0
    while mode < len(diameters):
        p = diameters[mode]
        if p == 0:
            matrix[mode, mode] = 1 / along[mode, 0]
            mode += 1
            continue
        pair = [mode, mode + 1]
        # along theta = 0 only the cosine is seen: the direction in which the values are large
        cosine, sine = np.linalg.svd(along[pair].T, full_matrices=False)[2]
        angle = np.pi / (2 * p)
        across = evaluate(np.column_stack([r * np.cos(angle), r * np.sin(angle)]))
        for column, (values, c) in enumerate(((along, cosine), (across, sine))):
            matrix[pair, mode + column] = c / top(r, c @ values[pair])
        mode += 2
    return matrix


def top(r: Array, values: Array) -> float:
    """Signed value at the largest |value|, between the points by a polynomial fit."""
    i = int(np.clip(np.abs(values).argmax(), FIT, len(r) - 1 - FIT))
    near = slice(i - FIT, i + FIT + 1)
    x = (r[near] - r[i]) / (r[1] - r[0])
    fit = np.polynomial.Polynomial.fit(x, values[near], 6)
    tops = [t.real for t in fit.deriv().roots() if abs(t.imag) < 1e-9 and abs(t.real) <= FIT]
    candidates = np.array([float(fit(t)) for t in [*tops, 0.0]])
    return float(candidates[np.abs(candidates).argmax()])
