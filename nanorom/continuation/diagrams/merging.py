"""Isolas from curves of folds.

As the level rises, an isola opens at a point and merges with another branch later: at both levels
two folds meet, so in the plane of frequency and level a curve of folds turns back there. The folds
that are known are followed beyond the levels asked for; where their curves cross a level at a place
at which it has no fold, that fold is on an isola. The response at the highest level of the curves
lends its folds, too (`stronger`). Each curve is followed once, for the folds that
it passes at the other levels are told by it. Source: Detroux et al. 2015,
doi:10.1016/j.cma.2015.07.017 (section 4.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import attrs
import numpy as np

from nanorom.continuation.curves.locus import Locus, locus
from nanorom.continuation.diagrams.diagram import Diagram, SpecialPoint
from nanorom.continuation.diagrams.stronger import folds_of_response
from nanorom.continuation.orbits.bifurcations import FOLD
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.system import ModalSystem
from nanorom.errors import ContinuationError

ABOVE, BELOW = 1.0, 0.5  # how far beyond the highest and the lowest level, as parts of them
ASIDE = 1.5  # factor by which curves may leave the range of frequencies and come back
TOLERANCE = 1e-4  # of the orbits of a curve: they are to lie near those of a branch
STEPS, LARGEST_STEP = 150, 0.15  # of a curve on either side of a fold
SAME = 1e-3  # of a fold: by how much it may differ from the curve that passes it
MOST_CURVES = 60
FEW_STEPS = 300  # of the response to a stronger drive: cheap enough for any level
NO_LINE = "isolas are looked for along curves of folds by levels; these levels are on no line"
STRAIGHT = 1e-9  # of the levels: what may be off a line


@attrs.frozen(eq=False)
class Ladder:
    """Levels along a line: numbers of the diagrams, a change of (direct, parametric), and how many
    times that each of the levels is away from the first.
    """

    numbers: list[int]
    change: tuple[float, float]
    steps: list[float]
    ends: tuple[float, float]  # limits of the curves, in steps


def missing_folds(
    system: ModalSystem, omega: tuple[float, float], diagrams: Sequence[Diagram]
) -> tuple[dict[int, list[PeriodicOrbit]], str]:
    """Orbits at folds that diagrams lack, by number of the diagram, from curves of the folds that
    they have, and that the response to a stronger drive has; and what was left out, if anything.

    omega : the range of the diagrams (low, high), rad per unit of time of the system.
    """
    found: dict[int, list[PeriodicOrbit]] = {}
    count, asked, why = 0, len(diagrams), ""
    if not system.proportional:
        return found, "" if len(diagrams) < 2 else NO_LINE
    for ladder in ladders(diagrams):
        ladder, diagrams = _with_stronger(system, omega, diagrams, ladder)
        if diagrams[-1].unexplored:
            why = "isolas: not looked for from all folds at the highest level, which cost too much"
        for curve in _curves(system, omega, diagrams, ladder):
            count += 1
            if count > MOST_CURVES:
                return found, f"isolas are looked for along {MOST_CURVES} curves; there are more"
            for number, orbit in _crossings(curve, ladder):
                known = diagrams[number].points(FOLD.code)
                inside = omega[0] < orbit.omega < omega[1] and number < asked
                if inside and not any(_is_same(point.orbit, orbit) for point in known):
                    found.setdefault(number, []).append(orbit)
    return found, why


def _with_stronger(
    system: ModalSystem, omega: tuple[float, float], diagrams: Sequence[Diagram], ladder: Ladder
) -> tuple[Ladder, list[Diagram]]:
    """A ladder with a rung at its upper end, the folds of the response there."""
    top = ladder.ends[1]
    first = diagrams[ladder.numbers[0]]
    level = first.direct + top * ladder.change[0], first.parametric + top * ladder.change[1]
    # what is followed here is no answer of its own: it may take as long as the answer
    orbits = sum(
        len(branch) for branch in diagrams[ladder.numbers[np.argmax(ladder.steps)]].branches
    )
    more = folds_of_response(system, omega, level, TOLERANCE, max(orbits, FEW_STEPS))
    numbers, steps = [*ladder.numbers, len(diagrams)], [*ladder.steps, top]
    return attrs.evolve(ladder, numbers=numbers, steps=steps), [*diagrams, more]


def ladders(diagrams: Sequence[Diagram]) -> Iterator[Ladder]:
    """The levels as few lines of neighbours; a level alone is on a line from rest."""
    levels = np.array([[diagram.direct, diagram.parametric] for diagram in diagrams])
    start = 0
    while start < len(levels):
        end = start + 1
        while end < len(levels) and _on_a_line(levels[start : end + 1]):
            end += 1
        some = levels[start:end]
        change = some[-1] - some[0] if end > start + 1 else some[0]
        length = float(np.linalg.norm(change))
        if length:
            steps = (some - some[0]) @ change / length**2
            sizes = np.linalg.norm(some[[steps.argmin(), steps.argmax()]], axis=1) / length
            ends = float(steps.min() - BELOW * sizes[0]), float(steps.max() + ABOVE * sizes[1])
            numbers = list(range(start, end))
            yield Ladder(numbers, (float(change[0]), float(change[1])), steps.tolist(), ends)
        start = end


def _on_a_line(levels: np.ndarray) -> bool:
    change = levels[-1] - levels[0]
    aside = (levels - levels[0]) @ np.array([-change[1], change[0]])
    return bool(change.any()) and bool(np.abs(aside).max() <= STRAIGHT * (levels**2).sum())


def _curves(
    system: ModalSystem, omega: tuple[float, float], diagrams: Sequence[Diagram], ladder: Ladder
) -> Iterator[Locus]:
    """Curves through all folds of the levels of a ladder, each curve once; from strong drive down,
    where there are most folds. The steps of a curve are those of the ladder.
    """
    passed: dict[int, list[PeriodicOrbit]] = {number: [] for number in ladder.numbers}
    order = np.argsort(ladder.steps)[::-1]
    for number, step in [(ladder.numbers[i], ladder.steps[i]) for i in order]:
        for point in diagrams[number].points(FOLD.code):
            if any(_is_same(point.orbit, orbit) for orbit in passed[number]):
                continue
            try:
                curve = _followed(system, omega, diagrams[number], point, ladder, step)
            except ContinuationError:
                continue  # one of a family, or at a cusp
            for other, orbit in _crossings(curve, ladder):
                passed[other].append(orbit)
            yield curve


def _followed(
    system: ModalSystem,
    omega: tuple[float, float],
    diagram: Diagram,
    point: SpecialPoint,
    ladder: Ladder,
    step: float,
) -> Locus:
    direct, parametric = ladder.change
    patterns = system.arrays()
    curve = locus(
        system,
        point,
        diagram.direct,
        diagram.parametric,
        omega=(omega[0] / ASIDE, omega[1] * ASIDE),
        level=(ladder.ends[0] - step, ladder.ends[1] - step),
        parameter={
            "direct": direct * patterns["direct"],
            "parametric": parametric * patterns["parametric"],
        },
        steps=STEPS,
        largest_step=LARGEST_STEP,
        tolerance=TOLERANCE,
        at=[other - step for other in ladder.steps],
        turns=False,
        codimension_two=False,
    )
    return attrs.evolve(curve, level=curve.level + step)


def _crossings(curve: Locus, ladder: Ladder) -> Iterator[tuple[int, PeriodicOrbit]]:
    """Where a curve has the levels of a ladder: numbers of the diagrams and orbits."""
    for number, step in zip(ladder.numbers, ladder.steps):
        for index in np.flatnonzero(np.abs(curve.level - step) < STRAIGHT * max(1.0, abs(step))):
            yield number, curve.orbit(int(index))


def _is_same(one: PeriodicOrbit, two: PeriodicOrbit) -> bool:
    """Whether two folds are one, or images of each other: by frequency and size of all modes."""
    if one.period_multiple != two.period_multiple:
        return False
    if abs(one.omega - two.omega) > SAME * two.omega:
        return False
    sizes = [np.linalg.norm(orbit.coefficients, axis=0) for orbit in (one, two)]
    return bool(np.abs(sizes[0] - sizes[1]).max() <= SAME * np.linalg.norm(sizes[1]))
