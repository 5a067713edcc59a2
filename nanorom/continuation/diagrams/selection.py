"""Which orbits of a diagram stand for it: its special points, and others along its branches."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.continuation.diagrams.diagram import Branch, Diagram
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.types import Array, Numbers

SPECIAL_SHARE = 0.5  # of all points, that special ones may take
PLAIN = "-"  # type of a point that is not special


@attrs.frozen(eq=False)
class Chosen:
    """An orbit of a diagram: level, branch and type, amplitude (L,) and multipliers (2L,)."""

    level: int
    branch: int
    type: str
    orbit: PeriodicOrbit
    amplitude: Array
    multipliers: Numbers


def of_level(
    level: int, diagram: Diagram, count: int, most_special: int | None = None
) -> list[Chosen]:
    """About ``count`` orbits of a level's diagram, in the order of its branches.

    Special points are those of largest amplitude, ``most_special`` of them, or half of all; the
    rest is spread over all branches by their lengths in the picture.
    """
    special = sorted(diagram.special_points, key=lambda p: -float(np.max(p.amplitude)))
    special = special[: int(SPECIAL_SHARE * count) if most_special is None else most_special]
    found = [
        Chosen(level, p.branch, p.type, p.orbit, np.asarray(p.amplitude), p.multipliers)
        for p in special
    ]
    branches = [(n, b) for n, b in enumerate(diagram.branches) if len(b.omega)]
    height = max((float(b.amplitude.max()) for _, b in branches), default=0.0)
    width = max((float(np.ptp(b.omega)) for _, b in branches), default=0.0)
    lengths = [_length(branch, width, height) for _, branch in branches]
    shares = _shares([float(length[-1]) for length in lengths], count - len(found))
    for (number, branch), length, share in zip(branches, lengths, shares):
        for place in _spread(length, share):
            amplitude = np.asarray(branch.amplitude[place])
            multipliers = branch.multipliers[place]
            found.append(Chosen(level, number, PLAIN, branch.orbit(place), amplitude, multipliers))
    return sorted(found, key=lambda point: point.branch)


def _length(branch: Branch, width: float, height: float) -> Array:
    """Length (n,) along a branch in a square picture."""
    total = np.linalg.norm(branch.amplitude, axis=1) / (height or 1.0)
    steps = np.hypot(np.diff(branch.omega) / (width or 1.0), np.diff(total))
    return np.concatenate([[0.0], np.cumsum(steps)])


def _shares(lengths: Sequence[float], count: int) -> list[int]:
    """How many of ``count`` points each branch gets: the longest first, one at least."""
    shares = np.zeros(len(lengths), dtype=int)
    for _ in range(max(count, 0)):
        if len(lengths):
            shares[int(np.argmax((np.array(lengths) + 1e-9) / (shares + 0.5)))] += 1
    return [int(share) for share in shares]


def _spread(length: Array, count: int) -> list[int]:
    """Rows of a branch at equal distances, the middle of each piece."""
    wanted = (np.arange(count) + 0.5) / max(count, 1) * length[-1]
    return sorted({int(np.argmin(np.abs(length - place))) for place in wanted})
