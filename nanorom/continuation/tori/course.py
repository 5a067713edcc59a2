"""A family of tori from a first curve to its end: members, bifurcations and tongues on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction

from nanorom.continuation.tori.events import Event, events
from nanorom.continuation.tori.family import Family, Member
from nanorom.continuation.tori.invariance import Curve, Direction
from nanorom.continuation.tori.tongues import Tongue, around, nearest, passed, tongue
from nanorom.errors import ContinuationError

Told = Callable[[Member], None]
ACROSS = (0.02, 0.1, 0.5)  # widths of a tongue beyond its far end at which tori are tried again
FARTHEST = 10.0  # steps from the last torus to a tongue that may have broken it


@dataclass(eq=False)
class Course:
    """What was met while a family was followed, in order, and why it ended."""

    members: list[Member] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    tongues: list[Tongue] = field(default_factory=list)
    missed: list[Fraction] = field(default_factory=list)
    ending: str = "open"

    def run(
        self,
        family: Family,
        curve: Curve,
        border: Direction,
        span: tuple[float, float],
        told: Told | None,
    ) -> Course:
        """Follow the family, beyond tongues in which it breaks, until it ends."""
        while True:
            for member in family.follow(curve, border, span):
                self._add(family, member, told)
            self.ending = family.ending
            if self.ending != "breakdown":
                return self
            beyond = self._beyond(family)
            if beyond is None:
                return self
            curve, border = beyond

    def _add(self, family: Family, member: Member, told: Told | None) -> None:
        if self.members and member.step:
            before = self.members[-1]
            self.events += events(family, before, member)
            turns = before.curve.rotation, member.curve.rotation
            for ratio in passed(*turns) if family.free else ():
                try:
                    self.tongues.append(tongue(family, before, member, ratio))
                except ContinuationError:
                    # cycles far from the curve do not converge: the tori went through
                    self.missed.append(ratio)
        self.members.append(member)
        if told is not None:
            told(member)

    def _beyond(self, family: Family) -> tuple[Curve, Direction] | None:
        """The first torus on the far side of the tongue that ends the family, and how to go on."""
        last = self.members[-1]
        if not family.free:
            return None
        ratio = nearest(last.curve.rotation)
        try:
            met = around(family.equations.map, last.curve, ratio)
        except ContinuationError:
            self.missed.append(ratio)
            return None
        gap = max(
            met.low.parameter - last.curve.parameter, last.curve.parameter - met.high.parameter
        )
        rising = met.low.parameter > last.curve.parameter
        if not 0 <= gap < FARTHEST * max(met.width, abs(last.tangent.parameter) * last.step):
            return None
        self.tongues.append(met)
        for part in ACROSS:
            found = _mirrored(family, last, met, part * met.width, rising)
            if found is not None:
                return found
        return None


def _mirrored(
    family: Family, last: Member, met: Tongue, distance: float, rising: bool
) -> tuple[Curve, Direction] | None:
    """A torus beyond a tongue, guessed from the one before it turned about the fraction."""
    border = Direction(0.0 * last.curve.values, 0.0, 1.0 if rising else -1.0)
    end = met.high.parameter + distance if rising else met.low.parameter - distance
    rotation = 2 * met.angle - last.curve.rotation
    try:
        return family.adapted(Curve(last.curve.values, rotation, end), border)
    except ContinuationError:
        return None  # farther off there may be one; else the family ends in breakdown


def joined(backward: Course, forward: Course) -> Course:
    """One course through a first curve common to both, from the end of one to that of the other."""
    endings = sorted({backward.ending, forward.ending})
    return Course(
        backward.members[:0:-1] + forward.members,
        backward.events[::-1] + forward.events,
        backward.tongues[::-1] + forward.tongues,
        backward.missed[::-1] + forward.missed,
        ", ".join(endings),
    )
