"""One modal orbit beside the film's: what it is wrong by, as estimated and as solved for.

The estimate is the first correction that Newton's method would make, its linear system solved in a
few directions only: modes outside answer to the residual that the modal orbit leaves in the film,
each by the dynamic stiffness that it has along the orbit, and the model answers to them.  At a
fold the drive frequency is a further unknown, and
the orbit is looked for across the branch: at a given frequency there may be none.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.diagrams.selection import Chosen
from nanorom.continuation.orbits.bifurcations import turns
from nanorom.continuation.orbits.orbit import PeriodicOrbit, orbit_amplitudes
from nanorom.types import Array
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.newton import NoOrbitError, correct, first_correction
from nanorom.verification.orbit import FullOrbit, largest_deflection, told
from nanorom.verification.preconditioner import Border
from nanorom.verification.problem import Problem, pose
from nanorom.verification.stability import Stability

VERIFIED = 1e-6  # residual by the drive: errors are told to 1e-5 at best, more digits are dear


@attrs.frozen(eq=False)
class Comparison:
    """A row of the table: the modal orbit's estimate, and the film's orbit or None.

    modal_residual : of the film's equations by the drive; estimate, estimate_omega: relative, of
    the largest amplitude and of the frequency; takes_part (K,) in m; deflection in m, of the model;
    multiplier, multiplier_film : largest modulus of a Floquet multiplier of the modal orbit, and of
    the film's own, all named modes being among those that may grow;
    left : the residual, by the drive, at which the search for the film's orbit ended in vain, NaN
    where it was found or not looked for.  near : the orbit of all named modes next to the modal
    one, (2H + 1, N) in m; None where there is none, or where the film's was found.
    """

    point: Chosen
    modal_residual: float
    estimate: float
    estimate_omega: float
    takes_part: Array
    deflection: float
    multiplier: float
    multiplier_film: float
    full: FullOrbit | None
    left: float
    near: PeriodicOrbit | None

    @property
    def error(self) -> float:
        """True relative error of the model's largest amplitude, NaN where the film has no orbit."""
        if self.full is None:
            return np.nan
        mode = int(self.point.amplitude.argmax())
        return float(self.point.amplitude[mode] / self.full.amplitude[mode] - 1)


def compare(
    driven: DrivenFilm,
    stability: Stability,
    point: Chosen,
    solve: bool,
    near: PeriodicOrbit | None = None,
    patient: bool = True,
) -> Comparison:
    """Estimate what a modal orbit is wrong by and, with ``solve``, find the film's orbit.

    near : orbit (2H + 1, N) in m of all named modes from where to look for it, rather than from
    the modal one.  patient : look for it as long as there is hope; without it, only next to an
    orbit of all named modes, and while few directions solve for a correction.
    """
    film, problem = driven.film, pose(driven, point.orbit)
    fixed = Border.fixed(problem.equations.harmonics, problem.model.size)
    across = problem.across()
    borders = [across] if turns(point.type) else [fixed, across]
    search = _solved(problem, borders, near, patient) if solve else _Search(None, borders[0])
    full = search.full
    first = first_correction(problem.model, problem.start, problem.rate, search.border)
    corrected = problem.amplitudes(problem.start + first.change)
    amplitude = orbit_amplitudes(corrected[None])[0]
    mode = film.inside[int(point.amplitude.argmax())]
    outside = np.setdiff1d(np.arange(len(film.parities)), film.inside)
    return Comparison(
        point=point,
        modal_residual=first.residual,
        estimate=float(abs(point.amplitude.max() / amplitude[mode] - 1)),
        estimate_omega=first.by_rate / problem.rate,
        takes_part=amplitude[outside],
        deflection=largest_deflection(problem, problem.start),
        multiplier=stability.largest(point.orbit),
        multiplier_film=np.nan if full is None else stability.largest(full.named),
        full=full,
        left=search.left,
        near=search.near,
    )


@attrs.frozen(eq=False)
class _Search:
    """The film's orbit or None, and the border on which it is, for the estimate to be on the same.

    left, near : as in `Comparison`.
    """

    full: FullOrbit | None
    border: Border
    left: float = np.nan
    near: PeriodicOrbit | None = None


def _solved(
    problem: Problem, borders: list[Border], near: PeriodicOrbit | None, patient: bool
) -> _Search:
    """The film's orbit at the same frequency, or else across the branch, or none.

    Where all named modes have an orbit the film is likely to have one: there it is looked for
    first.
    """
    modal = problem.start, problem.rate
    start = modal if near is None else problem.placed(near)
    found = [(border, problem.nearer(border, start)) for border in borders]
    likely = [(border, each) for border, each in found if each is not None]
    others = [(border, modal) for border, each in found if each is None] if patient else []
    left = np.inf
    for border, (x, rate) in likely + others:
        try:
            orbit = correct(problem.model, x, rate, border, VERIFIED, patient)
        except NoOrbitError as error:
            left = min(left, error.residual)
        else:
            return _Search(told(problem, orbit), border)
    if likely:
        x, rate = likely[0][1]
        p = problem.equations.period_multiple
        near = PeriodicOrbit(problem.amplitudes(x), problem.omega(rate), p)
    return _Search(None, borders[0], left, near)
