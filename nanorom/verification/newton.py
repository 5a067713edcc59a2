"""Newton's method for a film's orbit, its corrections by preconditioned conjugate residuals.

Each step: residual and state along the orbit; a preconditioner about them; a correction by
generalised conjugate residuals (Eisenstat, Elman, Schultz 1983, doi:10.1137/0720023) in the norm of
the static work, solved the better the closer the orbit is; half the correction, and half again,
where the residual would grow.  Near the orbit the Jacobian hardly changes: the directions of one
step serve the next (Parks et al. 2006, doi:10.1137/040607277).
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.errors import SolverError
from nanorom.types import Array
from nanorom.verification.film import State
from nanorom.verification.preconditioner import Border, Model, Preconditioner

SOLVED = 1e-8  # residual by the drive at which an orbit is one
ACCEPTED = 1e-6  # residual that will do where rounding lets it fall no further
MOST_STEPS = 10
SLOW, MOST_SLOW = 0.5, 3  # share of the residual that a slow step leaves; so many end the search
MOST_HALVINGS = 4
FORCING = 1e-2, 1e-3  # of the residual that the first, and a later correction may leave
SAFE = 0.3  # of what is still wanted, that a last correction leaves
MOST_DIRECTIONS = 60  # of a step, far more than a good start takes
MOST_KEPT = 180  # directions in all
NEAR = 0.1  # residual by the drive below which directions serve the next step
ESTIMATED = 4  # directions for an estimate
GROWTH = 1e3  # of the residual: beyond that nothing is near


@attrs.frozen(eq=False)
class Corrected:
    """Coefficients (n, 2H + 1) and rate of an orbit, its residual by the drive, and what it took.

    evaluations : of force and tangent; steps : of Newton's method.
    """

    coefficients: Array
    rate: float
    residual: float
    evaluations: int
    steps: int


@attrs.frozen(eq=False)
class FirstCorrection:
    """Residual by the drive that a start leaves, and what it is wrong by to first order.

    change (n, 2H + 1) of the coefficients, by_rate of the rate.
    """

    residual: float
    change: Array
    by_rate: float


def first_correction(model: Model, x: Array, rate: float, border: Border) -> FirstCorrection:
    """What coefficients (n, 2H + 1) and a rate are wrong by, at the cost of a few forces.

    Modes outside answer in the first direction, the model to them in the second.
    """
    equations = model.equations
    residual, state = equations.residual(x, rate)
    size = equations.norm(residual) / equations.driving(x)
    system = _Linear(model, x, rate, state, border, [])
    change, by_rate, _ = system.solve(-residual, 0.0, ESTIMATED)
    return FirstCorrection(size, change, by_rate)


class NoOrbitError(SolverError):
    """Newton's method found no full-order orbit near the modal one.

    residual : at which it ended, by the drive.
    """

    def __init__(self, residual: float, evaluations: int) -> None:
        super().__init__(
            f"no orbit of the film was found near the modal one: the residual is {residual:.1e} of "
            f"the drive after {evaluations} evaluations"
        )
        self.residual = residual


def correct(
    model: Model, x: Array, rate: float, border: Border, tolerance: float = SOLVED
) -> Corrected:
    """The film's orbit near coefficients (n, 2H + 1) and a rate, on a border's hyperplane.

    Raises NoOrbitError where Newton's method gets neither to the tolerance nor to `ACCEPTED`.
    """
    equations = model.equations
    residual, state = equations.residual(x, rate)
    size = equations.norm(residual) / equations.driving(x)
    start, evaluations, slow = size, 1, 0
    directions: list[Direction] = []
    for step in range(MOST_STEPS):
        if size <= tolerance:
            return Corrected(x, rate, size, evaluations, step)
        directions = directions if size < NEAR else []
        system = _Linear(model, x, rate, state, border, directions)
        asked = max(FORCING[min(step, 1)], SAFE * tolerance / size)
        change, by_rate, used = system.solve(-residual, asked)
        evaluations += used
        share = 1.0
        for _ in range(MOST_HALVINGS + 1):
            tried = x + share * change, rate + share * by_rate
            residual, state = equations.residual(*tried)
            evaluations += 1
            new = equations.norm(residual) / equations.driving(tried[0])
            if new < size or (step == 0 and new < GROWTH * size):
                break
            share *= 0.5
        if not new < GROWTH * start:
            break
        stalled = new > 0.5 * size and new > tolerance
        slow += new > SLOW * size
        x, rate, size = *tried, new
        if stalled and size <= ACCEPTED:
            return Corrected(x, rate, size, evaluations, step + 1)
        if slow == MOST_SLOW:
            break
    raise NoOrbitError(size, evaluations)


class _Linear:
    """The bordered linear system of one step, and directions that are known from steps before."""

    def __init__(
        self,
        model: Model,
        x: Array,
        rate: float,
        state: State,
        border: Border,
        directions: list[Direction],
    ) -> None:
        self.model, self.rate, self.state, self.border = model, rate, state, border
        self.directions = directions
        self.preconditioner = Preconditioner(model, x, rate, state, border)

    def apply(self, change: Array, by_rate: float) -> tuple[Array, float]:
        """What the Jacobian makes of a change."""
        model = self.model
        force = model.equations.along(self.state, change, self.rate)
        force += by_rate * self.preconditioner.by_rate
        last = self.border.slope * by_rate
        if self.border.direction.any():
            modal = model.project(change, momenta=True).T
            last += float(np.vdot(self.border.direction, modal))
        return force, last

    def solve(
        self, forces: Array, tolerance: float, most: int = MOST_DIRECTIONS
    ) -> tuple[Array, float, int]:
        """Change of coefficients and rate to a relative tolerance, and evaluations taken."""
        equations, known = self.model.equations, self.directions
        left, last = forces, 0.0
        change, by_rate = np.zeros_like(forces), 0.0
        size = wanted = equations.norm(forces)
        for one in known:
            share = one.share(left, last)
            left, last = left - share * one.force, last - share * one.last
            change, by_rate = change + share * one.change, by_rate + share * one.by_rate
        count = len(known)
        while len(known) < count + most:
            one = self._direction(*self.preconditioner(left, last))
            known.append(one)
            share = one.share(left, last)
            left, last = left - share * one.force, last - share * one.last
            change, by_rate = change + share * one.change, by_rate + share * one.by_rate
            size = float(np.hypot(equations.norm(left), last))
            if size <= tolerance * wanted:
                break
        used = len(known) - count
        del known[:-MOST_KEPT]
        return change, by_rate, used

    def _direction(self, change: Array, by_rate: float) -> Direction:
        """A change and what the Jacobian makes of it, of unit norm, orthogonal to all others."""
        force, last = self.apply(change, by_rate)
        for _ in range(2):  # once more, for what rounding left
            for one in self.directions:
                share = one.share(force, last)
                force, last = force - share * one.force, last - share * one.last
                change, by_rate = change - share * one.change, by_rate - share * one.by_rate
        dual = self.model.equations.flexibility(force)
        length = float(np.sqrt(np.maximum(float(np.vdot(force, dual)), 0.0) + last**2))
        length = length or 1.0
        return Direction(
            change / length, by_rate / length, force / length, last / length, dual / length
        )


@attrs.frozen(eq=False)
class Direction:
    """A change of coefficients and rate, the force and the last equation that it makes.

    dual : static deflection under the force, with which others are multiplied by it.
    """

    change: Array
    by_rate: float
    force: Array
    last: float
    dual: Array

    def share(self, force: Array, last: float) -> float:
        """How much of a right-hand side the direction has."""
        return float(np.vdot(self.dual, force)) + self.last * last
