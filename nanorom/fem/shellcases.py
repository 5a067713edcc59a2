"""Modes of a shell and its load cases: a normal displacement prescribed, the rest in equilibrium.

The deflection of a mode is its displacement along the undeformed normal; the tangential
displacement and the director are free and condensed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, cast

import attrs
import numpy as np
import ufl
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem import algebra, compat, groups
from nanorom.fem import modes as eigen
from nanorom.fem.modes import Modes
from nanorom.fem.shell import Shell
from nanorom.fem.statics import StaticProblem

TANGENTIAL = 0.1  # a mode with less of its kinetic energy along the normal is no deflection
CONVERGED = 1e-12  # residual of a load case relative to its first one
STALLED = 1e-7  # so small a residual may stop falling: it counts squared in the modal force
ROUND_OFF = 1e-13, 1e-15  # residual that may, relative to stiffness x deflection and x base state
SLOW = 0.3  # a residual that falls by less asks for the tangent of its own state
MOST_ITERATIONS = 40
STRAIGHT = 1e-12  # deflection of a state, relative to the shell's size, that counts as none


@attrs.frozen(eq=False)
class ShellModes:
    """Lowest modes about an equilibrium.

    problem: the shell's, in that equilibrium; states: (local dofs of the state, n), all components
    of the modes; modes: their eigenvalues and deflections; tangential: modes left out, which move
    in the surface.
    """

    shell: Shell
    problem: StaticProblem
    states: np.ndarray
    modes: Modes
    tangential: int = 0

    @property
    def eigenvalues(self) -> np.ndarray:
        """Squared frequencies (n,)."""
        return self.modes.eigenvalues

    def like(self, modes: Modes) -> ShellModes:
        """The same states in the combinations that these deflections are of the old ones."""
        n = self.modes.n_owned
        old, new = self.modes.shapes[:n], modes.shapes[:n]
        comm = self.shell.domain.comm
        gram = comm.allreduce(old.T @ old)
        mixture = np.linalg.solve(gram, comm.allreduce(old.T @ new))
        return attrs.evolve(self, states=self.states @ mixture, modes=modes)

    def products(self, energy: Callable[[Any], Any]) -> np.ndarray:
        """Second derivative of an energy of the state in the modes (n, n). Collective."""
        state = self.shell.state
        form = ufl.derivative(ufl.derivative(energy(state), state), state)
        n = self.problem.free.n_owned
        owned = self.states[:n]
        image = algebra.multiply(algebra.assemble(compat.form(form)), owned)
        return self.shell.domain.comm.allreduce(owned.T @ image)


def solve(shell: Shell, problem: StaticProblem, count: int) -> ShellModes:
    """At least the ``count`` lowest modes about the problem's current state. Collective.

    Modes that move in the surface are left out.  Raises SolverError if the state is not stable or
    its load has no potential.
    """
    if not problem.symmetric:
        raise SolverError("the load has no potential, so that the shell has no real modes under it")
    problem.assemble_stiffness()
    state = shell.state
    kinetic = ufl.derivative(shell.kinetic_energy(state), state)
    mass = algebra.assemble(compat.form(ufl.derivative(kinetic, state)))
    mass = problem.free.restrict(mass)
    a, b = ufl.TrialFunction(shell.deflections), ufl.TestFunction(shell.deflections)
    normal_mass = algebra.assemble(compat.form(a * b * shell.dx()))
    asked = count + eigen.EXTRA
    while True:
        eigenvalues, vectors = eigen.lowest(problem.stiffness, mass, asked)
        states = problem.free.extended(vectors)
        found = Modes(
            cast(Any, shell),  # which has what a film is asked for here
            eigenvalues,
            shell.normal_displacement(states),
            [()] * asked,
            {},
            normal_mass,
            cast(Any, None),  # the force of a shell is that of its problem
        )
        share = np.diag(found.modal({(): normal_mass}))  # of the kinetic energy, along the normal
        kept = np.flatnonzero(share > TANGENTIAL)
        missing = count + eigen.EXTRA - len(kept)
        if missing <= 0:
            break
        asked += missing
    clusters = eigen.clusters(eigenvalues[kept], eigen.NEAR)
    last = [cluster for cluster in clusters if cluster[0] < count][-1][-1]
    kept = kept[: last + 1]
    return ShellModes(shell, problem, states[:, kept], found.take(kept), int(kept[-1] - last))


class ShellCases:
    """Static equilibrium of a shell under prescribed deflections about a state.

    Cases are solved together by Newton's method with the tangent of that state; one for which that
    is too slow gets its own tangents.

    Attributes
    ----------
    linear : (n, n) modal stiffness, the rest in equilibrium.
    odd : opposite cases have opposite forces, as the shell is flat and not deflected.
    """

    def __init__(self, modes: ShellModes) -> None:
        problem, shell = modes.problem, modes.shell
        self.problem, self._across = problem, shell.domain.across
        self.base, self._magnitude = problem.free_values(), float(problem.magnitude.value)
        self._frame = _Frame(shell, problem)
        component = problem.free.local % 6
        normal = component == 2
        self._rest = np.flatnonzero(~normal)
        start = problem.stiffness.getOwnershipRange()[0]
        self._set = PETSc.IS().createGeneral(
            (start + self._rest).astype(PETSc.IntType), comm=problem.comm
        )
        at = problem.free.local[normal] // 6
        shapes = modes.modes.shapes[shell.nodes_in(shell.deflections)[at]]
        stiffness = self._tangent(np.zeros(len(component)))
        self._factors = self._factorise(stiffness)
        self._diagonal = stiffness.getDiagonal().array.copy()
        base = self._frame.local(self.base)
        self._noise = ROUND_OFF[1] * self._norms((self._diagonal * base)[:, None])
        self._offset = np.zeros(len(component))
        self._offset = self._residual(self._offset)
        # the modes with the rest in equilibrium to first order, and the force they take
        self._shapes = np.zeros((len(component), shapes.shape[1]))
        self._shapes[normal] = shapes
        pull = algebra.multiply(stiffness, self._shapes)
        self._shapes[self._rest] = -self._factors.solve(pull[self._rest])
        self.linear = self._project(algebra.multiply(stiffness, self._shapes))
        deflection = np.abs(base[normal]).max(initial=0.0)
        self.odd = shell.is_flat and problem.comm.allreduce(float(deflection)) < STRAIGHT

    def nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        """eta (L, m) = Phi^T (F_T - K X_c) at modal amplitudes q (L, m). Collective.

        Groups of ranks share the cases.  Raises SolverError if one does not converge.
        """

        def work(own: Sequence[int]) -> dict[int, np.ndarray]:
            return dict(zip(own, self._nonlinear_force(q[:, own]).T))

        found = groups.shared(self._across, range(q.shape[1]), work)
        return np.column_stack(list(found.values()))

    def _nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        states = self._shapes @ q
        force = np.zeros_like(states)
        first, last = np.zeros(q.shape[1]), np.full(q.shape[1], np.inf)
        active = np.arange(q.shape[1])
        try:
            for iteration in range(MOST_ITERATIONS):
                for column in active:
                    force[:, column] = self._residual(states[:, column])
                size = self._norms(force[np.ix_(self._rest, active)])
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
                self._correct(states, force, np.setdiff1d(active, slow), self._factors)
                for column in slow:
                    factors = self._factorise(self._tangent(states[:, column]))
                    self._correct(states, force, np.array([column]), factors)
        finally:
            self.problem.set_state(self.base, self._magnitude)
        raise SolverError("a load case of the shell did not converge; lower reduction.amplitude")

    def _correct(
        self, states: np.ndarray, force: np.ndarray, columns: np.ndarray, factors: Any
    ) -> None:
        """One Newton step of some cases, in place."""
        if len(columns):
            at = np.ix_(self._rest, columns)
            states[at] -= factors.solve(force[at])

    def _residual(self, state: np.ndarray) -> np.ndarray:
        """Force that a state beyond the base takes, both in the frame of the surface."""
        self.problem.set_state(self.base + self._frame.world(state), self._magnitude)
        return self._frame.local(self.problem.residual()) - self._offset

    def _tangent(self, state: np.ndarray) -> PETSc.Mat:
        self.problem.set_state(self.base + self._frame.world(state), self._magnitude)
        self.problem.assemble_stiffness()
        return self._frame.of(self.problem.stiffness)

    def _factorise(self, stiffness: PETSc.Mat) -> algebra.Factorization:
        held = stiffness.createSubMatrix(self._set, self._set)
        try:
            return algebra.Factorization(held, "nanorom_shell_", "stiffness at held deflection")
        except algebra.IndefiniteError as error:
            raise SolverError(
                f"{error}: the surface buckles between its modes; lower reduction.amplitude"
            ) from error

    def _project(self, force: np.ndarray) -> np.ndarray:
        """Modal forces; what is left of the residual of the rest counts to second order only."""
        return self.problem.comm.allreduce(self._shapes.T @ force)

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
