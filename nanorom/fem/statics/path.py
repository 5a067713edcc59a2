"""Load paths: the states of a static problem as its load changes.

`load_steps` raises the load p, each step a SNES solve that starts from the extrapolated path and is
cut back when it fails; `arc_length` follows the path by its length (Riks 1979,
doi:10.1016/0020-7683(79)90081-7; in the form of Keller's pseudo-arclength) and so passes limit
points, which `limit_point` locates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import attrs
import numpy as np

from nanorom.errors import LoadError, SolverError
from nanorom.fem.statics.problem import MOST_NEWTON_STEPS, ConvergenceTest, StaticProblem

SMALLEST_CUT = 2.0**-14  # of the load reached so far, or of the first arc-length step
SMALLEST_LOAD = 2.0**-50  # of the load asked for, as long as none is reached
MOST_STEPS = 200  # tried on the way to one load: a path that takes more leads nowhere
GROWTH = 1.5  # of a step that converged easily
EASY = 5  # Newton steps
LONGEST = 20.0  # of the first arc-length step

Accept = Callable[[StaticProblem], bool]


@attrs.frozen(eq=False)
class PathPoint:
    """One state on a load path: its load, free dofs, and number of unstable directions.

    limit: the load is largest or smallest there.
    """

    magnitude: float
    values: np.ndarray
    unstable: int
    limit: bool = False

    @property
    def stable(self) -> bool:
        """No direction lowers the energy."""
        return self.unstable <= 0


def load_steps(
    problem: StaticProblem,
    magnitudes: Sequence[float],
    accept: Callable[[StaticProblem], bool] | None = None,
) -> Iterator[PathPoint]:
    """States under rising (or falling) loads from the current one, with automatic cut-back.

    ``accept`` may refuse a state that SNES found, e.g. one past contact; the step is then cut back
    as if it had diverged.  Raises LoadError that says which load was reached.
    """
    start = float(problem.magnitude.value)
    previous: tuple[float, np.ndarray] | None = None
    current = start, problem.free_values()
    for target in magnitudes:
        step = target - current[0]
        smallest, tried = abs(step) * SMALLEST_LOAD, 0
        while current[0] != target:
            if (tried := tried + 1) > MOST_STEPS:
                raise LoadError(
                    f"the load case was still at load {current[0]:g} of {target:g} after "
                    f"{MOST_STEPS} steps; lower the load",
                    reached=current[0],
                )
            trial = target if abs(target - current[0]) <= abs(step) else current[0] + step
            guess = current[1]
            if previous is not None and current[0] != previous[0]:
                slope = (current[1] - previous[1]) / (current[0] - previous[0])
                guess = current[1] + slope * (trial - current[0])
            try:
                newton_steps = problem.solve(trial, guess)
                if accept is not None and not accept(problem):
                    problem.set_state(current[1], current[0])
                    raise SolverError(f"the state at load {trial:g} is not admissible")
            except SolverError as error:
                step /= 2
                if abs(step) < (SMALLEST_CUT * abs(current[0] - start) or smallest):
                    raise LoadError(
                        f"the load case stopped at load {current[0]:g} of {target:g}: beyond it no "
                        "equilibrium was found (a limit point or an instability; follow the path "
                        "by arc length, or refine the mesh)",
                        reached=current[0],
                    ) from error
                continue
            previous, current = current, (trial, problem.free_values())
            step *= GROWTH if newton_steps <= EASY else 1.0
        problem.factorise()
        yield PathPoint(current[0], current[1], problem.negative_pivots())


def arc_length(
    problem: StaticProblem,
    target: float,
    step: float,
    most_steps: int = 200,
    accept: Accept | None = None,
    longest: float = LONGEST,
) -> Iterator[PathPoint]:
    """States along the path from the current one, through limit points, up to a load.

    step : first step in load; the path's length measures load and state alike, each in units of
    what this first step changes, and no step is longer than ``longest`` first ones.  Limit points
    are located and told as such; the last state is at ``target`` exactly.  ``accept`` is as for
    `load_steps`.  The caller may stop at any time; raises LoadError, with the load reached, when
    steps become too small or too many.
    """
    sense = np.sign(target - float(problem.magnitude.value))
    yield from Path(problem, sense * abs(step), accept, longest).towards(target, most_steps)


def limit_point(
    problem: StaticProblem, step: float, most_steps: int = 200, accept: Accept | None = None
) -> PathPoint:
    """The first state on the path at which the load is largest (or smallest, for a step < 0).

    There the film snaps through or is pulled in.  Raises SolverError when no limit point comes
    within ``most_steps`` or before a state that ``accept`` refuses.
    """
    for point in arc_length(problem, np.sign(step) * np.inf, step, most_steps, accept):
        if point.limit:
            problem.set_state(point.values, point.magnitude)
            return point
    raise AssertionError("an endless path ended")


State = tuple[np.ndarray, float]  # owned free dofs and load


class Path:
    """A load path, followed by its length from the current state of a problem.

    The first step changes the load by about ``step``; its sign is the direction.
    """

    def __init__(
        self,
        problem: StaticProblem,
        step: float,
        accept: Accept | None = None,
        longest: float = LONGEST,
    ) -> None:
        self.problem = problem
        self._accept = accept
        self.state: State = problem.free_values(), float(problem.magnitude.value)
        problem.factorise()
        rate = problem.back_substitute(problem.load())
        self._units = 1 / (abs(step) * problem.norm(rate)), 1 / abs(step)
        self.tangent = self._unit(rate, np.sign(step))
        self.length = np.sqrt(2.0)
        self._longest = longest * self.length

    def towards(self, target: float, most_steps: int) -> Iterator[PathPoint]:
        """States up to a load, as `arc_length` describes them."""
        problem = self.problem
        for _ in range(most_steps):
            before, tangent = self.state, self.tangent
            found = self.advance()
            if found[1] != target and (found[1] - target) * (before[1] - target) <= 0:
                (x, p), (x_new, p_new) = before, found
                problem.solve(target, x + (x_new - x) * (target - p) / (p_new - p))
                found = problem.free_values(), target
            elif self.tangent[1] * tangent[1] < 0:
                yield self.turning(before, tangent)
                problem.set_state(*found)
            yield self._point(found)
            if found[1] == target:
                return
        raise LoadError(
            f"the load path was still at load {self.state[1]:g} of {target:g} after {most_steps} "
            "steps",
            reached=self.state[1],
        )

    def between(self, a: PathPoint, b: PathPoint) -> PathPoint | None:
        """The state halfway between two neighbours; None if Newton's method fails."""
        chord = b.values - a.values, b.magnitude - a.magnitude
        length = np.sqrt(self.product(chord, chord))
        after = self.state, self.tangent, self.length
        self.state = a.values, a.magnitude
        self.tangent, self.length = (chord[0] / length, chord[1] / length), length
        found = self.at(length / 2)
        self.state, self.tangent, self.length = after
        return None if found is None else self._point(found)

    def _point(self, found: State) -> PathPoint:
        """The problem's current state with its stability."""
        self.problem.factorise()
        return PathPoint(found[1], found[0], self.problem.negative_pivots())

    def product(self, a: State, b: State) -> float:
        """Scalar product of two directions."""
        states = self.problem.comm.allreduce(a[0] @ b[0])
        return float(states * self._units[0] ** 2 + a[1] * b[1] * self._units[1] ** 2)

    def _unit(self, rate: np.ndarray, sign: float) -> State:
        """Unit tangent (dx, dp) from dx/dp."""
        size = np.sqrt(self.product((rate, 1.0), (rate, 1.0)))
        return sign * rate / size, float(sign / size)

    def tangent_at(self, state: State) -> State:
        """Unit tangent at a converged state, in the sense of the last one."""
        self.problem.set_state(*state)
        self.problem.factorise()
        tangent = self._unit(self.problem.back_substitute(self.problem.load()), 1.0)
        forward = self.product(tangent, self.tangent) > 0
        return tangent if forward else (-tangent[0], -tangent[1])

    def advance(self) -> State:
        """Go on by one step, shortened until Newton's method converges; the new state."""
        while True:
            found = self.at(self.length)
            if found is not None and (self._accept is None or self._accept(self.problem)):
                break
            self.length /= 2
            if self.length < SMALLEST_CUT:
                self.problem.set_state(*self.state)
                raise LoadError(
                    f"the load path stopped at load {self.state[1]:g}: its steps vanish",
                    reached=self.state[1],
                )
        self.tangent = self.tangent_at(found)
        self.state = found
        if self._steps <= EASY:
            self.length = min(GROWTH * self.length, self._longest)
        return found

    def turning(self, before: State, tangent: State) -> PathPoint:
        """The limit point between a state, with its tangent, and the current one."""
        from scipy.optimize import brentq

        after = self.state, self.tangent
        (x, p), (x_new, p_new) = before, self.state
        travelled = self.product((x_new - x, p_new - p), tangent)
        self.state, self.tangent = before, tangent

        def slope(length: float) -> float:
            found = self.at(length)
            if found is None:
                raise SolverError("a limit point cannot be resolved; refine the mesh")
            return float(self.tangent_at(found)[1])

        at = brentq(slope, 0.0, travelled, xtol=1e-8 * travelled, rtol=1e-8)
        slope(at)
        magnitude = float(self.problem.magnitude.value)
        found = PathPoint(
            magnitude, self.problem.free_values(), self.problem.negative_pivots(), limit=True
        )
        self.state, self.tangent = after
        return found

    def at(self, length: float) -> State | None:
        """The state on the path at a distance along the tangent; None if Newton's method fails."""
        problem, (x, p), tangent = self.problem, self.state, self.tangent
        x_new, p_new = x + length * tangent[0], p + length * tangent[1]
        test = ConvergenceTest(0.0, 0)
        for self._steps in range(1, MOST_NEWTON_STEPS):
            problem.set_state(x_new, p_new)
            try:
                problem.factorise()
            except SolverError:
                return None  # a shorter step may avoid the singular stiffness
            by_load = problem.back_substitute(problem.load())
            by_residual = problem.back_substitute(problem.residual())
            gap = length - self.product((x_new - x, p_new - p), tangent)
            # K dx - F dp = -R on the plane <(dx, dp), tangent> = gap
            dp = gap + self.product((by_residual, 0.0), tangent)
            dp /= self.product((by_load, 1.0), tangent)
            dx = by_load * dp - by_residual
            x_new, p_new = x_new + dx, p_new + dp
            size = np.sqrt(self.product((dx, dp), (dx, dp)))
            if not np.isfinite(size) or size > 10 * self.length:
                return None
            whole = np.sqrt(self.product((x_new, p_new), (x_new, p_new)))
            if test.is_small(length + whole, size):
                problem.set_state(x_new, p_new)
                return x_new, float(p_new)
        return None
