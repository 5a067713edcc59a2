"""One family of invariant curves followed by pseudo-arclength, harmonics adapted on the way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nanorom.continuation.tori.circle import HARMONICS
from nanorom.continuation.tori.invariance import Curve, Direction, Invariance, Linearised
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.continuation.tori.stability import exponents
from nanorom.errors import ContinuationError
from nanorom.types import Array

FIRST = 0.01  # radius of the first curve, relative to the orbit from which it branches
TURN = 0.25  # rad that the tangent may turn in a step
LONGEST = 0.1  # step relative to the curve
SHORTEST = 1e-6
UNRESOLVED = 3  # shorter steps tried where the harmonics do not suffice
SHRUNK = 0.02  # radius relative to the orbit below which the curve ends at it
AHEAD, BEHIND = 0.03, 0.003  # tail, by the tolerance, at which harmonics are added or dropped
LIMIT_STEPS = 4  # secant steps towards the end of the range


@dataclass(frozen=True, eq=False)
class Member:
    """A curve of the family, its tangent and the linearised map along it."""

    curve: Curve
    tangent: Direction
    factors: Linearised

    step: float = 0.0  # from the member before, along its tangent
    bend: Direction | None = None  # change of the tangent per unit of length
    free: bool = True  # the second angle is the motion's own

    @cached_property
    def exponents(self) -> Array:
        """Growth of the directions per application of the map, falling (see `stability`)."""
        return exponents(self.curve, self.factors.maps, self.free)

    @cached_property
    def unstable(self) -> int:
        """How many directions grow."""
        return int((self.exponents > 0).sum())


class Family:
    """Curves that go on from one another while one parameter changes."""

    def __init__(self, map_: ReturnMap, tolerance: float, harmonics: int, steps: int) -> None:
        self.equations, self.free = Invariance(map_), map_.free
        self.tolerance, self.steps = tolerance, steps
        self.ladder = [h for h in HARMONICS if h <= harmonics]
        self.ending = "open"

    def from_orbit(self, state: Array, parameter: float) -> tuple[Curve, Direction]:
        """The first curve about the orbit through a state at a Neimark-Sacker point, and the
        direction in which it grows.
        """
        images, maps = self.equations.map.with_tangent(state[None], parameter)
        values, vectors = np.linalg.eig(maps[0])
        pairs = np.flatnonzero(values.imag > 1e-9)
        if not len(pairs):
            raise ContinuationError("point: no complex pair of multipliers; give an NS point")
        critical = pairs[np.abs(np.abs(values[pairs]) - 1).argmin()]
        angles = Curve(np.zeros((2 * self.ladder[0] + 1, 1)), 0.0, 0.0).circle.angles
        shape = (np.exp(1j * angles)[:, None] * vectors[:, critical]).real
        direction = Direction(shape, 0.0, 0.0).unit()
        radius = FIRST * float(np.abs(state).max())
        guess = Curve(
            np.tile(state, (len(angles), 1)), float(np.angle(values[critical])), parameter
        )
        return self.adapted(guess.moved(direction, radius), direction)

    def at_start(self, guess: Curve) -> tuple[Curve, Direction]:
        """The curve next to a guess at its parameter, and the direction of rising parameter."""
        border = Direction(np.zeros_like(guess.values), 0.0, 1.0)
        return self.adapted(guess, border)

    def adapted(
        self, guess: Curve, border: Direction, known: Linearised | None = None
    ) -> tuple[Curve, Direction]:
        """The corrected curve with as many harmonics as it needs, and the border with as many."""
        while True:
            curve = self.equations.correct(guess, border, known)
            position = self.ladder.index(curve.circle.harmonics)
            if curve.circle.tail(curve.values) < self.tolerance:
                return curve, border
            if position + 1 == len(self.ladder):
                raise Unresolved("torus: the harmonics do not suffice")
            guess, known = curve.resized(self.ladder[position + 1]), None
            border = border.resized(self.ladder[position + 1])

    def _deserved(self, curve: Curve) -> int:
        """The least number of harmonics that keeps the tail below the tolerance on the next step,
        too.
        """
        sizes = curve.circle.sizes(curve.values)
        position = self.ladder.index(curve.circle.harmonics)
        if sizes[-2:].max() > AHEAD * self.tolerance * sizes.max():
            return self.ladder[min(position + 1, len(self.ladder) - 1)]
        for harmonics in self.ladder[: max(position - 1, 0)]:
            if sizes[harmonics - 1 :].max() < BEHIND * self.tolerance * sizes.max():
                return harmonics
        return curve.circle.harmonics

    def member(self, curve: Curve, border: Direction) -> Member:
        harmonics = self._deserved(curve)
        curve, border = curve.resized(harmonics), border.resized(harmonics)
        factors = self.equations.linearise(curve, border)
        tangent = factors.tangent(curve)
        return Member(curve, tangent, factors, free=self.free)

    def beside(self, member: Member, step: float) -> Member:
        """The member a step farther along the tangent of another; raises ContinuationError."""
        guess = member.curve.bent(member.tangent, member.bend, step)
        curve, border = self.adapted(guess, member.tangent, member.factors)
        there = self.member(curve, border)
        bend = there.tangent.minus(member.tangent).times(1 / step)
        return replace(there, step=step, bend=bend)

    def at_parameter(self, member: Member, parameter: float) -> Member:
        """The member of a given parameter next to another."""
        curve = member.curve
        step = (parameter - curve.parameter) / member.tangent.parameter
        moved = curve.bent(member.tangent, member.bend, step)
        return self.member(*self.at_start(Curve(moved.values, moved.rotation, parameter)))

    def follow(
        self, curve: Curve, border: Direction, span: tuple[float, float]
    ) -> Iterator[Member]:
        """Members from a first curve on until the parameter leaves the span; `ending` says why it
        stopped ("range", "bifurcation": it shrank to an orbit, "breakdown", "steps").
        """
        here = self.member(curve, border)
        yield here
        step = min(0.5 * curve.radius, LONGEST * curve.scale) if self.free else LONGEST
        self.ending = "steps"
        for _ in range(self.steps):
            there, step = self._step(here, step)
            if there is None:
                self.ending = "breakdown"
                return
            for limit, sign in zip(span, (-1, 1)):
                if sign * (there.curve.parameter - limit) > 0:
                    self.ending = "range"
                    yield self._limit(here, there, limit)
                    return
            if (
                self.free and _overlap(here.curve, there.curve) < 0
            ):  # through the orbit, to its other side
                step = (
                    0.9 * there.step * here.curve.radius / (here.curve.radius + there.curve.radius)
                )
                continue
            shrunk = there.curve.radius < min(SHRUNK * there.curve.scale, here.curve.radius)
            here = there
            yield here
            if shrunk and self.free:
                self.ending = "bifurcation"
                return

    def _limit(self, here: Member, there: Member, limit: float) -> Member:
        """The member at the end of the span, between two members."""
        before, after = here.curve.parameter, there.curve.parameter
        for _ in range(LIMIT_STEPS):
            member = self.beside(here, there.step * (limit - before) / (after - before))
            after = member.curve.parameter
            there = member
            if abs(after - limit) < 1e-3 * abs(limit - before):
                break
        return replace(self.at_parameter(there, limit), step=there.step, bend=there.bend)

    def _step(self, here: Member, step: float) -> tuple[Member | None, float]:
        scale = here.curve.scale if self.free else max(here.curve.scale, 1.0)
        step = min(step, LONGEST * scale)
        unresolved = 0
        while step > SHORTEST * scale and unresolved < UNRESOLVED:
            try:
                there = self.beside(here, step)
            except Unresolved:
                unresolved, step = unresolved + 1, 0.4 * step
                continue
            except ContinuationError:  # the shortest step that fails is told as None
                step *= 0.4
                continue
            border = here.tangent.resized(there.curve.circle.harmonics)
            turn = float(np.arccos(np.clip(border.dot(there.tangent), -1, 1)))
            if turn > 2 * TURN:
                step *= 0.5
                continue
            return there, step * float(np.clip(TURN / max(turn, 1e-3), 0.5, 1.6))
        return None, step


def _overlap(one: Curve, other: Curve) -> float:
    """Mean product of two curves without their means: negative where one is turned inside out."""
    other = other.resized(one.circle.harmonics)
    first, second = (c.values - c.values.mean(axis=0) for c in (one, other))
    return float((first * second).sum())


class Unresolved(ContinuationError):
    """More harmonics than allowed would be needed."""
