"""What points of a response are estimated to be wrong by, level by level: a table of each."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation import Diagram
from nanorom.continuation.diagrams.selection import of_level
from nanorom.continuation.larger.equations import LargerSystem
from nanorom.continuation.larger.estimate import Estimate, estimate
from nanorom.continuation.larger.growth import Growth, growths
from nanorom.files import schema
from nanorom.files.schema import array
from nanorom.types import Array

PLAIN_POINTS, MOST_SPECIAL = 12, 40  # points of a level that are looked at
LOST = 1.0  # error of a point that the larger model does not have
MOVES = 0.01  # of the largest amplitude: a mode outside that takes part


@attrs.frozen(eq=False, kw_only=True)
class Estimates:
    """Points of a level's diagram as a model of more modes has them; K modes are outside."""

    branch: NDArray[np.int64] = attrs.field(
        metadata=array("n", "1", "numbers of the branches that they lie on", kind="whole")
    )
    type: tuple[str, ...] = attrs.field(
        metadata=array("n", "", "of a special point, - for any other", kind="name")
    )
    omega: Array = attrs.field(metadata=array("n", "rad/s", "drive frequencies"))
    mode: NDArray[np.int64] = attrs.field(
        metadata=array("n", "1", "place of the mode of largest amplitude, from 0", kind="whole")
    )
    amplitude: Array = attrs.field(metadata=array("n", "m", "its max |q_r|"))
    omega_change: Array = attrs.field(
        metadata=array(
            "n",
            "1",
            "relative, to the point next to it in the larger model; NaN if it has none",
            finite=False,
        )
    )
    amplitude_change: Array = attrs.field(
        metadata=array("n", "1", "the same of that amplitude", finite=False)
    )
    takes_part: Array = attrs.field(metadata=array("n, K", "m", "max |q_r| there of modes outside"))
    share: Array = attrs.field(
        metadata=array("n, K", "1", "of the error, by the modes outside that make it")
    )
    growth_branch: NDArray[np.int64] = attrs.field(
        metadata=array("g", "1", "branches along which modes outside would grow", kind="whole")
    )
    growth_omega: Array = attrs.field(metadata=array("g", "rad/s", "where they do fastest"))
    growth_multiplier: Array = attrs.field(
        metadata=array("g", "1", "modulus of the Floquet multiplier there")
    )
    growth_share: Array = attrs.field(
        metadata=array("g, K", "1", "of each mode outside in what grows")
    )

    def __attrs_post_init__(self) -> None:
        schema.check(self)

    def __len__(self) -> int:
        return len(self.omega)

    @property
    def error(self) -> Array:
        """(n,) the larger of the two relative changes; `LOST` where there is no such point."""
        larger = np.maximum(np.abs(self.omega_change), np.abs(self.amplitude_change))
        return np.where(np.isfinite(larger), larger, LOST)

    def missing(self, row: int, labels: Sequence[str]) -> list[tuple[str, float]]:
        """Modes outside that take part at a point, the largest first, in m."""
        found = self.takes_part[row]
        large = found > MOVES * self.amplitude[row]
        return [(labels[k], float(found[k])) for k in np.argsort(-found) if large[k]]

    def making(self, row: int, labels: Sequence[str]) -> list[tuple[str, float]]:
        """Modes outside that make the error of a point, the largest share first."""
        found = self.share[row]
        return [(labels[k], float(found[k])) for k in np.argsort(-found) if found[k] > 0]

    @classmethod
    def of(
        cls, larger: LargerSystem, points: Sequence[Estimate], grown: Sequence[Growth]
    ) -> Estimates:
        """A table of estimates and of growths."""
        outside = larger.outside
        shape, grows = (len(points), len(outside)), (len(grown), len(outside))
        chosen = [each.point for each in points]
        largest = [int(point.amplitude.argmax()) for point in chosen]
        return cls(
            branch=np.array([point.branch for point in chosen], dtype=np.int64),
            type=tuple(point.type for point in chosen),
            omega=np.array([point.orbit.omega for point in chosen]),
            mode=np.array(largest, dtype=np.int64),
            amplitude=np.array([float(point.amplitude.max()) for point in chosen]),
            omega_change=np.array([each.omega for each in points]),
            amplitude_change=np.array([each.amplitude for each in points]),
            takes_part=np.array([each.moving[outside] for each in points]).reshape(shape),
            share=np.array([each.shares[outside] for each in points]).reshape(shape),
            growth_branch=np.array([each.branch for each in grown], dtype=np.int64),
            growth_omega=np.array([each.omega for each in grown]),
            growth_multiplier=np.array([each.multiplier for each in grown]),
            growth_share=np.array([each.shares[outside] for each in grown]).reshape(grows),
        )


def estimates_of(larger: LargerSystem, diagram: Diagram) -> Estimates:
    """Estimates of a level's special points and of points between, and of what grows."""
    special = min(len(diagram.special_points), MOST_SPECIAL)
    points = of_level(0, diagram, special + PLAIN_POINTS, special)
    grown = [
        growth
        for number, branch in enumerate(diagram.branches)
        for growth in growths(larger, number, branch)
    ]
    return Estimates.of(larger, [estimate(larger, point) for point in points], grown)
