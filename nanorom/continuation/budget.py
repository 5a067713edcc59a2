"""The work that a diagram may take, so that no slip in a drive or a range keeps it busy for hours.

A step of a branch costs the factors of a matrix, the cube of the number of unknowns. Diagrams of
common drives take hundreds of steps with ten harmonics or so; a drive that is a thousand times too
strong takes as many steps with a hundred harmonics, and they are worth nothing.
"""

from __future__ import annotations

STEPS, HARMONICS = 160, 33  # of all modes: what a level may take, in steps of so many harmonics
FEWEST = 11  # modes that fewer are counted as
ASIDE = 2.0  # what special points may take beside the branches, by what these may
SHOOTING = 300  # steps by shooting of a level that has taken no work yet


class Budget:
    """Work of one level: cubes of the numbers of unknowns of its steps."""

    def __init__(self, modes: int) -> None:
        self.most = STEPS * float(2 * HARMONICS * max(modes, FEWEST)) ** 3
        self.used = 0.0  # by steps of branches
        self.aside = 0.0  # by special points

    def step(self, unknowns: int) -> None:
        """Take note of a step."""
        self.used += float(unknowns) ** 3

    def point(self, unknowns: int) -> None:
        """Take note of a special point."""
        self.aside += float(unknowns) ** 3

    @property
    def spent(self) -> bool:
        """Whether branches have taken what they may."""
        return self.used >= self.most

    @property
    def spent_aside(self) -> bool:
        """Whether special points have taken what they may."""
        return self.aside >= ASIDE * self.most

    @property
    def shooting(self) -> int:
        """How many steps by shooting are left."""
        return max(1, int(SHOOTING * (1.0 - min(self.used / self.most, 1.0))))
