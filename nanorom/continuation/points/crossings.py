"""Crossings of the unit circle that no change of sign shows: several multipliers at once.

Test functions change sign where an odd number of multipliers is critical. In systems with pairs of
equal frequencies two of them are, at one place or nearly so; the number of multipliers outside the
circle tells.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from nanorom.continuation.branches.path import Path, Place
from nanorom.continuation.orbits.bifurcations import Kind, critical_at, outside
from nanorom.types import Array, Numbers

PARTS = 8  # that an interval is cut into at first; later into halves, which cost less
BESIDE = 1e-3  # of an interval: how near to a known crossing others are not looked for
RESOLVED = 1e-9  # of an interval: crossings closer to each other are taken for one at first


def crossings(
    path: Path, ends: tuple[float, float], eigenvalues: Sequence[Numbers], known: Array
) -> Iterator[tuple[Kind, Place, int]]:
    """Kind, place and multiplicity of what crosses between two arc lengths, in order.

    eigenvalues : (2L,) at both ends; known : places between them (m,) of other crossings
    """
    length = ends[1] - ends[0]
    # an interval of neighbouring numbers cannot be cut any more
    least = max(RESOLVED * length, PARTS * float(np.spacing(np.abs(ends).max())))
    edges = np.clip((known[:, None] + [-BESIDE * length, BESIDE * length]).ravel(), *ends)
    values = [eigenvalues[0], *path.maps([path.place(x) for x in edges])[1], eigenvalues[1]]
    positions = np.concatenate([ends[:1], edges, ends[1:]])
    for i in range(0, len(positions) - 1, 2):
        part = slice(i, i + 2)
        yield from _within(path, positions[part], np.stack(values[part]), least, PARTS)


def _within(
    path: Path, positions: Array, eigenvalues: Numbers, least: float, parts: int = 2
) -> Iterator[tuple[Kind, Place, int]]:
    counts = outside(eigenvalues)
    for i in np.flatnonzero(np.diff(counts)):
        low, high = positions[i], positions[i + 1]
        if high - low < least:
            crossed = abs(int(counts[i + 1] - counts[i]))
            for kind, multiplicity in critical_at(eigenvalues[i + 1], crossed, path.symmetric):
                yield kind, path.place((low + high) / 2), multiplicity
            continue
        inner = low + (high - low) * np.arange(1, parts) / parts
        values = path.maps([path.place(position) for position in inner])[1]
        yield from _within(
            path,
            np.concatenate([[low], inner, [high]]),
            np.concatenate([eigenvalues[i : i + 1], values, eigenvalues[i + 1 : i + 2]]),
            least,
        )
