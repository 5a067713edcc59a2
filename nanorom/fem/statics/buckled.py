"""States of a film that is compressed beyond its critical tension: it gives way to either side.

The flat state, and the one into which a small load turns it, is unstable there; the stable ones lie
away from it.  Under a load so large that it stretches the film more than the tension compresses it,
there is one state on the side of the load, which Newton's method finds from that of the film
without its compression; as the load falls again, the state stays on its side.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from nanorom.errors import SolverError
from nanorom.fem.models.coupled import Film
from nanorom.fem.statics import path
from nanorom.fem.statics.loads import Load
from nanorom.fem.statics.loads import problem as problem_of
from nanorom.fem.statics.problem import StaticProblem

LARGER = 30.0  # each load that is tried, by the last
MOST_LOADS = 10

LoadOn = Callable[[Film], Load | None]


def states(
    film: Film, problem: StaticProblem, load_on: LoadOn
) -> tuple[np.ndarray, np.ndarray | None]:
    """Stable state (owned free dofs) on the side to which the load pushes, and on the other.

    None where the film has none on the other side.  ``problem`` is left in the first of them, under
    its whole load.  Raises SolverError if no stable state is found.  Collective.
    """
    other = None
    try:
        other = _settled(film, problem, load_on, -1.0)
    except SolverError:  # the load is larger than that at which the film snaps over
        pass
    return _settled(film, problem, load_on, 1.0), other


def _settled(film: Film, problem: StaticProblem, load_on: LoadOn, sign: float) -> np.ndarray:
    """The stable state under the whole load that is left when one of a sign falls to it."""
    state = film.plate.state
    x, y = state.tension
    tension = max(x, 0.0), max(y, 0.0)
    loose = Film(film.plate.about(attrs.evolve(state, tension=tension, shear=0.0)))
    rising = problem_of(loose, load_on(loose))
    magnitudes = sign * LARGER ** np.arange(MOST_LOADS)
    for point in path.load_steps(rising, [float(m) for m in magnitudes]):
        try:
            problem.solve(point.magnitude, point.values)
        except SolverError:  # the next load, larger, leaves less to the compression
            continue
        problem.factorise()
        if problem.negative_pivots() == 0:
            break
    for point in path.load_steps(problem, [1.0]):
        if point.stable:
            return point.values
    raise SolverError("no stable state was found on this side of the film")
