"""How far a diagram is while it is being made, told across processes, too."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from multiprocessing.sharedctypes import RawArray
from typing import Any

import attrs

EVERY = 0.5  # s between two looks at what other processes are at


@attrs.frozen
class Course:
    """What a level has come to: how many branches and special points are found, and the drive
    frequency omega reached on the branch under way, in rad per unit of time of the system.
    """

    branches: int
    points: int
    omega: float


Watch = Callable[[int, Course], None]  # number of the level, what it has come to
COLUMNS = len(attrs.fields(Course))


class Board:
    """What levels have come to, in memory that their processes share."""

    def __init__(self, numbers: Iterable[int]) -> None:
        self.places = {number: place for place, number in enumerate(numbers)}
        self.cells: Any = RawArray("d", COLUMNS * max(1, len(self.places)))

    def write(self, number: int, course: Course) -> None:
        """Take note of a level."""
        first = COLUMNS * self.places[number]
        self.cells[first : first + COLUMNS] = attrs.astuple(course)

    def show(self, watch: Watch) -> None:
        """Tell all levels that have begun."""
        for number, place in self.places.items():
            branches, points, omega = self.cells[COLUMNS * place : COLUMNS * (place + 1)]
            if omega:
                watch(number, Course(int(branches), int(points), omega))
