"""Nonlinear static load cases: energy + load + supports -> load path, whatever the model.

A problem is R(x, p) = dPi/dx - p F(x) = 0 for a load of magnitude p.  `load_steps` raises p, each
step a SNES solve that starts from the extrapolated path and is cut back when it fails; `arc_length`
follows the path by its length (Riks 1979, doi:10.1016/0020-7683(79)90081-7; in the form of
Keller's pseudo-arclength) and so passes limit points.  The stiffness is factorised as L D L^T, so
the signs of its pivots tell for every state whether it is stable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem import algebra, compat

RESIDUAL = 1e-11  # of a step, relative to its load
STEP = 1e-10  # a Newton step so small (relative to the state) has converged too
STALLED = 1e-5  # a step below it that no longer shrinks is round-off: there is no more to gain
SMALLEST_STATE = 1e-5  # per degree of freedom; smaller ones count as zero
MOST_NEWTON_STEPS = 25
SMALLEST_CUT = 2.0**-14  # of the step asked for
GROWTH = 1.5  # of an arc-length step that converged easily
EASY = 5  # Newton steps


class StaticProblem:
    """A discrete model under one load.

    Parameters
    ----------
    state : Function of a blocked Lagrange space; it holds the current state.
    energy : UFL energy of the model as a functional of the state.
    load : linear form F(x; v) of a unit load, which may depend on the state, or None.
    nodal_load : (local dofs,) further unit load, e.g. a point force.
    fixed : local numbers (unrolled) of the degrees of freedom that do not move.
    constant : stiffness (all degrees of freedom) of a further energy, quadratic in the state.
    symmetric : the load has a potential too (False for a follower load on a free edge).
    """

    def __init__(
        self,
        state: Any,
        energy: Any,
        load: Any = None,
        nodal_load: np.ndarray | None = None,
        fixed: np.ndarray | None = None,
        symmetric: bool = True,
        constant: PETSc.Mat | None = None,
    ) -> None:
        self.state = state
        self.space = state.function_space
        self.free = algebra.FreeDofs(
            self.space, np.empty(0, dtype=np.int32) if fixed is None else fixed
        )
        self.symmetric = symmetric
        self.magnitude = fem.Constant(self.space.mesh, 0.0)
        self._nodal = None if nodal_load is None else nodal_load[self.free.local]
        residual = ufl.derivative(energy, state)
        self._load = None
        if load is not None:
            self._load = compat.form(load)
            residual = residual - self.magnitude * load
        self._residual = compat.form(residual)
        self._stiffness = compat.form(ufl.derivative(residual, state))
        self._full = algebra.assemble(self._stiffness)
        self._constant = constant
        if constant is not None:
            self._full.axpy(1.0, constant, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        self.stiffness = self.free.restrict(self._full)
        self._solver = self._direct_solver()
        self._preload = self.norm(self.residual())

    # -- the discrete problem -------------------------------------------------------------------

    @property
    def comm(self) -> Any:
        """Communicator of the mesh."""
        return self.space.mesh.comm

    def free_values(self) -> np.ndarray:
        """Owned free degrees of freedom of the current state."""
        return self.state.x.array[self.free.local].copy()

    def set_state(self, values: np.ndarray, magnitude: float) -> None:
        """Make a state (owned free dofs) under a load the current one. Collective."""
        self.state.x.array[self.free.local] = values
        self.state.x.scatter_forward()
        self.magnitude.value = magnitude

    def residual(self) -> np.ndarray:
        """R(x, p) on the owned free degrees of freedom. Collective."""
        r = algebra.assemble_vector(self._residual)
        if self._constant is not None:
            x, product = self._constant.createVecRight(), self._constant.createVecLeft()
            x.array[:] = self.state.x.array[: self.free.n_owned]
            self._constant.mult(x, product)
            r += product.array_r
        r = r[self.free.local]
        return r if self._nodal is None else r - float(self.magnitude.value) * self._nodal

    def load(self) -> np.ndarray:
        """F(x) on the owned free degrees of freedom. Collective."""
        f = np.zeros(len(self.free.local)) if self._nodal is None else self._nodal.copy()
        if self._load is not None:
            f += algebra.assemble_vector(self._load)[self.free.local]
        return f

    def assemble_stiffness(self) -> None:
        """dR/dx of the current state into ``stiffness``. Collective."""
        self._full.zeroEntries()
        compat.assemble_matrix_into(self._full, self._stiffness)
        if self._constant is not None:
            self._full.axpy(1.0, self._constant, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self._full.createSubMatrix(self.free.set, self.free.set, self.stiffness)

    def full_stiffness(self) -> PETSc.Mat:
        """dR/dx on all degrees of freedom, supported ones included. Collective."""
        self.assemble_stiffness()
        return self._full

    def norm(self, values: np.ndarray) -> float:
        """Euclidean norm over all ranks."""
        return float(np.sqrt(self.comm.allreduce(values @ values)))

    # -- solvers --------------------------------------------------------------------------------

    def _direct_solver(self) -> PETSc.KSP:
        solver = PETSc.KSP().create(self.comm)
        solver.setOptionsPrefix("nanorom_statics_")
        solver.setOperators(self.stiffness)
        self._use_direct(solver)
        return solver

    def _use_direct(self, solver: PETSc.KSP) -> None:
        if self.symmetric:
            algebra.use_cholesky(solver)
            return
        solver.setType("preonly")
        solver.getPC().setType("lu")
        solver.getPC().setFactorSolverType("mumps")
        solver.setFromOptions()

    def factorise(self) -> None:
        """Factors of the current stiffness, for `back_substitute` and `unstable`. Collective."""
        self.assemble_stiffness()
        self._solver.setOperators(self.stiffness)
        try:
            self._solver.setUp()
        except PETSc.Error as error:
            raise SolverError(f"the tangent stiffness cannot be factorised: {error}") from error

    def back_substitute(self, right_hand_side: np.ndarray) -> np.ndarray:
        """Solution of the factorised stiffness for one right-hand side. Collective."""
        b, x = self.stiffness.createVecLeft(), self.stiffness.createVecRight()
        b.array[:] = right_hand_side
        self._solver.solve(b, x)
        return x.array.copy()

    def negative_pivots(self) -> int:
        """Unstable directions of the factorised state; -1 if the load has no potential."""
        return algebra.negative_pivots(self._solver) if self.symmetric else -1

    def solve(self, magnitude: float, guess: np.ndarray | None = None) -> int:
        """Equilibrium under a load by SNES; returns the Newton steps taken. Collective.

        Starts from ``guess`` or the current state, which it leaves alone if it raises SolverError.
        """
        before, before_magnitude = self.free_values(), float(self.magnitude.value)
        snes = PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix("nanorom_statics_")
        x, f = self.stiffness.createVecRight(), self.stiffness.createVecLeft()

        def function(_snes: Any, x: Any, f: Any) -> None:
            self.set_state(x.array_r, magnitude)
            f.array[:] = self.residual()

        def jacobian(_snes: Any, x: Any, *_matrices: Any) -> None:
            self.set_state(x.array_r, magnitude)
            self.assemble_stiffness()

        snes.setFunction(function, f)
        snes.setJacobian(jacobian, self.stiffness)
        PETSc.Options("nanorom_statics_")["snes_linesearch_type"] = "basic"
        self._use_direct(snes.getKSP())
        x.array[:] = before if guess is None else guess
        self.set_state(before, magnitude)
        test = _ConvergenceTest(
            RESIDUAL * (self._preload + abs(magnitude) * self.norm(self.load())), self.free.size
        )

        def converged(_snes: Any, iteration: int, norms: tuple[float, float, float]) -> Any:
            return test.reason(iteration, *norms)

        snes.setConvergenceTest(converged)
        snes.setFromOptions()
        try:
            snes.solve(None, x)
            reason = snes.getConvergedReason()
        except PETSc.Error:
            reason = -3
        steps = snes.getIterationNumber()
        if reason <= 0 or not np.isfinite(self.norm(x.array_r)):
            self.set_state(before, before_magnitude)
            raise SolverError(f"no equilibrium at load {magnitude:g} (SNES reason {reason})")
        self.set_state(x.array_r, magnitude)
        snes.destroy()
        return int(steps)


class _ConvergenceTest:
    """When Newton's method is done: small residual, small step, or nothing but round-off left."""

    def __init__(self, residual: float, size: int) -> None:
        self.residual = residual
        self.smallest = SMALLEST_STATE * np.sqrt(size)
        self.last = np.inf

    def reason(self, iteration: int, state: float, step: float, residual: float) -> Any:
        """Reason to stop (PETSc's, 0 to go on) after an iteration with these norms."""
        reasons = PETSc.SNES.ConvergedReason
        if not np.isfinite(residual):
            return reasons.DIVERGED_FNORM_NAN
        if residual <= self.residual:
            return reasons.CONVERGED_FNORM_ABS
        if iteration > 0 and self.is_small(state, step):
            return reasons.CONVERGED_SNORM_RELATIVE
        return reasons.DIVERGED_MAX_IT if iteration >= MOST_NEWTON_STEPS else reasons.ITERATING

    def is_small(self, state: float, step: float) -> bool:
        """The step is negligible, or small and no smaller than the last."""
        last, self.last = self.last, step
        size = max(state, self.smallest)
        return step <= STEP * size or (step <= STALLED * size and step > 0.5 * last)


