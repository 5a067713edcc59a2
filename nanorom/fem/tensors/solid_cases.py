"""Static load cases of a solid: modal amplitudes imposed, all else in equilibrium (STEP).

The displacement is u = Phi q + theta with theta K-orthogonal to the modes, and what keeps it there
is a force along them alone, f(u) = K Phi lambda: the reaction of the cases.  It is no polynomial of
q, but its second and third derivatives are the coefficients of `tensors.solid`, which cases and
`step` find independently.
"""

from __future__ import annotations

import numpy as np

from nanorom.errors import SolverError
from nanorom.fem.modes.solid import SolidModes
from nanorom.fem.solvers import algebra
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors.inplane import InPlane

CONVERGED = 1e-12  # residual of a case relative to its first one
ROUND_OFF = 1e-13  # residual that may be left, relative to that of the stiffest motion
MOST_ITERATIONS = 60


class SolidCases:
    """Static equilibrium of a solid under prescribed modal amplitudes, by modes scaled to 1.

    Newton's method has the stiffness of the undeformed solid, whose factors are made once.
    """

    odd = False
    polynomial = False
    most_columns = 32

    def __init__(self, modes: SolidModes) -> None:
        self.modes, self._solid = modes, modes.solid
        self._pull = modes.solid.linear(modes.shapes)
        self.linear = modes.products(self._pull)
        self._factors = algebra.Factorization(
            modes.solid.stiffness, "nanorom_solid_", "solid's stiffness"
        )

    @property
    def parities(self) -> list[Parity]:
        """A solid is meshed as a whole."""
        return [()] * self.modes.shapes.shape[1]

    @property
    def key(self) -> str:
        """Tells modes from those of other cases."""
        return repr((self.modes.names, self.modes.eigenvalues.tolist()))

    def in_plane(self, amplitude: float) -> InPlane:
        """Nothing: a solid has no plane."""
        return InPlane()

    def nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        """eta (L, m) = Phi^T f(u) - Phi^T K Phi q of amplitudes q (L, m). Collective.

        Raises SolverError if a case does not converge.
        """
        solid, shapes = self._solid, self.modes.shapes
        states, first = shapes @ q, None
        for _ in range(MOST_ITERATIONS):
            force = solid.force(states)
            reaction = self.modes.products(force)
            rest: np.ndarray = force - self._pull @ np.linalg.solve(self.linear, reaction)
            size = np.sqrt(solid.domain.comm.allreduce(np.sum(rest**2, axis=0)))
            first = size if first is None else first
            noise = np.sqrt(solid.domain.comm.allreduce(np.sum(states**2, axis=0)))
            if np.all(size <= np.maximum(CONVERGED * first, ROUND_OFF * noise)):
                return np.asarray(reaction - self.linear @ q)
            change = self._factors.solve(rest)
            work = self.modes.products(solid.linear(change))
            states = states - change + shapes @ np.linalg.solve(self.linear, work)
        raise SolverError("a load case of the solid did not converge; take a smaller amplitude")
