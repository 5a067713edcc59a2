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

PARTS = 8  # that an interval is cut into
RESOLVED = 1e-9  # of an interval: crossings closer to each other count as one


def crossings(
    path: Path, ends: tuple[float, float], eigenvalues: Sequence[Numbers]
) -> Iterator[tuple[Kind, Place, int]]:
    """Kind, place and multiplicity of what crosses between two arc lengths, in order.

    eigenvalues : (2L,) at both ends
    """
    yield from _within(path, np.array(ends), np.stack(eigenvalues), RESOLVED * (ends[1] - ends[0]))


def _within(
    path: Path, positions: Array, eigenvalues: Numbers, least: float
) -> Iterator[tuple[Kind, Place, int]]:
    counts = outside(eigenvalues)
    for i in np.flatnonzero(np.diff(counts)):
        low, high = positions[i], positions[i + 1]
        if high - low < least:
            crossed = abs(int(counts[i + 1] - counts[i]))
            for kind, multiplicity in critical_at(eigenvalues[i + 1], crossed, path.symmetric):
                yield kind, path.place((low + high) / 2), multiplicity
            continue
        inner = low + (high - low) * np.arange(1, PARTS) / PARTS
        values = path.maps([path.place(position) for position in inner])[1]
        yield from _within(
            path,
            np.concatenate([[low], inner, [high]]),
            np.concatenate([eigenvalues[i : i + 1], values, eigenvalues[i + 1 : i + 2]]),
            least,
        )
