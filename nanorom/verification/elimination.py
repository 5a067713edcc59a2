"""What nearly undoes the harmonic balance of a film whose modes pull on all the rest at once.

With modes q and the rest v, J = [[J_qq, J_qv], [J_vq, J_vv]].  Once v is eliminated, the equations
of q are nearly those of the modes with all else condensed, which the modal Jacobian has:

    v1 = J_vv^-1 r_v ,  dq = (J_qq - J_qv J_vv^-1 J_vq)^-1 (r_q - J_qv v1) ,
    v = v1 - J_vv^-1 J_vq dq .

Two further derivatives of the force for each right-hand side; without them Krylov's method has to
find out in every harmonic how the rest follows.
"""

from __future__ import annotations

from typing import Any

import attrs

from nanorom.types import Array
from nanorom.verification.preconditioner import Border, Model, Placed, Preconditioner

MOST_MOVES = 6  # of the rest after a step of the modes,
WORTH = 0.7  # as long as they leave no more than that of the residual


class Elimination(Preconditioner):
    """The same with the coupling of modes and the rest, to first order in what it leaves out."""

    def __init__(self, model: Model, x: Array, rate: float, state: Any, border: Border) -> None:
        super().__init__(model, x, rate, state, border)
        self._state, self._rate = state, rate

    def __call__(self, forces: Array, last: float) -> tuple[Array, float]:
        """Changes of the coefficients and of the rate for a right-hand side."""
        first = self.beyond(forces)
        amplitudes, rate = self.modal(forces - self._along(first), last)
        moved = self.model.expand(amplitudes)
        second = self.beyond(self._along(moved) + rate * self.by_rate)
        return moved + first - second, rate

    def placed(self, x: Array, rate: float) -> Placed:
        """With the rest moved to where it is nearly in balance, the modes at rest.

        A step of the modes curves the path of the rest: what it is off by is of second order in
        the step, and large, for the rest is stiff.
        """
        found = super().placed(x, rate)
        for count in range(2, MOST_MOVES + 2):
            moved = super().placed(found.coefficients - self.beyond(found.residual), rate)
            if moved.size > WORTH * found.size:
                better = moved if moved.size < found.size else found
                return attrs.evolve(better, evaluations=count)
            found = attrs.evolve(moved, evaluations=count)
        return found

    def _along(self, change: Array) -> Array:
        return self.equations.along(self._state, change, self._rate)


def made(model: Model, x: Array, rate: float, state: Any, border: Border) -> Preconditioner:
    """The preconditioner that a film needs."""
    kind = Elimination if model.equations.film.follows else Preconditioner
    return kind(model, x, rate, state, border)
