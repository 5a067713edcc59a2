"""A periodic orbit of the whole film, started from a modal one."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.orbits.orbit import PeriodicOrbit, orbit_amplitudes
from nanorom.errors import SceneError
from nanorom.scene.drive import Drive
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assemble import assemble
from nanorom.verification.assembled import Film
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.newton import SOLVED, Corrected, correct
from nanorom.verification.preconditioner import Border
from nanorom.verification.problem import Problem, pose

CANDIDATES = 50  # points that may be highest between time samples


@attrs.frozen(eq=False)
class FullOrbit:
    """An orbit of the film in all its degrees of freedom.

    modal : its projection on the model's modes, in m, as a modal orbit; outside : that on named
    modes which the model lacks, outside_label; residual : of the film's equations by the drive, in
    the norm of static work; deflection : largest |w| in m over film and period, from the static
    state; omega in rad/s; evaluations : of the film's force or its tangent.
    """

    modal: PeriodicOrbit
    outside: PeriodicOrbit
    outside_label: tuple[str, ...]
    residual: float
    deflection: float
    evaluations: int
    problem: Problem = attrs.field(repr=False)
    coefficients: Array = attrs.field(repr=False)

    @property
    def omega(self) -> float:
        """Drive frequency in rad/s."""
        return self.modal.omega

    @property
    def amplitude(self) -> Array:
        """max |q_r| (L,) in m of the model's modes over a period."""
        return np.asarray(orbit_amplitudes(self.modal.coefficients[None])[0])

    @property
    def named(self) -> PeriodicOrbit:
        """Its projection on all named modes, coefficients (2H + 1, N) in m."""
        named = self.problem.amplitudes(self.coefficients)
        return attrs.evolve(self.modal, coefficients=named)

    @property
    def outside_amplitude(self) -> Array:
        """max |q_r| (K,) in m of the modes that the model lacks."""
        return np.asarray(orbit_amplitudes(self.outside.coefficients[None])[0])


def full_orbit(
    scene: Scene,
    orbit: PeriodicOrbit,
    direct: float | None = None,
    parametric: float | None = None,
    drive: Drive | None = None,
    tolerance: float = SOLVED,
    more: int | None = None,
    film: Film | None = None,
) -> FullOrbit:
    """The film's own periodic orbit near one of its modal model.

    Parameters
    ----------
    scene : with [damping]; its modes are those of the orbit.
    orbit : modal orbit, coefficients (2H + 1, L) in m, omega in rad/s.
    direct, parametric : levels of the drive in the units of its patterns; left out, the scene's
        only level.
    drive : patterns, if they are not the scene's.
    tolerance : residual by the drive at which Newton's method stops.
    more : how many modes beyond the model's highest are told apart; the film is meshed for them.
    film : of the scene as `verification.assemble` made it, to solve for more than one orbit.

    Raises SceneError for a film that has no such orbits (a shell), SolverError if none is
    found near the modal orbit.
    """
    patterns = drive or scene.drive
    if patterns is None:
        raise SceneError("drive: missing section [drive], whose patterns drive the film")
    direct, parametric = _levels(patterns, direct, parametric)
    film = film or assemble(scene, more)
    problem = pose(DrivenFilm(film, patterns, direct, parametric), orbit)
    border = Border.fixed(problem.equations.harmonics, problem.model.size)
    start = problem.nearer(border) or (problem.start, problem.rate)
    return told(problem, correct(problem.model, *start, border, tolerance))


def told(problem: Problem, found: Corrected) -> FullOrbit:
    """What Newton's method found, in SI units."""
    film, p = problem.film, problem.equations.period_multiple
    amplitudes = problem.amplitudes(found.coefficients)
    omega = problem.omega(found.rate)
    outside = np.setdiff1d(np.arange(len(film.parities)), film.inside)
    return FullOrbit(
        modal=PeriodicOrbit(amplitudes[:, film.inside], omega, p),
        outside=PeriodicOrbit(amplitudes[:, outside], omega, p),
        outside_label=tuple(film.names[i] for i in outside),
        residual=found.residual,
        deflection=largest_deflection(problem, found.coefficients),
        evaluations=found.evaluations,
        problem=problem,
        coefficients=found.coefficients,
    )


def largest_deflection(problem: Problem, coefficients: Array) -> float:
    """max |w| in m over points of the film and the period, found between time samples."""
    equations = problem.equations
    heights = equations.film.heights(equations.classes, equations.parts(coefficients))
    series = heights.reshape(-1, coefficients.shape[1])
    sampled = np.abs(series @ equations.synthesis).max(axis=1)
    highest = series[np.argsort(sampled)[-CANDIDATES:]]
    return float(orbit_amplitudes(highest.T[None]).max() * problem.film.units.deflection)


def _levels(drive: Drive, direct: float | None, parametric: float | None) -> tuple[float, float]:
    if direct is not None or parametric is not None:
        return direct or 0.0, parametric or 0.0
    if len(drive.levels) != 1:
        raise SceneError(
            f"direct, parametric: missing; the scene's drive has {len(drive.levels)} levels"
        )
    return drive.levels[0]
