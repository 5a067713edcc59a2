"""Predictor and corrector: the loop by which every curve is followed, with its step control.

A curve says how to advance from one of its points by a length of its own measure: predict, correct,
and refuse what went wrong by a ContinuationError. The loop halves the length where that fails and
lets it grow where it was easy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

import attrs

from nanorom.errors import ContinuationError

CUT = 0.5  # of a step that failed
GROWTH = 1.5  # of a step that was easy to correct
STRAIGHT = 0.9  # cosine between tangents of neighbours: below, another branch may have been met

Point = TypeVar("Point")
Advance = Callable[[Point, float], "tuple[Point, bool] | None"]


@attrs.frozen
class StepControl:
    """Lengths of steps in the measure of the curve, and how many steps there may be."""

    first: float
    least: float
    largest: float
    count: int


class March(Generic[Point]):
    """Neighbouring points of a curve, one pair after the other.

    advance : the point a length after another one and whether it was easy to correct; None where
        the curve ends
    ending : "end", "steps" or "lost" when there are no more; why : what failed last
    """

    def __init__(self, advance: Advance[Point], start: Point, control: StepControl) -> None:
        self.advance, self.start, self.control = advance, start, control
        self.ending, self.why = "steps", ""

    def __iter__(self) -> Iterator[tuple[Point, Point]]:
        control, here, length = self.control, self.start, self.control.first
        for _ in range(control.count):
            while True:
                try:
                    found = self.advance(here, length)
                    break
                except ContinuationError as error:
                    self.why = str(error)
                length *= CUT
                if length < control.least:
                    self.ending = "lost"
                    return
            if found is None:
                self.ending = "end"
                return
            there, easy = found
            yield here, there
            here = there
            if easy:
                length = min(GROWTH * length, control.largest)
