"""Eigenvalues of long products of matrices: Floquet multipliers from the maps of parts of a period.

Of a product with entries of 1e10, round-off hides all eigenvalues below 1e-6. The cyclic matrix

    [ 0              A_p ]
    [ A_1  0             ]
    [      A_2  0        ]

of factors that are short products, each of moderate size, has the p-th roots of the eigenvalues of
A_p ... A_1; it gives them all, however far apart they are. Source: Kressner 2005,
doi:10.1007/3-540-28502-4 (section 4.2, cyclic block matrices).
"""

from __future__ import annotations

import numpy as np

from nanorom.types import Array

ROUND_OFF = 1e-10  # of an eigenvalue
LARGE = 1e3  # entries of a product beyond which the next factor begins


def product(maps: Array) -> Array:
    """The ordered product of maps (n, M, d, d), later intervals to the left."""
    while maps.shape[1] > 1:
        even = maps.shape[1] // 2 * 2
        pairs = np.matmul(maps[:, 1:even:2], maps[:, 0:even:2])
        maps = pairs if even == maps.shape[1] else np.concatenate([pairs, maps[:, even:]], axis=1)
    return np.asarray(maps[:, 0])


def product_eigenvalues(maps: Array) -> Array:
    """Eigenvalues (d,) of maps[m - 1] ... maps[0], for maps (m, d, d)."""
    factors = _factors(maps)
    count, size = len(factors), maps.shape[1]
    if count == 1:
        return np.linalg.eigvals(factors[0]).astype(complex)
    cyclic = np.zeros((count, size, count, size))
    for i, factor in enumerate(factors):
        cyclic[(i + 1) % count, :, i] = factor
    roots = np.linalg.eigvals(cyclic.reshape(count * size, count * size)).astype(complex)
    values = one_of_each(roots, count) ** count
    real = np.abs(values.imag) < ROUND_OFF * np.abs(values)  # the factors are
    return np.where(real, values.real, values)


def _factors(maps: Array) -> list[Array]:
    factors = [maps[0]]
    for step in maps[1:]:
        longer = step @ factors[-1]
        if np.abs(longer).max() > LARGE:
            factors.append(step)
        else:
            factors[-1] = longer
    return factors


def one_of_each(roots: Array, count: int) -> Array:
    """One of the `count` roots of every number: those of one sector whose edge is far from all."""
    turn = 2 * np.pi / count
    phases = np.sort(np.angle(roots) % turn)
    gaps = np.diff(np.append(phases, phases[0] + turn))
    edge = phases[gaps.argmax()] + gaps.max() / 2
    sector = np.floor((np.angle(roots) - edge) / turn).astype(int) % count
    return np.asarray(roots[sector == 0])
