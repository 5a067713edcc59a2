"""Nonlinear static problems: energy + load + supports -> equilibrium, whatever the model.

A problem is R(x, p) = dPi/dx - p F(x) = 0 for a load of magnitude p; `StaticProblem.solve` finds
its state by SNES, and `loadpath` follows it as p changes.  The stiffness is factorised as
L D L^T, so the signs of its pivots tell for every state whether it is stable.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.models.operators import Columns
from nanorom.fem.solvers import algebra, compat

RESIDUAL = 1e-11  # of a step, relative to its load
STEP = 1e-10  # a Newton step so small (relative to the state) has converged too
STALLED = 1e-5  # a step below it that no longer shrinks is round-off: there is no more to gain
SMALLEST_STATE = 1e-5  # per degree of freedom; smaller ones count as zero
MOST_NEWTON_STEPS = 25


class StaticProblem:
    """A discrete model under one load.

    Parameters
    ----------
    state : Function of a blocked Lagrange space; it holds the current state.
    energy : UFL energy of the model as a functional of the state.
    load : linear form F(x; v) of a unit load, which may depend on the state, or None.
    nodal_load : (local dofs,) further unit load, e.g. a point force.
    fixed : local numbers (unrolled) of the degrees of freedom that do not move, or those that do.
    constant : stiffness (all degrees of freedom) of a further energy, quadratic in the state.
    force : what that stiffness does to (local dofs, m), to more digits than its entries have.
    symmetric : the load has a potential too (False for a follower load on a free edge).
    """

    def __init__(
        self,
        state: Any,
        energy: Any,
        load: Any = None,
        nodal_load: np.ndarray | None = None,
        fixed: np.ndarray | algebra.FreeDofs | None = None,
        symmetric: bool = True,
        constant: PETSc.Mat | None = None,
        force: Columns | None = None,
    ) -> None:
        self.state = state
        self.space = state.function_space
        if not isinstance(fixed, algebra.FreeDofs):
            none = np.empty(0, dtype=np.int32)
            fixed = algebra.FreeDofs(self.space, none if fixed is None else fixed)
        self.free = fixed
        self.symmetric = symmetric
        self.magnitude = fem.Constant(self.space.mesh, 0.0)
        self._nodal = None if nodal_load is None else self.free.taken(nodal_load)
        residual = ufl.derivative(energy, state)
        self._load = None
        if load is not None:
            self._load = compat.form(load)
            residual = residual - self.magnitude * load
        self._residual = compat.form(residual)
        self._stiffness = compat.form(ufl.derivative(residual, state))
        self._full = algebra.assemble(self._stiffness)
        self._constant, self._force = constant, force
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
        return self.free.taken(self.state.x.array).copy()

    def set_state(self, values: np.ndarray, magnitude: float) -> None:
        """Make a state (owned free dofs) under a load the current one. Collective."""
        if self.free.turned:
            self.state.x.array[:] = self.free.extended(values[:, None])[:, 0]
        else:
            self.state.x.array[self.free.local] = values
            self.state.x.scatter_forward()
        self.magnitude.value = magnitude

    def residual(self) -> np.ndarray:
        """R(x, p) on the owned free degrees of freedom. Collective."""
        r = algebra.assemble_vector(self._residual)
        if self._force is not None:
            r += self._force(self.state.x.array[:, None])[:, 0]
        r = self.free.taken(r)
        return r if self._nodal is None else r - float(self.magnitude.value) * self._nodal

    def load(self) -> np.ndarray:
        """F(x) on the owned free degrees of freedom. Collective."""
        f = np.zeros(len(self.free.local)) if self._nodal is None else self._nodal.copy()
        if self._load is not None:
            f += self.free.taken(algebra.assemble_vector(self._load))
        return f

    def assemble_stiffness(self) -> None:
        """dR/dx of the current state into ``stiffness``. Collective."""
        self._full.zeroEntries()
        compat.assemble_matrix_into(self._full, self._stiffness)
        if self._constant is not None:
            self._full.axpy(1.0, self._constant, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self.free.restrict(self._full, self.stiffness)

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
        test = ConvergenceTest(
            RESIDUAL * (self._preload + abs(magnitude) * self.norm(self.load())), self.free.size
        )

        def converged(_snes: Any, iteration: int, norms: tuple[float, float, float]) -> Any:
            return test.reason(iteration, *norms)

        snes.setConvergenceTest(converged)
        snes.setFromOptions()
        try:
            snes.solve(None, x)
            reason = snes.getConvergedReason()
        except PETSc.Error:  # the factors broke down, which a shorter step may spare them
            reason = PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE
        steps = snes.getIterationNumber()
        snes.destroy()
        if reason <= 0 or not np.isfinite(self.norm(x.array_r)):
            self.set_state(before, before_magnitude)
            raise SolverError(f"no equilibrium at load {magnitude:g} (SNES reason {reason})")
        self.set_state(x.array_r, magnitude)
        return int(steps)


class ConvergenceTest:
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
