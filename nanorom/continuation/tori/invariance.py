"""Invariant curves of the return map: their equations and Newton's method.

A torus meets the states at drive phase 0 in a closed curve x(theta) that the return map P turns by
a fixed angle, the rotation:

    P(x(theta)) = x(theta + rotation)        for all theta.

It is asked for at the nodes of a Fourier interpolation; a phase condition fixes where theta = 0
lies, a border row fixes the place on the family of curves. Source: Castella and Jorba 2000,
doi:10.1023/A:1026599913118; Jorba 2001, doi:10.1088/0951-7715/14/5/303.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.linalg import lapack

from nanorom.continuation.tori.circle import Circle, circle
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.errors import ContinuationError
from nanorom.types import Array

NEWTON = 1e-10  # last correction, relative to the curve; the error left is its square
FARTHEST = 1.0  # correction, relative to the curve, that belongs to no curve nearby
SLOW, NEARLY = 0.5, 1e-7  # contraction worth a new Jacobian, unless corrections are this small
JACOBIANS = 6  # new ones at most in one correction
BROYDEN = 12  # iterations with one Jacobian at most
SLOPE = 1e-6  # difference of the parameter for the derivative by it, which only directs


@dataclass(frozen=True, eq=False)
class Curve:
    """An invariant curve: values (N, 2L) at the nodes, rotation in rad, parameter (scaled)."""

    values: Array
    rotation: float
    parameter: float

    @property
    def circle(self) -> Circle:
        return circle((len(self.values) - 1) // 2)

    @property
    def scale(self) -> float:
        return max(float(np.abs(self.values).max()), 1e-12)

    @property
    def radius(self) -> float:
        """Size of the curve without its mean: root mean square over its angle."""
        return float(np.sqrt(((self.values - self.values.mean(axis=0)) ** 2).sum(axis=1).mean()))

    def resized(self, harmonics: int) -> Curve:
        target = circle(harmonics)
        return Curve(self.circle.to(target, self.values), self.rotation, self.parameter)

    def bent(self, direction: Direction, bend: Direction | None, step: float) -> Curve:
        """A step along a direction that changes by `bend` per unit of length."""
        ahead = self.moved(direction, step)
        if bend is None:
            return ahead
        return ahead.moved(bend.resized(self.circle.harmonics), step**2 / 2)

    def moved(self, direction: Direction, step: float) -> Curve:
        return Curve(
            self.values + step * direction.values,
            self.rotation + step * direction.rotation,
            self.parameter + step * direction.parameter,
        )


@dataclass(frozen=True, eq=False)
class Direction:
    """A change of a curve: values (N, 2L), rotation, parameter."""

    values: Array
    rotation: float
    parameter: float

    def dot(self, other: Direction) -> float:
        mean = float((self.values * other.values).sum(axis=1).mean())
        return mean + self.rotation * other.rotation + self.parameter * other.parameter

    def times(self, factor: float) -> Direction:
        return Direction(factor * self.values, factor * self.rotation, factor * self.parameter)

    def minus(self, other: Direction) -> Direction:
        """The difference of two directions, on the circle of this one."""
        other = other.resized((len(self.values) - 1) // 2)
        return Direction(
            self.values - other.values,
            self.rotation - other.rotation,
            self.parameter - other.parameter,
        )

    def unit(self) -> Direction:
        return self.times(1 / np.sqrt(self.dot(self)))

    def resized(self, harmonics: int) -> Direction:
        old = circle((len(self.values) - 1) // 2)
        return Direction(old.to(circle(harmonics), self.values), self.rotation, self.parameter)

    def row(self) -> Array:
        """What to multiply the changes of all unknowns with for `dot`."""
        return np.append(self.values.ravel() / len(self.values), [self.rotation, self.parameter])


@dataclass(frozen=True, eq=False)
class Linearised:
    """The return map's derivatives (N, 2L, 2L) along a curve and the factors of its equations."""

    maps: Array
    lu: Array = field(repr=False)
    pivots: Array = field(repr=False)

    def solve(self, right: Array) -> Array:
        return np.asarray(lapack.dgetrs(self.lu, self.pivots, right)[0])

    def tangent(self, curve: Curve) -> Direction:
        """The direction in which the family goes on, along the border."""
        right = np.zeros(len(self.lu))
        right[-1] = 1.0
        return _direction(self.solve(right), curve).unit()


def _direction(change: Array, curve: Curve) -> Direction:
    values = change[:-2].reshape(curve.values.shape)
    return Direction(values, float(change[-2]), float(change[-1]))


