"""Newton's method for a film's orbit, its corrections by preconditioned conjugate residuals.

Each step: residual and state along the orbit; a correction, solved the better the closer the orbit
is; half the correction, and half again, where the residual would grow.  Near the orbit the Jacobian
hardly changes: the preconditioner of one step, and what was learned with it, serve the next.
"""

from __future__ import annotations

import attrs

from nanorom.errors import SolverError
from nanorom.types import Array
from nanorom.verification.krylov import Directions, LinearSystem
from nanorom.verification.preconditioner import Border, Model, Preconditioner

SOLVED = 1e-8  # residual by the drive at which an orbit is one
ACCEPTED = 1e-6  # residual that will do where rounding lets it fall no further
MOST_STEPS = 10
SLOW, MOST_SLOW = 0.5, 3  # share of the residual that a slow step leaves; so many end the search
MOST_HALVINGS = 4
FORCING = 1e-2, 1e-3  # of the residual that the first, and a later correction may leave
SAFE = 0.3  # of what is still wanted, that a last correction leaves
MOST_DIRECTIONS = 60  # of a step, far more than a good start takes
NEAR = 0.1  # residual by the drive below which a preconditioner serves the next step
MANY = 12  # directions of a step after which the next gets a preconditioner of its own
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
    system = LinearSystem(model, x, rate, state, border)
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
    model: Model,
    x: Array,
    rate: float,
    border: Border,
    tolerance: float = SOLVED,
    patient: bool = True,
) -> Corrected:
    """The film's orbit near coefficients (n, 2H + 1) and a rate, on a border's hyperplane.

    patient : goes on though `MOST_DIRECTIONS` did not solve for a correction; without it the search
    ends there.  Raises NoOrbitError where Newton's method gets neither to the tolerance nor to
    `ACCEPTED`.
    """
    equations = model.equations
    residual, state = equations.residual(x, rate)
    size = equations.norm(residual) / equations.driving(x)
    start, evaluations, slow = size, 1, 0
    if size <= tolerance:
        return Corrected(x, rate, size, evaluations, 0)
    preconditioner: Preconditioner | None = None
    known = Directions.none()
    for step in range(MOST_STEPS):
        if size > NEAR:
            preconditioner, known = None, Directions.none()
        system = LinearSystem(model, x, rate, state, border, preconditioner, known)
        asked = max(FORCING[min(step, 1)], SAFE * tolerance / size)
        change, by_rate, used = system.solve(-residual, asked, MOST_DIRECTIONS)
        preconditioner, known = system.preconditioner, system.known
        if used > MANY:
            preconditioner = None
        evaluations += used
        if used == MOST_DIRECTIONS and not patient:
            break
        share = 1.0
        for _ in range(MOST_HALVINGS + 1):
            turned = rate + share * by_rate
            tried = system.preconditioner.placed(x + share * change, turned)
            evaluations += tried.evaluations
            new = tried.size / equations.driving(tried.coefficients)
            if new < size or (step == 0 and new < GROWTH * size):
                break
            share *= 0.5
        if not new < GROWTH * start:
            break
        stalled = new > 0.5 * size and new > tolerance
        slow += new > SLOW * size
        x, rate, size = tried.coefficients, turned, new
        residual, state = tried.residual, tried.state
        if size <= (ACCEPTED if stalled else tolerance):
            return Corrected(x, rate, size, evaluations, step + 1)
        if slow == MOST_SLOW:
            break
    raise NoOrbitError(size, evaluations)
