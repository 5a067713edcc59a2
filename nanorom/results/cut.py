"""Where the range of a sweep cuts a resonance: its largest amplitude lies outside."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from nanorom.results.response import Response
from nanorom.scene.units import with_unit
from nanorom.types import Array

HIGH = 0.5  # of the largest amplitude of a level: lower branches that rise are flanks and tails
AT_END = 1e-3  # of the range: branches that stop so near to its end are cut by it


@attrs.frozen(eq=False)
class Cut:
    """An end of a branch that still rises there, at an end of the range.

    level : from 0; omega : in rad/s; amplitude : (L,) max |q_r| in m.
    """

    level: int
    omega: float
    amplitude: Array


def cut_peaks(response: Response) -> list[Cut]:
    """Where the range ends on a branch that still rises and is among the highest of its level."""
    ends = 2 * np.pi * np.array(response.sweep.hertz(float(response.frequency[0])))
    near = AT_END * abs(ends[1] - ends[0])
    found = []
    for level, diagram in enumerate(response.diagrams):
        sizes = [np.linalg.norm(branch.amplitude, axis=1) for branch in diagram.branches]
        least = HIGH * max((float(size.max(initial=0.0)) for size in sizes), default=0.0)
        for branch, size in zip(diagram.branches, sizes):
            for end in _rising(size, least):
                omega = float(branch.omega[end])
                if np.abs(ends - omega).min() <= near:
                    found.append(Cut(level, omega, branch.amplitude[end]))
    return found


def told(response: Response) -> str:
    """What the range cuts, in a line; "" where it cuts nothing."""
    cuts = cut_peaks(response)
    places = sorted({(cut.level, with_unit(cut.omega / (2 * np.pi), "Hz", 4)) for cut in cuts})
    return ", ".join(f"level {level + 1} at {place}" for level, place in places)


def _rising(size: Array, least: float) -> Iterator[int]:
    """First and last point of a branch, if it rises to it and is high there."""
    if len(size) > 1:
        yield from (
            e for e, beside in ((0, 1), (-1, -2)) if 0 < size[e] >= max(least, size[beside])
        )