class Invariance:
    """The equations of the invariant curves of one return map."""

    def __init__(self, map_: ReturnMap) -> None:
        self.map = map_

    def _given(self, curve: Curve, ahead: float = 0.0) -> float:
        rotation = self.map.rotation(curve.parameter + ahead)
        assert rotation is not None
        return rotation

    def residual(self, curve: Curve) -> Array:
        """P(x) - x(theta + rotation) at the nodes, (N, 2L)."""
        images = self.map(curve.values, curve.parameter, curve.circle.angles)
        return np.asarray(images - curve.circle.rotation(curve.rotation) @ curve.values)

    def defect(self, curve: Curve) -> float:
        """Largest residual half way between the nodes, relative to the curve."""
        nodes = curve.circle
        middle = nodes.angles + np.pi / nodes.count
        images = self.map(nodes.interpolation(middle) @ curve.values, curve.parameter, middle)
        wanted = nodes.interpolation(middle + curve.rotation) @ curve.values
        return float(np.abs(images - wanted).max() / curve.scale)

    def linearise(self, curve: Curve, border: Direction) -> Linearised:
        """Factors of the equations with the phase condition and the border."""
        nodes, size = curve.circle, curve.values.shape[1]
        n = nodes.count * size
        images, maps = self.map.with_tangent(curve.values, curve.parameter, nodes.angles)
        ahead = self.map(curve.values, curve.parameter + SLOPE, nodes.angles)
        turned = nodes.rotation(curve.rotation)
        along = nodes.derivative @ curve.values
        matrix = np.zeros((n + 2, n + 2), order="F")
        blocks = np.zeros((nodes.count, size, nodes.count, size))
        place = np.arange(nodes.count)
        blocks[place, :, place, :] = maps
        diagonal = np.arange(size)
        blocks[:, diagonal, :, diagonal] -= turned
        matrix[:n, :n] = blocks.reshape(n, n)
        matrix[:n, n] = -(turned @ along).ravel()
        matrix[:n, n + 1] = ((ahead - images) / SLOPE).ravel()
        if self.map.free:
            matrix[n, :n] = along.ravel() / nodes.count
        else:
            matrix[n, n] = 1.0
            matrix[n, n + 1] = -(self._given(curve, SLOPE) - self._given(curve)) / SLOPE
        matrix[n + 1] = border.row()
        lu, pivots, info = lapack.dgetrf(matrix, overwrite_a=True)
        if info < 0 or not np.all(np.isfinite(np.diag(lu))):
            raise ContinuationError("torus: the equations of the curve cannot be solved")
        return Linearised(maps, lu, pivots)

    def correct(self, guess: Curve, border: Direction, known: Linearised | None = None) -> Curve:
        """The curve next to a guess on the plane through it orthogonal to the border.

        `known`: factors at a curve nearby, used as long as they contract. Raises ContinuationError
        without convergence.
        """
        factors = known
        for _ in range(JACOBIANS):
            if factors is None:
                factors = self.linearise(guess, border)
            guess, converged = self._iterate(guess, factors)
            if converged:
                return guess
            factors = None
        raise ContinuationError("torus: Newton's method does not converge to an invariant curve")

    def _iterate(self, curve: Curve, factors: Linearised) -> tuple[Curve, bool]:
        """Broyden's method from one Jacobian, until corrections are small or shrink too slowly."""
        steps: list[Array] = []
        previous = np.inf
        for _ in range(BROYDEN):
            right = np.zeros(len(factors.lu))
            right[:-2] = -self.residual(curve).ravel()
            if not self.map.free:
                right[-2] = self._given(curve) - curve.rotation
            change = _updated(factors.solve(right), steps)
            moved = curve.moved(_direction(change, curve), 1.0)
            # a response may start from rest; a curve of its own does not come from nowhere
            scale = curve.scale if self.map.free else max(curve.scale, moved.scale)
            size = float(np.abs(change[:-2]).max()) / scale
            size = max(size, abs(float(change[-2])), abs(float(change[-1])))
            if not np.isfinite(size) or size > FARTHEST:
                raise ContinuationError("torus: the correction leaves the neighbourhood")
            if size > previous:
                return curve, False
            curve = moved
            if size < NEWTON:
                return curve, True
            if size > SLOW * previous and size > NEARLY:
                return curve, False
            steps.append(change)
            previous = size
        return curve, False


def _updated(change: Array, steps: list[Array]) -> Array:
    """The next correction by Broyden's rank-one updates from the one of the first Jacobian. Source:
    Kelley 1995, doi:10.1137/1.9781611970944, section 7.3.
    """
    for before, after in pairwise(steps):
        change = change + after * float(before @ change) / float(before @ before)
    if steps:
        last = steps[-1]
        change = change / (1 - float(last @ change) / float(last @ last))
    return change
