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
from nanorom.continuation.orbits.orbit import orbit_amplitudes
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
    left : the residual, by the drive, at which the search for the film's orbit ended in vain, NaN
    where it was found or not looked for.
    """

    point: Chosen
    modal_residual: float
    estimate: float
    estimate_omega: float
    takes_part: Array
    deflection: float
    multiplier: float
    full: FullOrbit | None
    left: float

    @property
    def error(self) -> float:
        """True relative error of the model's largest amplitude, NaN where the film has no orbit."""
        if self.full is None:
            return np.nan
        mode = int(self.point.amplitude.argmax())
        return float(self.point.amplitude[mode] / self.full.amplitude[mode] - 1)


def compare(driven: DrivenFilm, stability: Stability, point: Chosen, solve: bool) -> Comparison:
    """Estimate what a modal orbit is wrong by and, with ``solve``, find the film's orbit."""
    film, problem = driven.film, pose(driven, point.orbit)
    fixed = Border.fixed(point.orbit.harmonics, problem.model.size)
    across = problem.across()
    borders = [across] if turns(point.type) else [fixed, across]
    full, border, left = _solved(problem, borders) if solve else (None, borders[0], np.nan)
    first = first_correction(problem.model, problem.start, problem.rate, border)
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
        full=full,
        left=left,
    )


def _solved(problem: Problem, borders: list[Border]) -> tuple[FullOrbit | None, Border, float]:
    """The film's orbit at the same frequency, or else across the branch, or none.

    With it the border on which it is, for the estimate to be on the same, and the smallest residual
    at which the search ended where there is none, else NaN.
    """
    left = np.inf
    for border in borders:
        try:
            found = correct(problem.model, *problem.nearer(border), border, VERIFIED)
        except NoOrbitError as error:
            left = min(left, error.residual)
        else:
            return told(problem, found), border, np.nan
    return None, borders[0], left
