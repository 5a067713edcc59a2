"""Frequency responses on a manifold: branches of driven motions with folds and torus points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import attrs
import numpy as np

from nanorom.errors import ContinuationError, ModelError
from nanorom.rom.manifold.drive import check_levels
from nanorom.rom.manifold.frame import Frame
from nanorom.rom.manifold.orbit import largest
from nanorom.types import Array, Numbers

if TYPE_CHECKING:
    from nanorom.rom.manifold.reduced import Reduced

CROSSING = "BP"  # where another branch begins
NEWTON, NEWTON_STEPS, EASY = 1e-11, 12, 4
LEAST_STEP = 1e-9
SMALLEST_RISE = 1e-3  # of the drive, at the ends of a range
LOCATED = 60  # halvings of a step within which a point is located
OSCILLATES = 1e-6  # imaginary part of an eigenvalue, by the drive frequency
MOST_BRANCHES = 12
FARTHEST = 20.0  # units of displacement, beyond which nothing is followed
STEP_OFF = 1e-3  # units of displacement: how far from a branch point another branch begins
DEGREE = 3  # of what the drive adds: more moves no fold of the examples by 1e-6


class Place(NamedTuple):
    """y (2m,) and omega in one array, the tangent there, and eigenvalues (2m,)."""

    x: Array
    tangent: Array
    values: Numbers

    @property
    def saddles(self) -> int:
        """Number of positive real eigenvalues."""
        return int(np.sum((self.values.real > 0) & (self.values.imag == 0)))

    @property
    def unstable(self) -> int:
        return int(np.sum(self.values.real > 0))


@attrs.frozen(eq=False)
class ManifoldPoint:
    """Where stability changes: type "LP", "NS" or "BP"; omega in rad per unit of time, amplitude
    (L,) = max |q_r| in units of the model.
    """

    type: str
    omega: float
    amplitude: Array


@attrs.frozen(eq=False)
class ManifoldResponse:
    """Branches of driven motions on a manifold, one after the other.

    branch (n,): number of the branch; omega (n,) rad per unit of time; amplitude (n, L): max |q_r|;
    stable (n,); special_points; states (n, 2m): of the frame, in which the motions are at rest.
    """

    branch: Array
    omega: Array
    amplitude: Array = attrs.field(repr=False)
    stable: Array = attrs.field(repr=False)
    special_points: list[ManifoldPoint]
    states: Array = attrs.field(repr=False)
    _motion: Callable[[Array, float], Array] = attrs.field(repr=False)

    def motion(self, place: int) -> Array:
        """q (n, L) of a motion at equal instants of its period, in units of the model, from where
        the drive is largest.
        """
        return self._motion(self.states[place], float(self.omega[place]))

    def points(self, kind: str) -> list[ManifoldPoint]:
        """The special points of a type, by frequency."""
        chosen = [point for point in self.special_points if point.type == kind]
        return sorted(chosen, key=lambda point: point.omega)


def response(
    reduced: Reduced,
    omega: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    period: int = 1,
    degree: int = DEGREE,
    steps: int = 3000,
    largest_step: float = 0.01,
) -> ManifoldResponse:
    """The response on a manifold in normal form, over a range of drive frequencies.

    Parameters
    ----------
    reduced : Reduced, of style "normal"
    omega : (low, high) in rad per unit of time of the model
    direct, parametric : levels of the drives
    period : turns of the drive in one of the motion: 2 for a parametric resonance at twice the
        frequency of a master
    degree : of what the drive adds, in the masters; below the order of the manifold
    steps : most steps of all branches together
    largest_step : in units of displacement and of the first master's frequency

    Raises
    ------
    ModelError
        for an invalid range, a level of a drive that the manifold lacks, or where the masters'
        resonances do not go with the drive.
    """
    low, high = float(omega[0]), float(omega[1])
    if not (np.isfinite(high) and 0 < low < high):
        raise ModelError(f"omega: found {omega}; allowed: (low, high), rising and positive")
    check_levels((direct, parametric), (reduced.equations.direct, reduced.equations.parametric))
    degree = min(degree, reduced.order - 1)
    unit = reduced.equations.frequency
    limits = low / unit, high / unit
    own = np.abs(reduced.equations.basis.rates[reduced.masters].imag)
    turns = np.maximum(np.round(period * own / np.mean(limits)), 1) / period
    frame = Frame(
        reduced.equations, reduced.expansion, turns, period, (direct, parametric), degree, limits
    )
    follower = _Follower(frame, limits, largest_step, steps)
    branches = list(follower.branches())
    return _result(reduced, frame, branches, follower.points)


@attrs.define(eq=False)
class _Follower:
    """Pseudo-arclength continuation of the rest states of a frame."""

    frame: Frame
    limits: tuple[float, float]
    largest: float
    steps: int
    points: list[tuple[str, Place]] = attrs.field(factory=list)

    def branches(self) -> Iterator[list[Place]]:
        """The branches that begin at the ends, then those that branch off."""
        queue = [(self._first(0), 1.0), (self._first(1), -1.0)]
        seen: list[Place] = []
        ends: list[Place] = []
        while queue and self.steps > 0 and len(seen) < MOST_BRANCHES:
            start, sign = queue.pop(0)
            if any(_same(start, end) for end in ends):
                continue
            before = len(self.points)
            branch = list(self._follow(start, sign))
            ends.append(branch[-1])
            yield branch
            for kind, place in self.points[before:]:
                if kind == CROSSING and not any(_same(place, other) for other in seen):
                    seen.append(place)
                    queue += [(other, 1.0) for other in self._others(place)]

    def _first(self, end: int) -> Place:
        """The motion at an end of the range, as the drive rises."""
        size = 2 * len(self.frame.turns)
        x = np.append(np.zeros(size), self.limits[end])
        share, step = 0.0, 1.0
        while True:
            self.frame.share = min(share + step, 1.0)
            try:
                place, count = self._correct(x, np.eye(size + 1)[-1])
            except (ModelError, np.linalg.LinAlgError):
                step /= 2
                if step < SMALLEST_RISE:
                    raise ModelError(
                        f"omega: found no motion at its end {self.limits[end]:g} (by the first "
                        "master's frequency); allowed: a wider range"
                    ) from None
                continue
            if self.frame.share == 1.0:
                return place
            share, x = self.frame.share, place.x
            step = step if count > EASY else 2 * step

    def _follow(self, place: Place, sign: float) -> Iterator[Place]:
        from nanorom.continuation.branches.march import March, StepControl

        place = place._replace(tangent=sign * place.tangent)
        yield place
        control = StepControl(self.largest / 10, LEAST_STEP, self.largest, self.steps)
        low, high = self.limits
        for _, there in March(self._advance, place, control):
            self.steps -= 1
            yield there
            if not low < there.x[-1] < high or np.abs(there.x[:-1]).max() > FARTHEST:
                return

    def _advance(self, here: Place, length: float) -> tuple[Place, bool]:
        """The place a length further, and whether it was easy to find."""
        from nanorom.continuation.branches.march import STRAIGHT

        try:
            there, count = self._correct(here.x + length * here.tangent, here.tangent)
            if there.tangent @ here.tangent <= STRAIGHT:
                raise ContinuationError("the curve bends within a step")
            within = self._cut(there)
            self._locate(here, there, length)
            return within, count <= EASY
        except (ModelError, np.linalg.LinAlgError) as error:
            raise ContinuationError(f"no driven motion: {error}") from error

    def _cut(self, place: Place) -> Place:
        """The place, or the end of the range beyond which it is."""
        low, high = self.limits
        if low < place.x[-1] < high:
            return place
        x = place.x.copy()
        x[-1] = low if place.x[-1] <= low else high
        return self._correct(x, np.eye(len(x))[-1])[0]

    def _correct(self, x: Array, border: Array) -> tuple[Place, int]:
        """Newton's method orthogonal to a border."""
        x = x.copy()
        size = len(x) - 1
        for count in range(1, NEWTON_STEPS + 1):
            rate, by_y, by_omega = self.frame.equations_at(x[:-1], x[-1])
            matrix = np.vstack([np.column_stack([by_y, by_omega]), border])
            right = np.zeros((size + 1, 2))
            right[:-1, 0], right[-1, 1] = -rate, 1.0
            change, direction = np.linalg.solve(matrix, right).T
            x += change
            if np.abs(change).max() < NEWTON * max(1.0, np.abs(x).max()):
                values = np.linalg.eigvals(by_y)
                return Place(x, direction / np.linalg.norm(direction), values), count
        raise ModelError("no driven motion")

    def _locate(self, before: Place, after: Place, length: float) -> None:
        """Note where the number of unstable eigenvalues changes within a step."""
        if before.unstable == after.unstable:
            return
        low, high = (0.0, before), (length, after)
        for _ in range(LOCATED):
            middle = (low[0] + high[0]) / 2
            try:
                place, _ = self._correct(before.x + middle * before.tangent, before.tangent)
            except (ModelError, np.linalg.LinAlgError):
                break  # as near as it can be located, at a branch point say
            if place.unstable == before.unstable:
                low = middle, place
            else:
                high = middle, place
            if high[0] - low[0] < 1e-13 * max(1.0, float(np.abs(after.x).max())):
                break
        place = high[1]
        critical = place.values[np.abs(place.values.real).argmin()]
        turns = low[1].tangent[-1] * high[1].tangent[-1] < 0 or abs(place.tangent[-1]) < 1e-5
        kind = (
            "NS" if abs(critical.imag) > OSCILLATES * place.x[-1] else "LP" if turns else CROSSING
        )
        if self.limits[0] <= place.x[-1] <= self.limits[1]:
            self.points.append((kind, place))

    def _others(self, place: Place) -> list[Place]:
        """Places on the branch that crosses at a branch point, to both sides."""
        _, by_y, by_omega = self.frame.equations_at(place.x[:-1], place.x[-1])
        matrix = np.column_stack([by_y, by_omega])
        null = np.linalg.svd(matrix)[2][-2:]
        other = null.T @ (null @ place.tangent)
        along = place.tangent / np.linalg.norm(place.tangent)
        across = next((v for v in null - np.outer(null @ along, along) if v @ v > 0.1), other)
        across = across / np.linalg.norm(across)
        found = []
        for sign in (1.0, -1.0):
            try:
                begun, _ = self._correct(place.x + sign * STEP_OFF * across, sign * across)
            except (ModelError, np.linalg.LinAlgError):
                continue  # nothing branches off to this side
            found.append(begun)
        return found


def _same(one: Place, other: Place) -> bool:
    return bool(np.abs(one.x - other.x).max() < 1e-6)


def _result(
    reduced: Reduced, frame: Frame, branches: list[list[Place]], points: list[tuple[str, Place]]
) -> ManifoldResponse:
    units = reduced.equations.frequency, reduced.equations.amplitude

    def amplitude(place: Place) -> Array:
        return largest(frame.motion(place.x[:-1], place.x[-1])) * units[1]

    places = [place for branch in branches for place in branch]
    return ManifoldResponse(
        branch=np.repeat(np.arange(len(branches)), [len(branch) for branch in branches]),
        omega=np.array([place.x[-1] for place in places]) * units[0],
        amplitude=np.array([amplitude(place) for place in places]),
        stable=np.array([place.unstable == 0 for place in places]),
        special_points=[
            ManifoldPoint(kind, place.x[-1] * units[0], amplitude(place)) for kind, place in points
        ],
        states=np.array([place.x[:-1] for place in places]),
        motion=lambda y, omega: frame.motion(y, omega / units[0]) * units[1],
    )
