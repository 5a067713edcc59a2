"""Modes of a shell and its load cases: a normal displacement prescribed, the rest in equilibrium.

The deflection of a mode is its displacement along the undeformed normal; the tangential
displacement and the director are free and condensed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.models.shell import Shell
from nanorom.fem.modes import mirrored
from nanorom.fem.modes.shell import ShellModes
from nanorom.fem.solvers import algebra, groups
from nanorom.fem.statics.problem import StaticProblem
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors import selection
from nanorom.fem.tensors.inplane import InPlane

CONVERGED = 1e-12  # residual of a load case relative to its first one
STALLED = 1e-7  # so small a residual may stop falling: it counts squared in the modal force
ROUND_OFF = 1e-13, 1e-15  # residual that may, relative to stiffness x deflection and x base state
SLOW = 0.3  # a residual that falls by less asks for the tangent of its own state
MOST_ITERATIONS = 40
STRAIGHT = 1e-12  # deflection of a state, relative to the shell's size, that counts as none


class ShellCases:
    """Static equilibrium of a shell under prescribed deflections about a state.

    Cases are solved together by Newton's method with the tangent of that state; one for which that
    is too slow gets its own tangents.

    Attributes
    ----------
    linear : (n, n) modal stiffness, the rest in equilibrium.
    shapes : (owned free dofs, n) of the modes, the rest in equilibrium, in the surface's frame.
    rest : those of the degrees of freedom that are no deflection; factors : of their stiffness.
    odd : opposite cases have opposite forces, as the shell is flat and not deflected.
    """

    polynomial = False
    most_columns = 64

    def __init__(self, modes: ShellModes) -> None:
        problem, shell = modes.problem, modes.shell
        self.modes = modes
        self.problem, self._across = problem, shell.domain.across
        self.base, self._magnitude = problem.free_values(), float(problem.magnitude.value)
        self._frame = _Frame(shell, problem)
        component = problem.free.local % 6
        normal = component == 2
        self.rest = np.flatnonzero(~normal)
        start = problem.stiffness.getOwnershipRange()[0]
        self._set = PETSc.IS().createGeneral(
            (start + self.rest).astype(PETSc.IntType), comm=problem.comm
        )
        at = problem.free.local[normal] // 6
        shapes = modes.modes.shapes[shell.nodes_in(shell.deflections)[at]]
        stiffness = self.tangent(np.zeros(len(component)))
        self.factors = self.factorise(stiffness)
        self._diagonal = stiffness.getDiagonal().array.copy()
        base = self._frame.local(self.base)
        self._noise = ROUND_OFF[1] * self._norms((self._diagonal * base)[:, None])
        self._offset = np.zeros(len(component))
        self._offset = self.residual(self._offset)
        # the modes with the rest in equilibrium to first order, and the force they take
        self.shapes = np.zeros((len(component), shapes.shape[1]))
        self.shapes[normal] = shapes
        pull = algebra.multiply(stiffness, self.shapes)
        self.shapes[self.rest] = -self.factors.solve(pull[self.rest])
        self.linear = self._project(algebra.multiply(stiffness, self.shapes))
        deflection = np.abs(base[normal]).max(initial=0.0)
        self.odd = shell.is_flat and problem.comm.allreduce(float(deflection)) < STRAIGHT
        static = shell.normal_displacement(shell.state.x.array[:, None])[:, 0]
        self._parities = mirrored.parities(shell, static, modes.modes.shapes)

    @property
    def parities(self) -> list[Parity]:
        """Of the modes: a shell is meshed as a whole, but may be its own mirror image."""
        return self._parities

    def permitted(self, rank: int) -> np.ndarray:
        """Entries (L,) * rank of a tensor that symmetry does not make zero."""
        known = attrs.evolve(self.modes.modes, parities=self._parities)
        return selection.permitted(known, rank)

    @property
    def key(self) -> str:
        """Tells modes and mesh from those of other cases."""
        return self.modes.modes.key

    def in_plane(self, amplitude: float) -> InPlane:
        """Nothing: the displacement in the surface is one unknown with the director."""
        return InPlane()

    def nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        """eta (L, m) = Phi^T (F_T - K X_c) at modal amplitudes q (L, m). Collective.

        Groups of ranks share the cases.  Raises SolverError if one does not converge.
        """

        def work(own: Sequence[int]) -> dict[int, np.ndarray]:
            return dict(zip(own, self._nonlinear_force(q[:, own]).T))

        found = groups.shared(self._across, range(q.shape[1]), work)
        return np.column_stack(list(found.values()))

    def _nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        states = self.shapes @ q
        force = np.zeros_like(states)
        first, last = np.zeros(q.shape[1]), np.full(q.shape[1], np.inf)
        active = np.arange(q.shape[1])
        try:
            for iteration in range(MOST_ITERATIONS):
                for column in active:
                    force[:, column] = self.residual(states[:, column])
                size = self._norms(force[np.ix_(self.rest, active)])
                if iteration == 0:
                    first = size
                fall, last[active] = size / last[active], size
                noise = ROUND_OFF[0] * self._norms(self._diagonal[:, None] * states[:, active])
                enough = np.maximum(noise + self._noise, STALLED * first[active])
                done = (size <= CONVERGED * first[active]) | ((size <= enough) & (fall > SLOW))
                slow = active[~done & (fall > SLOW)]
                active = active[~done]
                if len(active) == 0:
                    return self._project(force) - self.linear @ q
                self._correct(states, force, np.setdiff1d(active, slow), self.factors)
                for column in slow:
                    factors = self.factorise(self.tangent(states[:, column]))
                    self._correct(states, force, np.array([column]), factors)
        finally:
            self.reset()
        raise SolverError("a load case of the shell did not converge; lower reduction.amplitude")

    def _correct(
        self, states: np.ndarray, force: np.ndarray, columns: np.ndarray, factors: Any
    ) -> None:
        """One Newton step of some cases, in place."""
        if len(columns):
            at = np.ix_(self.rest, columns)
            states[at] -= factors.solve(force[at])

    def reset(self) -> None:
        """Put the problem back into the state that the cases are about. Collective."""
        self.problem.set_state(self.base, self._magnitude)

    def squares(self, states: np.ndarray) -> np.ndarray:
        """int w^2 (m,) of the deflections of states (owned free dofs, m). Collective."""
        shell = self.modes.shell
        world = np.column_stack([self._frame.world(state) for state in states.T])
        w = shell.normal_displacement(self.problem.free.extended(world))
        owned = w[: self.modes.modes.n_owned]
        mass = algebra.multiply(self.modes.modes.mass, owned)
        return self.problem.comm.allreduce(np.sum(owned * mass, axis=0))

    def residual(self, state: np.ndarray) -> np.ndarray:
        """Force that a state beyond the base takes, both in the frame of the surface."""
        self.problem.set_state(self.base + self._frame.world(state), self._magnitude)
        return self._frame.local(self.problem.residual()) - self._offset

    def tangent(self, state: np.ndarray) -> PETSc.Mat:
        self.problem.set_state(self.base + self._frame.world(state), self._magnitude)
        self.problem.assemble_stiffness()
        return self._frame.of(self.problem.stiffness)

    def factorise(self, stiffness: PETSc.Mat) -> algebra.Factorization:
        held = stiffness.createSubMatrix(self._set, self._set)
        try:
            return algebra.Factorization(held, "nanorom_shell_", "stiffness at held deflection")
        except algebra.IndefiniteError as error:
            raise SolverError(
                f"{error}: the surface buckles between its modes; lower reduction.amplitude"
            ) from error

    def _project(self, force: np.ndarray) -> np.ndarray:
        """Modal forces; what is left of the residual of the rest counts to second order only."""
        return self.problem.comm.allreduce(self.shapes.T @ force)

    def _norms(self, columns: np.ndarray) -> np.ndarray:
        return np.sqrt(self.problem.comm.allreduce(np.sum(columns**2, axis=0)))


class _Frame:
    """Tangents and normal at every node: the frame in which the normal displacement is a component.

    Vectors and matrices are those of the problem's free degrees of freedom.
    """

    def __init__(self, shell: Shell, problem: StaticProblem) -> None:
        component = problem.free.local % 6
        self._first = np.flatnonzero(component == 0)  # its u, v and w follow one another
        normal = shell.normals()[problem.free.local[self._first] // 6]
        self._turn: np.ndarray | None = None
        comm = problem.comm
        if not comm.allreduce(int((normal[:, :2] != 0).any() or (normal[:, 2] < 0).any())):
            return  # flat: the frame is that of space
        least = np.eye(3)[np.abs(normal).argmin(axis=1)]
        along = np.cross(normal, least)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        self._turn = np.stack([along, np.cross(normal, along), normal], axis=1)
        n, start = len(component), problem.stiffness.getOwnershipRange()[0]
        turned = np.isin(np.arange(n), self._first[:, None] + np.arange(3))
        pointer = np.concatenate([[0], np.cumsum(np.where(turned, 3, 1))])
        columns, values = np.empty(pointer[-1], dtype=int), np.ones(pointer[-1])
        columns[pointer[:-1][~turned]] = np.flatnonzero(~turned)
        for row in range(3):  # world = turn^T local
            at = pointer[self._first + row][:, None] + np.arange(3)
            columns[at] = self._first[:, None] + np.arange(3)
            values[at] = self._turn[:, :, row]
        size = problem.stiffness.getSizes()
        self._matrix = PETSc.Mat().createAIJ(
            size,
            csr=(pointer.astype(PETSc.IntType), (start + columns).astype(PETSc.IntType), values),
            comm=comm,
        )

    def local(self, vector: np.ndarray) -> np.ndarray:
        """A vector (n,) in the frame of the surface."""
        return self._turned(vector, "nij,nj->ni")

    def world(self, vector: np.ndarray) -> np.ndarray:
        """A vector (n,) of the surface's frame in that of space."""
        return self._turned(vector, "nji,nj->ni")

    def _turned(self, vector: np.ndarray, product: str) -> np.ndarray:
        if self._turn is None:
            return vector
        at = self._first[:, None] + np.arange(3)
        turned = vector.copy()
        turned[at] = np.einsum(product, self._turn, vector[at])
        return turned

    def of(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """A matrix in the frame of the surface."""
        return matrix if self._turn is None else matrix.ptap(self._matrix)
