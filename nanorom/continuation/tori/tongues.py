"""Resonance tongues: where the second frequency locks to a fraction p/q of that of the response.

A family of tori passes rotation p/q in an interval of the parameter in which the return map has
cycles of q states on the curve instead, a stable and an unstable one, born together at its two
ends. Asked for at a fixed place of the curve, the cycle comes with its own parameter; while that
place moves by the q-th part of the curve, the parameter swings from one end of the interval to the
other and back, so that ends however close are told apart. Source of the picture: Arnold 1961;
Schilder and Peckham 2007, doi:10.1016/j.jcp.2006.05.041.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from nanorom.continuation.orbits.product import product_eigenvalues
from nanorom.continuation.tori.circle import circle
from nanorom.continuation.tori.family import Family, Member
from nanorom.continuation.tori.invariance import Curve
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

MOST = 16  # q: beyond, tongues are too narrow to be met
PLACES = 7  # on the q-th part of the curve; the parameter is almost a sine of the place
FINE = 8192  # places between which its ends are looked for
NEWTON, ITERATIONS = 1e-11, 12
NEAR, SECANTS = 1e-5, 6  # rad: rotation of the curve from which the cycles are corrected
SLOPE = 1e-6  # difference of the parameter for the derivative by it


@dataclass(frozen=True, eq=False)
class Cycle:
    """q states (q, 2L) that the return map permutes, at a parameter; and its maps (q, 2L, 2L)."""

    states: Array
    parameter: float
    maps: Array

    @property
    def multipliers(self) -> Numbers:
        return product_eigenvalues(self.maps)


@dataclass(frozen=True, eq=False)
class Tongue:
    """Locking to `ratio` turns per application of the map, between two parameters."""

    ratio: Fraction
    low: Cycle
    high: Cycle
    locked: Cycle  # the more stable one of the two cycles, half way between the ends

    @property
    def width(self) -> float:
        return self.high.parameter - self.low.parameter

    @property
    def angle(self) -> float:
        """The locked rotation in rad."""
        return 2 * np.pi * float(self.ratio)


def passed(before: float, after: float) -> list[Fraction]:
    """The fractions p/q, q <= MOST, between two rotations in rad, in the order they are passed."""
    low, high = sorted((before / (2 * np.pi), after / (2 * np.pi)))
    found = {
        Fraction(p, q)
        for q in range(1, MOST + 1)
        for p in range(int(np.ceil(low * q)), int(np.floor(high * q)) + 1)
    }
    return sorted(found, reverse=bool(before > after))


def tongue(family: Family, before: Member, after: Member, ratio: Fraction) -> Tongue:
    """The tongue that a step leads through; raises ContinuationError where no cycles are found."""
    return around(family.equations.map, _at_ratio(family, before, after, ratio), ratio)


def nearest(rotation: float) -> Fraction:
    """The fraction p/q, q <= MOST, nearest to a rotation in rad."""
    return Fraction(rotation / (2 * np.pi)).limit_denominator(MOST)


def around(map_: ReturnMap, curve: Curve, ratio: Fraction) -> Tongue:
    """The tongue next to a curve; raises ContinuationError where no cycles are found."""
    q = ratio.denominator
    places = 2 * np.pi / q * np.arange(PLACES) / PLACES
    values = np.array([_cycle(map_, curve, ratio, place).parameter for place in places])
    fine = 2 * np.pi * np.arange(FINE) / FINE
    course = circle((PLACES - 1) // 2).interpolation(fine) @ values
    low, high = course.argmin(), course.argmax()
    # from one end to the other there are two ways, along the stable and the unstable cycles
    middle = np.flatnonzero(np.diff(np.sign(course - (course[low] + course[high]) / 2)))[:2]
    ends = [_cycle(map_, curve, ratio, fine[i] / q) for i in (low, high)]
    between = [_cycle(map_, curve, ratio, fine[i] / q) for i in middle]
    locked = min(between or ends, key=lambda cycle: float(np.abs(cycle.multipliers).max()))
    return Tongue(ratio, ends[0], ends[1], locked)


def _at_ratio(family: Family, before: Member, after: Member, ratio: Fraction) -> Curve:
    """Almost a curve within a step whose rotation is the fraction: between members close to it."""
    wanted = 2 * np.pi * float(ratio)
    start = replace(before, bend=after.bend)
    ends = [(0.0, before), (after.step, after)]
    for _ in range(SECANTS):
        (one, first), (two, second) = ends
        gaps = [member.curve.rotation - wanted for member in (first, second)]
        if min(abs(gap) for gap in gaps) < NEAR:
            break
        step = one - gaps[0] * (two - one) / (gaps[1] - gaps[0])
        try:
            member = family.beside(start, step)
        except ContinuationError:  # within the tongue there are no tori to come nearer by
            break
        inside = (member.curve.rotation - wanted) * gaps[0] < 0
        ends = [(one, first), (step, member)] if inside else [(step, member), (two, second)]
    return _between(ends[0][1].curve, ends[1][1].curve, wanted)


def _between(one: Curve, two: Curve, rotation: float) -> Curve:
    """The curve of a rotation by linear interpolation."""
    harmonics = max(one.circle.harmonics, two.circle.harmonics)
    part = (rotation - one.rotation) / (two.rotation - one.rotation)
    values = (1 - part) * one.resized(harmonics).values + part * two.resized(harmonics).values
    return Curve(values, rotation, (1 - part) * one.parameter + part * two.parameter)


def _cycle(map_: ReturnMap, curve: Curve, ratio: Fraction, place: float) -> Cycle:
    """The cycle whose first state lies beside the curve at an angle, by Newton's method."""
    nodes, q = curve.circle, ratio.denominator
    turn = 2 * np.pi * float(ratio)
    states = nodes.interpolation(place + turn * np.arange(q)) @ curve.values
    first = states[0]
    along = (nodes.interpolation(np.array([place])) @ nodes.derivative @ curve.values)[0]
    along /= np.linalg.norm(along)
    parameter, scale, n = curve.parameter, curve.scale, states.size
    for _ in range(ITERATIONS):
        images, maps = map_.with_tangent(states, parameter)
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = _cyclic(maps)
        matrix[:n, n] = ((map_(states, parameter + SLOPE) - images) / SLOPE).ravel()
        matrix[n, : len(along)] = along
        gaps = np.append(images - np.roll(states, -1, axis=0), along @ (states[0] - first))
        change = np.linalg.solve(matrix, -gaps)
        if not np.all(np.isfinite(change)) or np.abs(change[:-1]).max() > scale:
            break
        states, parameter = states + change[:-1].reshape(states.shape), parameter + change[-1]
        if np.abs(change[:-1]).max() < NEWTON * scale and abs(change[-1]) < NEWTON:
            return Cycle(states, float(parameter), map_.with_tangent(states, parameter)[1])
    raise ContinuationError(f"torus: no cycle {ratio.numerator}:{q} beside the curve")


def _cyclic(maps: Array) -> Array:
    """Derivative of P(x_i) - x_(i+1) by all states, (q 2L, q 2L)."""
    q, size = maps.shape[:2]
    blocks = np.zeros((q, size, q, size))
    place = np.arange(q)
    blocks[place, :, place, :] = maps
    diagonal = np.arange(size)
    blocks[place[:, None], diagonal, (place[:, None] + 1) % q, diagonal] -= 1.0
    return blocks.reshape(q * size, q * size)
