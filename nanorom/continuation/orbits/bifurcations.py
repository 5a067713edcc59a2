"""The kinds of bifurcations of periodic orbits, in one table, and the functions that vanish there.

    LP  fold                  d rate / da = 0 along the branch
    PD  period doubling       prod (mu_i + 1) = 0
    BP  branch point          prod (mu_i - 1) / (d rate / da) = 0
    NS  Neimark-Sacker        prod_{i<j} (mu_i mu_j - 1) = 0 at a complex pair

On a symmetric orbit the eigenvalues of the half-period map (with the symmetry applied) take the
place of the multipliers: -1 is then the breaking of the symmetry. Source: Kuznetsov, Elements of
Applied Bifurcation Theory, section 10.2 (test functions).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import attrs
import numpy as np

from nanorom.continuation.orbits.pairs import Index
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

CONFIRMED = 1e-7  # of a critical multiplier: what a point may be off by and still is reported
MEETING = 1e-4  # distance of multipliers of which round-off makes more than it should
MEETING_IN_TONGUE = 1e-6  # as before, where between two such points there is a tongue as narrow
NEAR = 0.2  # distance of two real multipliers that may be a complex pair nearby
ON_CIRCLE = 1e-9  # of a modulus: round-off of those that are 1 throughout
ALIKE = 1e-4  # imaginary part of a real multiplier that another one comes close to
REAL = 1e-9  # imaginary part below which a multiplier is a real one
TINY = 1e-300  # keeps the logarithm of zero finite

Condition = Literal["turn", "flip", "unit", "circle"]


@attrs.frozen
class Kind:
    """A kind of bifurcation: a row of the table.

    code : "LP", ... as `SpecialPoint.type` has it
    condition : what becomes critical: the rate turns, a multiplier is -1 ("flip") or 1 ("unit"), or
        a complex pair has modulus 1 ("circle")
    multipliers : how many become critical
    period_factor : of the branches that leave it, in periods of its own; 0 where none does
    marker : with which plots draw it (a name of Matplotlib's)
    """

    code: str
    name: str
    condition: Condition
    multipliers: int
    period_factor: int
    marker: str

    @property
    def branches(self) -> bool:
        """Whether branches leave it."""
        return self.period_factor > 0

    @property
    def at_ends(self) -> bool:
        """Whether the end of a branch that bifurcates looks like it: the branch is symmetric about
        what it leaves.
        """
        return self.condition in ("turn", "unit")

    def distance(self, multipliers: Numbers, multiplicity: int = 1) -> float:
        """Of the critical multiplier from where it belongs; multipliers (2L,) of a whole period.

        multiplicity : how many of them (or pairs) are to be there; the farthest counts
        """
        if self.condition == "circle":
            distances = np.abs(np.abs(multipliers[multipliers.imag > REAL]) - 1)
        else:
            distances = np.abs(multipliers - TARGETS[self.condition])
        missing = np.full(multiplicity, np.inf)
        return float(np.sort(np.append(distances, missing))[multiplicity - 1])

    def apart(self, multipliers: Numbers, multiplicity: int = 1) -> float:
        """As `distance`, less what round-off makes of it where the next multiplier is close.

        Of two that nearly meet, as all do at folds of a motion without damping, each is known to
        the root of round-off alone, their product to round-off.
        """
        distance = self.distance(multipliers, multiplicity)
        if self.condition == "circle":
            return distance
        meeting = MEETING if self is FOLD else MEETING_IN_TONGUE
        return distance * min(1.0, self.distance(multipliers, multiplicity + 1) / meeting)

    def crossing(self, multipliers: Numbers) -> float:
        """A number that changes sign where it happens (not for a turn, which is the branch's)."""
        if self.condition == "circle":
            return pairs_outside(multipliers) - 0.5
        return determinant(multipliers, TARGETS[self.condition])


TARGETS = {"turn": 1.0, "unit": 1.0, "flip": -1.0}
FOLD = Kind("LP", "fold", "turn", 1, 0, "s")
DOUBLING = Kind("PD", "period doubling", "flip", 1, 2, "D")
TORUS = Kind("NS", "Neimark-Sacker", "circle", 2, 0, "o")
BRANCHING = Kind("BP", "branch point", "unit", 1, 1, "^")
KINDS = {kind.code: kind for kind in (FOLD, DOUBLING, TORUS, BRANCHING)}
CROSSED = {kind.condition: kind for kind in (DOUBLING, BRANCHING, TORUS)}  # by multipliers


def crossed_kind(condition: Condition, symmetric: bool) -> Kind:
    """What happens where multipliers, or those of half a period of a symmetric orbit, cross."""
    return BRANCHING if symmetric and condition == "flip" else CROSSED[condition]


def conditions(modes: int) -> tuple[Condition, ...]:
    """What the multipliers of so many modes may do; of one mode a pair is always inside."""
    return tuple(c for c, kind in CROSSED.items() if kind.multipliers <= modes)


def signed_log_product(factors: Numbers) -> tuple[Array, Array]:
    """Sign and log modulus of the (real) product over the last axis."""
    logs = np.log(np.maximum(np.abs(factors), TINY)).sum(axis=-1)
    signs = np.where(np.cos(np.angle(factors).sum(axis=-1)) >= 0, 1.0, -1.0)
    return signs, logs


def test_function(
    condition: Condition, eigenvalues: Numbers, slopes: Array, pairs: tuple[Index, Index]
) -> tuple[Array, Array]:
    """Sign and log modulus of the test function of a condition at points with eigenvalues (n, 2L)
    and slopes (n,) of the rate; `pairs` of eigenvalues that belong to the same modes.
    """
    if condition == "circle":
        first, second = pairs
        return signed_log_product(eigenvalues[:, first] * eigenvalues[:, second] - 1.0)
    signs, logs = signed_log_product(eigenvalues - TARGETS[condition])
    if condition == "unit":
        signs = signs * np.where(slopes >= 0, 1.0, -1.0)
        logs = logs - np.log(np.maximum(np.abs(slopes), TINY))
    return signs, logs


def critical_value(
    kind: Kind, symmetric: bool, multiplicity: int = 1
) -> Callable[[Numbers, float], float]:
    """A smooth function of the eigenvalues (2L,) and the slope of the rate that is zero at the
    point.

    A product, not the critical eigenvalue itself: that is not smooth where it meets another one. Of
    several that are critical at once, their mean: the product has no change of sign there.
    """
    chosen: dict[str, float] = {}

    def mean(eigenvalues: Numbers, slope: float) -> float:
        if kind.condition == "circle":
            logs = np.log(np.abs(eigenvalues[eigenvalues.imag > REAL]))
            return float(logs[np.argsort(np.abs(logs))[:multiplicity]].mean())
        if not chosen:
            flips = kind.condition == "flip" or (symmetric and _nearer_flip(eigenvalues))
            chosen["target"] = -1.0 if flips else 1.0
        gaps = eigenvalues - chosen["target"]
        return float(gaps[np.argsort(np.abs(gaps))[:multiplicity]].mean().real)

    def on_circle(eigenvalues: Numbers, slope: float) -> float:
        return _pair_growth(eigenvalues)

    def at_target(eigenvalues: Numbers, slope: float) -> float:
        if not chosen:
            flips = kind.condition == "flip" or (symmetric and _nearer_flip(eigenvalues))
            chosen["target"] = -1.0 if flips else 1.0
            factors = np.sort(np.abs(eigenvalues - chosen["target"]))
            chosen["unit"] = float(np.prod(factors[1:]))
        value = float(np.prod(eigenvalues - chosen["target"]).real) / chosen["unit"]
        if chosen["target"] < 0 or symmetric:
            return value
        if slope == 0:
            raise ContinuationError("a fold at the very place")
        return value / slope  # a fold next to a branch point is none of its zeros

    if multiplicity > 1:
        return mean
    return on_circle if kind.condition == "circle" else at_target


def _nearer_flip(eigenvalues: Numbers) -> bool:
    return bool(np.abs(eigenvalues + 1).min() < np.abs(eigenvalues - 1).min())


def outside(eigenvalues: Numbers) -> Numbers:
    """How many of the eigenvalues (..., 2L) are outside the unit circle."""
    return np.asarray((np.abs(eigenvalues) > 1 + ON_CIRCLE).sum(axis=-1))


def critical_at(eigenvalues: Numbers, count: int, symmetric: bool) -> list[tuple[Kind, int]]:
    """The kinds of bifurcation, with their multiplicities, at which the `count` eigenvalues next to
    the circle cross it.
    """
    nearest = eigenvalues[np.argsort(np.abs(np.abs(eigenvalues) - 1))[:count]]
    real = np.abs(nearest.imag) < ALIKE
    members: dict[Condition, Numbers] = {
        "flip": real & (nearest.real < 0),
        "unit": real & (nearest.real > 0),
        "circle": ~real,
    }
    numbers = {c: int(m.sum()) // CROSSED[c].multipliers for c, m in members.items()}
    return [(crossed_kind(c, symmetric), number) for c, number in numbers.items() if number]


def _pair_growth(eigenvalues: Numbers) -> float:
    """log |mu_1 mu_2| of the pair closest to the circle: conjugates, or the real pair they
    become.
    """
    pairs = eigenvalues[eigenvalues.imag > REAL]
    products = list(np.abs(pairs) ** 2)
    real = np.sort(eigenvalues.real[np.abs(eigenvalues.imag) <= REAL])
    products += [a * b for a, b in zip(real[:-1], real[1:]) if a * b > 0 and b - a < NEAR]
    if not products:
        raise ContinuationError("no complex pair in the neighbourhood")
    sizes = np.log(np.array(products))
    return float(sizes[np.abs(sizes).argmin()])


def determinant(multipliers: Numbers, at: float) -> float:
    """Sign and size of det(M - at I), damped so that large multipliers do not hide its zero."""
    values = multipliers - at
    return float(np.prod(values / (1 + np.abs(values))).real)


def pairs_outside(multipliers: Numbers) -> float:
    """Complex pairs of multipliers (2L,) outside the unit circle."""
    outside = (np.abs(multipliers.imag) > REAL) & (np.abs(multipliers) > 1)
    return float(outside.sum() // 2)