@attrs.frozen(eq=False)
class PathPoint:
    """One state on a load path: its load, free dofs, and number of unstable directions."""

    magnitude: float
    values: np.ndarray
    unstable: int

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
    as if it had diverged.  Raises SolverError that says which load was reached.
    """
    start = float(problem.magnitude.value)
    previous: tuple[float, np.ndarray] | None = None
    current = start, problem.free_values()
    for target in magnitudes:
        step = target - current[0]
        smallest = abs(step) * SMALLEST_CUT
        while current[0] != target:
            trial = target if abs(target - current[0]) <= abs(step) else current[0] + step
            guess = current[1]
            if previous is not None and current[0] != previous[0]:
                slope = (current[1] - previous[1]) / (current[0] - previous[0])
                guess = current[1] + slope * (trial - current[0])
            try:
                problem.solve(trial, guess)
                if accept is not None and not accept(problem):
                    problem.set_state(current[1], current[0])
                    raise SolverError(f"the state at load {trial:g} is not admissible")
            except SolverError as error:
                step /= 2
                if abs(step) < smallest:
                    raise SolverError(
                        f"the load case stopped at load {current[0]:g} of {target:g}: beyond it no "
                        "equilibrium was found (a limit point or an instability; follow the path "
                        "by arc length, or refine the mesh)"
                    ) from error
                continue
            previous, current = current, (trial, problem.free_values())
        problem.factorise()
        yield PathPoint(current[0], current[1], problem.negative_pivots())


def arc_length(
    problem: StaticProblem, target: float, step: float, most_steps: int = 200
) -> Iterator[PathPoint]:
    """States along the path from the current one, through limit points, up to a load.

    step : first step in load; the path's length measures load and state alike, each in units of
    what this first step changes.  The last state is at ``target`` exactly.  The caller may stop at
    any time; raises SolverError, with the load reached, when steps become too small or too many.
    """
    path = Path(problem, np.sign(target - float(problem.magnitude.value)) * abs(step))
    for _ in range(most_steps):
        x, p = path.state
        x_new, p_new = path.advance()
        if (p_new - target) * (p - target) <= 0:
            problem.solve(target, x + (x_new - x) * (target - p) / (p_new - p))
            problem.factorise()
            yield PathPoint(target, problem.free_values(), problem.negative_pivots())
            return
        yield PathPoint(p_new, x_new, problem.negative_pivots())
    raise SolverError(
        f"the load path was still at load {path.state[1]:g} of {target:g} after {most_steps} steps"
    )


def limit_point(
    problem: StaticProblem, step: float, most_steps: int = 200, accept: Any = None
) -> PathPoint:
    """The first state on the path at which the load is largest (or smallest, for a step < 0).

    There the film snaps through or is pulled in.  Raises SolverError when ``accept`` refuses a
    state (contact) or no limit point comes within ``most_steps``.
    """
    from scipy.optimize import brentq

    path = Path(problem, step)
    for _ in range(most_steps):
        before = path.state, path.tangent
        x, p = path.advance()
        if accept is not None and not accept(problem):
            raise SolverError(f"contact at load {p:g} before a limit point")
        if path.tangent[1] * step > 0:
            continue
        travelled = path.product((x - before[0][0], p - before[0][1]), before[1])
        path.state, path.tangent = before

        def slope(length: float) -> float:
            found = path.at(length)
            if found is None:
                raise SolverError("a limit point cannot be resolved; refine the mesh")
            return float(path.tangent_at(found)[1])

        at = brentq(slope, 0.0, travelled, xtol=1e-8 * travelled, rtol=1e-8)
        slope(at)
        magnitude = float(problem.magnitude.value)
        return PathPoint(magnitude, problem.free_values(), problem.negative_pivots())
    raise SolverError(f"no limit point up to load {path.state[1]:g} in {most_steps} steps")


State = tuple[np.ndarray, float]  # owned free dofs and load


class Path:
    """A load path, followed by its length from the current state of a problem.

    The first step changes the load by about ``step``; its sign is the direction.
    """

    def __init__(self, problem: StaticProblem, step: float) -> None:
        self.problem = problem
        self.state: State = problem.free_values(), float(problem.magnitude.value)
        problem.factorise()
        rate = problem.back_substitute(problem.load())
        self._units = 1 / (abs(step) * problem.norm(rate)), 1 / abs(step)
        self.tangent = self._unit(rate, np.sign(step))
        self.length = np.sqrt(2.0)
        self._longest = 20 * self.length

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
            if found is not None:
                break
            self.length /= 2
            if self.length < SMALLEST_CUT:
                self.problem.set_state(*self.state)
                raise SolverError(
                    f"the load path stopped at load {self.state[1]:g}: its steps vanish"
                )
        self.tangent = self.tangent_at(found)
        self.state = found
        if self._steps <= EASY:
            self.length = min(GROWTH * self.length, self._longest)
        return found

    def at(self, length: float) -> State | None:
        """The state on the path at a distance along the tangent; None if Newton's method fails."""
        problem, (x, p), tangent = self.problem, self.state, self.tangent
        x_new, p_new = x + length * tangent[0], p + length * tangent[1]
        test = _ConvergenceTest(0.0, 0)
        for self._steps in range(1, MOST_NEWTON_STEPS):
            problem.set_state(x_new, p_new)
            try:
                problem.factorise()
            except SolverError:
                return None
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
