"""Modes of a shell and STEP on it: the deflection prescribed, all the rest in equilibrium.

The deflection is the displacement along z, so the shell is flat or shallow over its plane; the
tangential displacement and the director are free.  The condensed force of a shell is no polynomial:
the amplitude decides, and `truncation` measures what a quadratic and cubic force leaves out.
"""

from __future__ import annotations

import attrs
import numpy as np
import ufl

from nanorom.fem import algebra, compat
from nanorom.fem import modes as eigen
from nanorom.fem.shell import Shell
from nanorom.fem.statics import StaticProblem
from nanorom.fem.step import StepResult, coefficients, load_cases, symmetric

DEFLECTION = 2  # component of the state


@attrs.frozen(eq=False)
class ShellModes:
    """Lowest modes: eigenvalues (n,), deflections (local dofs of the state, n), other components 0.

    The largest nodal |w| of a shape is 1.
    """

    shell: Shell
    fixed: np.ndarray
    eigenvalues: np.ndarray
    shapes: np.ndarray


def solve(shell: Shell, fixed: np.ndarray, count: int) -> ShellModes:
    """Modes about the undeformed shell, with transverse mass only (1 per area). Collective."""
    second = ufl.derivative(ufl.derivative(shell.energy(), shell.state), shell.state)
    stiffness = algebra.assemble(compat.form(second))
    a, b = ufl.TrialFunction(shell.space), ufl.TestFunction(shell.space)
    mass = algebra.assemble(compat.form(a[DEFLECTION] * b[DEFLECTION] * shell.dx()))
    free = algebra.FreeDofs(shell.space, fixed)
    eigenvalues, vectors = eigen.lowest(free.restrict(stiffness), free.restrict(mass), count)
    shapes = np.zeros((len(shell.state.x.array), count))
    for i in range(count):
        state = shell.state.x
        state.array[:] = 0.0
        state.array[free.local] = vectors[:, i]
        state.scatter_forward()
        w = state.array[DEFLECTION::6]
        peak = w[np.abs(w).argmax()]
        shapes[DEFLECTION::6, i] = w / peak
    shell.state.x.array[:] = 0.0
    return ShellModes(shell, fixed, eigenvalues, shapes)


class ShellCases:
    """Static equilibrium of a shell under prescribed deflections. One process only."""

    def __init__(self, modes: ShellModes) -> None:
        self.modes = modes
        shell = self.shell = modes.shell
        shell.state.x.array[:] = 0.0
        everywhere = np.arange(DEFLECTION, len(shell.state.x.array), 6)
        held = np.unique(np.concatenate([modes.fixed, everywhere]))
        self._problem = StaticProblem(shell.state, shell.energy(), fixed=held)
        self._reaction = compat.form(ufl.derivative(shell.energy(), shell.state))
        self._linear = self._linear_force()

    def _linear_force(self) -> np.ndarray:
        """Phi^T K Phi with the rest condensed, on the operators of the cases."""
        problem, shapes = self._problem, self.modes.shapes
        full, free = problem.full_stiffness(), problem.free.local
        problem.factorise()
        x, y = full.createVecRight(), full.createVecLeft()
        force = np.empty_like(shapes)
        for i, shape in enumerate(shapes.T):
            x.array[:] = shape
            full.mult(x, y)
            rest = problem.back_substitute(-y.array_r[free])
            x.array[free] = rest
            full.mult(x, y)
            force[:, i] = y.array_r
        return shapes.T @ force

    def force(self, q: np.ndarray) -> np.ndarray:
        """Phi^T F of the whole force (L,) at modal amplitudes q (L,)."""
        problem, shapes = self._problem, self.modes.shapes
        self.shell.state.x.array[:] = shapes @ q
        problem.solve(0.0)
        return shapes.T @ algebra.assemble_vector(self._reaction)

    def nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        """eta (L,) = Phi^T (F_T - K X_c)."""
        return self.force(q) - self._linear @ q


def step(modes: ShellModes, amplitude: float) -> StepResult:
    """Quadratic and cubic coefficients by STEP; ``amplitude`` in the shell's unit of length."""
    cases, n = ShellCases(modes), modes.shapes.shape[1]
    forces = {}
    for case in load_cases(n):
        q = np.zeros(n)
        for mode, sign in case:
            q[mode] = sign * amplitude
        forces[case] = cases.nonlinear_force(q)
    quadratic, cubic = coefficients(forces, n, amplitude)
    return symmetric(quadratic, cubic, amplitude, len(forces), 0.0)


def truncation(modes: ShellModes, result: StepResult, amplitude: float) -> float:
    """What the coefficients miss of mode 1's nonlinear force at an amplitude, relative."""
    q = np.zeros(modes.shapes.shape[1])
    q[0] = amplitude
    exact = ShellCases(modes).nonlinear_force(q)
    told = result.quadratic @ q @ q + result.cubic @ q @ q @ q
    return float(np.abs(told - exact).max() / np.abs(exact).max())
