"""Linear systems of a film's orbit by preconditioned conjugate residuals, one after another.

Generalised conjugate residuals (Eisenstat, Elman, Schultz 1983, doi:10.1137/0720023) in the norm of
the static work.  Near an orbit the Jacobian hardly changes from one step to the next: what earlier
systems have learned of it goes into the preconditioner (as in Parks et al. 2006,
doi:10.1137/040607277), but the forces of a step are always those of its own Jacobian: with forces
of an earlier one Newton's method would converge linearly only.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from nanorom.types import Array
from nanorom.verification.elimination import made
from nanorom.verification.preconditioner import Border, Model, Preconditioner

MOST_KEPT = 80  # directions that later systems know: 1 MB each
CANCELLED = 0.1  # of a force's norm: where less is left, what rounding left is taken away as well
OWN = 0.3  # of an earlier force's norm, that the later ones leave: below, they know it better


@attrs.frozen(eq=False)
class Directions:
    """Changes and the forces that they make (k, n + 1), the forces orthonormal; the last entry is
    of the rate, and of the equation that fixes it."""

    changes: Array
    forces: Array

    @classmethod
    def none(cls) -> Directions:
        """No directions."""
        return cls(np.empty((0, 0)), np.empty((0, 0)))

    def __len__(self) -> int:
        return len(self.changes)

    def after(self, changes: Array, forces: Array, duals: Array) -> Directions:
        """Later directions, and of these what they do not know."""
        if not len(self):
            return Directions(changes[:MOST_KEPT], forces[:MOST_KEPT])
        shares = self.forces @ duals.T
        values, turned = np.linalg.eigh(np.eye(len(self)) - shares @ shares.T)
        room = max(MOST_KEPT - len(changes), 0)
        own = [k for k in np.argsort(-values)[:room] if values[k] > OWN**2]
        turned = (turned[:, own] / np.sqrt(values[own])).T
        parts = [(changes, self.changes), (forces, self.forces)]
        return Directions(
            *(np.concatenate([a, turned @ b - (turned @ shares) @ a])[:MOST_KEPT] for a, b in parts)
        )


class LinearSystem:
    """The bordered Jacobian about a state, to be solved with a preconditioner that may be older.

    known : directions of earlier systems.
    """

    def __init__(
        self,
        model: Model,
        x: Array,
        rate: float,
        state: Any,
        border: Border,
        preconditioner: Preconditioner | None = None,
        known: Directions | None = None,
    ) -> None:
        self.model, self.rate, self.state, self.border = model, rate, state, border
        self.shape = x.shape
        self.by_rate = model.equations.by_rate(x, rate)
        self.preconditioner = preconditioner or made(model, x, rate, state, border)
        self.known = known or Directions.none()

    def apply(self, change: Array) -> Array:
        """What the Jacobian makes of a change (n + 1,)."""
        model, by_rate = self.model, float(change[-1])
        columns = change[:-1].reshape(self.shape)
        force = model.equations.along(self.state, columns, self.rate)
        force += by_rate * self.by_rate
        last = self.border.slope * by_rate
        if self.border.direction.any():
            modal = model.project(columns, momenta=True).T
            last += float(np.vdot(self.border.direction, modal))
        return np.append(force, last)

    def dual(self, force: Array) -> Array:
        """Static deflections under a force (n + 1,), which multiply others by it."""
        deflections = self.model.equations.flexibility(force[:-1].reshape(self.shape))
        return np.append(deflections, force[-1])

    def solve(self, forces: Array, tolerance: float, most: int) -> tuple[Array, float, int]:
        """Change of coefficients and rate to a relative tolerance, and evaluations taken."""
        left = np.append(forces, 0.0)
        dual = self.dual(left)
        wanted = size = _length(left, dual)
        total = np.zeros_like(left)
        changes, rows, duals = (np.empty((most, len(left))) for _ in range(3))
        count = 0
        while count < most and size > tolerance * wanted:
            change = self._likely(left, dual)
            force = self.apply(change)
            change, force, own = self._orthogonal(
                change, force, changes[:count], rows[:count], duals[:count]
            )
            changes[count], rows[count], duals[count] = change, force, own
            share = float(force @ dual)
            left -= share * force
            dual -= share * own
            total += share * change
            size, count = _length(left, dual), count + 1
        self.known = self.known.after(changes[:count], rows[:count], duals[:count])
        return total[:-1].reshape(self.shape), float(total[-1]), count

    def _likely(self, left: Array, dual: Array) -> Array:
        """Nearly the change that makes a force: as far as is known, else by the preconditioner."""
        known, change = self.known, np.zeros_like(left)
        if len(known):
            shares = known.forces @ dual
            left = left - shares @ known.forces
            change = shares @ known.changes
        rest, rate = self.preconditioner(left[:-1].reshape(self.shape), float(left[-1]))
        return np.asarray(change + np.append(rest, rate))

    def _orthogonal(
        self, change: Array, force: Array, changes: Array, forces: Array, duals: Array
    ) -> tuple[Array, Array, Array]:
        """Change, force and its dual, of unit norm and orthogonal to others."""
        for _ in range(2):
            shares = duals @ force
            force, change = force - shares @ forces, change - shares @ changes
            own = self.dual(force)
            length = _length(force, own)
            if length > CANCELLED * float(np.linalg.norm(shares)):
                break
        length = length or 1.0
        return change / length, force / length, own / length


def _length(force: Array, dual: Array) -> float:
    return float(np.sqrt(max(float(force @ dual), 0.0)))
