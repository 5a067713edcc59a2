"""Where a measurement whose modes are not labelled is fitted: a search over the whole range.

Which mode a resonance is depends on the parameters, and every assignment has its own least
squares: a descent from one start ends in the next of many.  The search starts from a grid of
tension and bending ratios, the lowest frequency made to agree, and keeps every end.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.measurement.assignment import UNSEEN
from nanorom.measurement.fit import LEAST_NOISE, Fit
from nanorom.types import Array

RATIOS = tuple(np.geomspace(3e-4, 3.0, 14))  # D/(T L^2): a membrane ... a plate
SKEWS = tuple(np.linspace(-0.45, 0.45, 13))  # (T_x - T_y)/(T_x + T_y)
LOWEST = 3  # modes that the lowest measured one may be
CELL = 0.2  # relative, of the unknowns: half a step of the grid
COARSE = 1e-2  # relative noise: what is left of a step of the grid counts as such
NOISE = (1e-3, 1e-2)  # relative, first guesses where no uncertainties are stated
PRECISION = 1e-4  # relative, of the parameters
MOST_STARTS = 15


@attrs.frozen(eq=False)
class Solution:
    """Parameters (p,) that fit under one assignment, and the noise that it was made with.

    index, label: (n,) modes; cost: -2 log of its likelihood; square: sum of the squared weighted
    differences; scatter: relative standard deviation of the differences.
    """

    x: Array
    noise: Array | float
    index: NDArray[np.intp]
    label: tuple[str, ...]
    cost: float
    square: float
    scatter: float


def solutions(fit: Fit, length: float) -> list[Solution]:
    """All fits that the search finds, the likeliest first; one per assignment.

    length: of the film in m, half of what it spans, by which bending is measured.
    """
    error = fit.measured.uncertainty
    guesses: list[Array | float] = [*NOISE] if error is None else [error / fit.measured.frequency]
    found: dict[bytes, Solution] = {}
    for start, noise in itertools.product(_starts(fit, length), guesses):
        solution = _settled(fit, start, noise)
        key = solution.index.tobytes()
        if key not in found or solution.cost < found[key].cost:
            found[key] = solution
    return sorted(found.values(), key=lambda solution: solution.cost)


def _starts(fit: Fit, length: float) -> list[Array]:
    """The scene's own values and the best of the grid, one per assignment."""
    fit.noise = COARSE if fit.measured.uncertainty is None else np.hypot(COARSE, 1 / fit.weight)
    best: dict[bytes, tuple[float, Array]] = {}
    for x in (fit.start(), *_grid(fit, length)):
        for lowest in range(LOWEST):
            x = fit.scaled(x, lowest)
            near = fit.stepped(x, COARSE / CELL)
            lines, index = fit.evaluate(near)
            away = (np.log(lines.frequency[index]) - fit.logarithm) / fit.noise
            cost = float(away @ away) + UNSEEN * float(index.max() + 1 - len(index))
            key = index.tobytes()
            if key not in best or cost < best[key][0]:
                best[key] = cost, near
    ordered = sorted(best.values(), key=lambda start: start[0])
    return [x for _, x in ordered[:MOST_STARTS]]


def _grid(fit: Fit, length: float) -> Iterator[Array]:
    """Unknowns at every ratio of tensions, and of bending to tension, that they can have."""
    tensions = [i for i, unknown in enumerate(fit.unknowns) if unknown.pulls]
    benders = [i for i, unknown in enumerate(fit.unknowns) if unknown.bends]
    skews, ratios = [0.0], [np.nan]
    if fit.pair:
        skews = [skew for skew in SKEWS if fit.told_apart or skew >= 0]
    if fit.film(fit.start()).bends and len(fit.unknowns) - len(tensions) + bool(tensions) > 1:
        ratios = list(RATIOS)
    for skew, ratio in itertools.product(skews, ratios):
        x = fit.start()
        if fit.pair:
            x[fit.pair] = x[fit.pair].mean() * np.array([1 + skew, 1 - skew])
        values, _ = fit.physical(x)
        factor = 0.5 * (values[0] + values[1]) * length**2 * ratio / values[2] if ratio > 0 else 1.0
        if benders:
            x[benders[0]] *= factor ** (1 / fit.unknowns[benders[0]].bends)
        else:
            x[tensions] /= factor
        yield x


def _settled(fit: Fit, x: Array, noise: Array | float) -> Solution:
    """Where least squares end from a start; noise that is not stated is found on the way."""
    fit.noise = noise
    x = fit.least_squares(x, PRECISION)
    if fit.measured.uncertainty is None and fit.freedom > 0:
        fit.noise = max(fit.scatter(x), LEAST_NOISE)
        x = fit.least_squares(x, PRECISION)
    x = fit.in_order(x)
    lines, index = fit.evaluate(x)
    residual = fit.residual(x)
    return Solution(
        x=x,
        noise=fit.noise,
        index=index,
        label=tuple(lines.label[i] for i in index),
        cost=fit.cost(x),
        square=float(residual @ residual),
        scatter=fit.scatter(x),
    )
