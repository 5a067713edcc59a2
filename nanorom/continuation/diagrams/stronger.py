"""Folds of the response to a stronger drive.

An isola that merges with the response as the level rises lends it folds: above that level they are
the response's own, and a curve of folds leads from them down to those of the isola. Below it, and
where no level asked for is above, nothing tells of them.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from nanorom.continuation.branches.start import first_orbit
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.budget import Budget
from nanorom.continuation.diagrams.diagram import Diagram, SpecialPoint, Unexplored
from nanorom.continuation.orbits.bifurcations import FOLD
from nanorom.continuation.orbits.coordinates import with_symmetries
from nanorom.continuation.orbits.harmonics import forced_support
from nanorom.continuation.orbits.orbit import (
    Orbit,
    orbit_amplitudes,
    orbit_state,
    same_orbit,
)
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings
from nanorom.continuation.system import ModalSystem
from nanorom.errors import ContinuationError

SAME = 1e-3  # of an orbit at an end of the range, met from the other one


def folds_of_response(
    system: ModalSystem,
    omega: tuple[float, float],
    level: tuple[float, float],
    tolerance: float,
    steps: int,
) -> Diagram:
    """A level (direct, parametric) with nothing but the folds of what leads from rest into a range
    of frequencies, from either end; to a tolerance, in so many steps, and without multipliers.
    """
    scaled = with_symmetries(system.scaled(*level))
    budget = Budget(scaled.size)
    settings = Settings(tolerance=tolerance, series=tolerance, budget=budget)
    tracer = Tracer(scaled, forced_support(scaled), 1, settings)
    low, high = (value / scaled.frequency for value in omega)
    points: list[SpecialPoint] = []
    end: Orbit | None = None
    taken = 0
    for edge, inwards in ((low, 1.0), (high, -1.0)):
        try:
            orbit = first_orbit(tracer, edge, -inwards)
        except (
            ContinuationError,
            np.linalg.LinAlgError,
        ):  # the levels asked for may be easier, and say what they lack
            continue
        if end is not None and same_orbit(orbit, end, SAME):  # from end to end
            break
        for series in islice(tracer.follow(orbit, inwards, (low, high)), steps - taken):
            taken += 1
            end = tracer.orbit(series, series.length)
            folds = (tracer.orbit(series, a) for a in series.folds(series.start, series.length))
            points += [_point(scaled, fold) for fold in folds]
    why = "not followed, for the diagram has taken its most steps"
    left = [Unexplored("branch", omega[0], why)] if budget.spent or taken >= steps else []
    return Diagram([], points, *level, left)


def _point(scaled: ScaledSystem, orbit: Orbit) -> SpecialPoint:
    coefficients, omega = scaled.given(orbit.coefficients), orbit.omega * scaled.frequency
    return SpecialPoint(
        type=FOLD.code,
        omega=omega,
        amplitude=orbit_amplitudes(coefficients[None])[0],
        multipliers=np.ones(1),
        state=orbit_state(Orbit(coefficients, omega, 1)),
        branch=0,
        period_multiple=1,
        coefficients=coefficients,
    )
