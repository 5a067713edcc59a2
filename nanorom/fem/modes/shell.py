"""Vibration modes of a shell about its static state."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import ufl

from nanorom.errors import SolverError
from nanorom.fem.models.shell import Shell, split
from nanorom.fem.modes import eigen
from nanorom.fem.modes.deflections import Deflections
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.statics.problem import StaticProblem

TANGENTIAL = 0.1  # a mode with less of its kinetic energy along the normal is no deflection


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
    modes: Deflections
    tangential: int = 0

    @property
    def eigenvalues(self) -> np.ndarray:
        """Squared frequencies (n,)."""
        return self.modes.eigenvalues

    def like(self, modes: Deflections) -> ShellModes:
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

    def momentum(self) -> np.ndarray:
        """int m u_z (n,) of the modes' displacement u, m the mass per area. Collective."""
        shell = self.shell
        u, _ = split(ufl.TestFunction(shell.space))
        owned = self.states[: self.problem.free.n_owned]
        lifted = algebra.assemble_vector(compat.form(u[2] * shell.dx()))
        return np.asarray(shell.domain.comm.allreduce(lifted[: len(owned)] @ owned))


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
        found = Deflections(
            film=shell,
            eigenvalues=eigenvalues,
            shapes=shell.normal_displacement(states),
            parities=[()] * asked,
            mass=normal_mass,
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
