"""The kinds of bifurcations of periodic orbits, in one table.

A further kind is a row here, and a class in `conditions` if what becomes critical is new.

On a symmetric orbit the eigenvalues of the half-period map (with the symmetry applied) take the
place of the multipliers: -1 is then the breaking of the symmetry.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.orbits.conditions import At, Condition, OnCircle
from nanorom.types import Numbers

CONFIRMED = 1e-7  # of a critical multiplier: what a point may be off by and still is reported
MEETING = 1e-4  # distance of multipliers of which round-off makes more than it should
MEETING_IN_TONGUE = 1e-6  # as before, where between two such points there is a tongue as narrow
ON_CIRCLE = 1e-9  # of a modulus: round-off of those that are 1 throughout


@attrs.frozen
class Kind:
    """A kind of bifurcation: a row of the table.

    code : "LP", ... as `SpecialPoint.type` has it
    condition : what becomes critical
    period_factor : of the branches that leave it, in periods of its own; 0 where none does
    marker : with which plots draw it (a name of Matplotlib's)
    turns : it is where the rate turns, not where multipliers cross
    at_ends : the end of a branch that bifurcates looks like it: the branch is symmetric about what
        it leaves
    when_symmetric : code of what it is on a symmetric orbit, for half a period; its own if empty
    """

    code: str
    name: str
    condition: Condition
    period_factor: int
    marker: str
    turns: bool = False
    at_ends: bool = False
    when_symmetric: str = ""

    @property
    def branches(self) -> bool:
        """Whether branches leave it."""
        return self.period_factor > 0

    @property
    def sheds_tori(self) -> bool:
        """Whether motions of a second frequency leave it."""
        return self.condition.conjugate and self.condition.growth == 0

    @property
    def changes_motion(self) -> bool:
        """Whether what it brings has another period, or a second frequency."""
        return not self.turns and self.period_factor != 1

    @property
    def multipliers(self) -> int:
        """How many become critical."""
        return self.condition.multipliers

    def distance(self, multipliers: Numbers, multiplicity: int = 1) -> float:
        """Of the critical multiplier from where it belongs; multipliers (2L,) of a whole period.

        multiplicity : how many of them (or pairs) are to be there; the farthest counts
        """
        missing = np.full(multiplicity, np.inf)
        distances = np.append(self.condition.distances(multipliers), missing)
        return float(np.sort(distances)[multiplicity - 1])

    def apart(self, multipliers: Numbers, multiplicity: int = 1) -> float:
        """As `distance`, less what round-off makes of it where the next multiplier is close.

        Of two that nearly meet, as all do at folds of a motion without damping, each is known to
        the root of round-off alone, their product to round-off.
        """
        distance = self.distance(multipliers, multiplicity)
        if self.multipliers > 1:
            return distance
        meeting = MEETING if self.turns else MEETING_IN_TONGUE
        return distance * min(1.0, self.distance(multipliers, multiplicity + 1) / meeting)

    def at(self, symmetric: bool) -> Kind:
        """What it is called on an orbit that is symmetric, or not."""
        return KINDS[self.when_symmetric] if symmetric and self.when_symmetric else self


FOLD = Kind("LP", "fold", At(1.0), 0, "s", turns=True, at_ends=True)
DOUBLING = Kind("PD", "period doubling", At(-1.0), 2, "D", when_symmetric="BP")
TORUS = Kind("NS", "Neimark-Sacker", OnCircle(), 0, "o")
BRANCHING = Kind("BP", "branch point", At(1.0, by_slope=True), 1, "^", at_ends=True)
KINDS = {kind.code: kind for kind in (FOLD, DOUBLING, TORUS, BRANCHING)}


def turning() -> tuple[Kind, ...]:
    """The kinds that are where the rate turns."""
    return tuple(kind for kind in KINDS.values() if kind.turns)


def turns(code: str) -> bool:
    """Whether the rate turns at a point of that type; types of no special point are allowed."""
    return code in KINDS and KINDS[code].turns


def crossed(modes: int | None = None) -> tuple[Kind, ...]:
    """The kinds that are told by multipliers, by how many, no more than so many modes have.

    Of one mode a pair is always inside.
    """
    told = sorted((k for k in KINDS.values() if not k.turns), key=lambda kind: kind.multipliers)
    return tuple(kind for kind in told if modes is None or kind.multipliers <= modes)


def outside(eigenvalues: Numbers) -> Numbers:
    """How many of the eigenvalues (..., 2L) are outside the unit circle."""
    return np.asarray((np.abs(eigenvalues) > 1 + ON_CIRCLE).sum(axis=-1))


def critical_at(eigenvalues: Numbers, count: int, symmetric: bool) -> list[tuple[Kind, int]]:
    """The kinds of bifurcation, with their multiplicities, at which the `count` eigenvalues next to
    the circle cross it.
    """
    nearest = eigenvalues[np.argsort(np.abs(np.abs(eigenvalues) - 1))[:count]]
    numbers = {k: int(k.condition.among(nearest).sum()) // k.multipliers for k in crossed()}
    return [(kind.at(symmetric), number) for kind, number in numbers.items() if number]
