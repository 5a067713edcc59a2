"""The equations of one orbit: which classes of symmetry take part, and where Newton starts."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.orbits.balance import NewtonFailure
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.system import ModalSystem
from nanorom.errors import SceneError
from nanorom.types import Array
from nanorom.verification.assembled import Film
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.equations import Drive, OrbitEquations
from nanorom.verification.preconditioner import Border, Model
from nanorom.verification.symmetry import Classes

REACH = 1.3  # times the highest harmonic: frequencies up to which modes have equations of their own
LADDER = 1.25  # ratio of the frequencies up to which a basis of modes is kept
NEARER = 1e-6  # of an orbit of the named modes: the last change of Newton's method
MOVING = 1e-12  # of the largest coefficient: a mode below that rests


@attrs.frozen(eq=False, repr=False)
class Problem:
    """An orbit's equations, the named modes among them, and the modal orbit as a start.

    active (a,): places of the modes that take part among the film's named ones, class by class.
    """

    film: Film
    model: Model
    active: np.ndarray
    start: Array
    rate: float

    @property
    def equations(self) -> OrbitEquations:
        """The film's harmonic balance."""
        return self.model.equations

    def amplitudes(self, coefficients: Array) -> Array:
        """Fourier coefficients (2H + 1, N) in m of all named modes, of the film's (n, 2H + 1)."""
        found = np.zeros((coefficients.shape[1], len(self.film.parities)))
        modal = self.model.project(coefficients, momenta=True).T
        found[:, self.active] = modal * self.film.scale[self.active]
        return found

    def omega(self, rate: float) -> float:
        """Drive frequency in rad/s."""
        return rate * self.equations.period_multiple / self.film.units.time

    def placed(self, orbit: PeriodicOrbit) -> tuple[Array, float]:
        """Coefficients and rate of an orbit of the model's modes, or of all named ones."""
        amplitudes = self.film.all_named(orbit.coefficients)[:, self.active]
        rate = orbit.omega / orbit.period_multiple * self.film.units.time
        return self.model.orbit((amplitudes / self.film.scale[self.active]).T), rate

    def nearer(
        self, border: Border, start: tuple[Array, float] | None = None
    ) -> tuple[Array, float] | None:
        """Coefficients and rate of the orbit of all named modes next to a start, None without one.

        It is the film's but for what is beyond these modes, at the price of one preconditioner.
        start : the modal orbit, if left out.
        """
        try:
            return self.model.corrected(*(start or (self.start, self.rate)), border, NEARER)
        except NewtonFailure:  # the search goes on from the modal orbit, or with more modes
            return None

    def across(self) -> Border:
        """Across the branch on which the start is: what changes is orthogonal to it."""
        direction, slope = self.model.direction(self.start, self.rate)
        return Border(direction, slope)


def pose(driven: DrivenFilm, orbit: PeriodicOrbit) -> Problem:
    """The problem that a modal orbit starts, its coefficients (2H + 1, L) in m.

    Raises SceneError if the orbit has not as many modes as the film's model.
    """
    film = driven.film
    count = len(film.inside)
    if orbit.coefficients.ndim != 2 or orbit.coefficients.shape[1] != count:
        raise SceneError(
            f"orbit: found coefficients of shape {orbit.coefficients.shape}; allowed: (2H + 1, "
            f"{count}), for the scene has {count} modes"
        )
    course = driven.course("direct")
    orbit = orbit.with_harmonics(len(course) // 2 * orbit.period_multiple)
    classes = _taking_part(driven, orbit)
    rate = orbit.omega / orbit.period_multiple * film.units.time
    highest = _rung(REACH * rate * orbit.harmonics)
    dynamics = [film.dynamics(p, highest) for p in classes.deflections]
    pushed = [driven.forces.get(p, np.zeros(d.size)) for p, d in zip(classes.deflections, dynamics)]
    modulated = [driven.modulation(p) for p in classes.deflections]
    equations = OrbitEquations(
        film.discrete,
        classes,
        dynamics,
        Drive(
            pushed,
            course,
            None if any(each is None for each in modulated) else modulated,
            driven.course("parametric"),
        ),
        orbit.harmonics,
        orbit.period_multiple,
        driven.material_time,
    )
    own = [film.of_class(p) for p in classes.deflections]
    active = np.concatenate(own)
    model = Model(equations, [len(some) for some in own], _some(driven.system, active))
    amplitudes = film.all_named(orbit.coefficients)[:, active]
    start = model.orbit((amplitudes / film.scale[active]).T)
    return Problem(film, model, active, start, rate)


def _rung(frequency: float) -> float:
    """The next frequency of a ladder: orbits of like frequencies share a basis."""
    return float(LADDER ** np.ceil(np.log(frequency) / np.log(LADDER)))


def _taking_part(driven: DrivenFilm, orbit: PeriodicOrbit) -> Classes:
    film = driven.film
    size = np.abs(orbit.coefficients).max(axis=0)
    moving = film.inside[size > MOVING * size.max()]
    present = {film.parities[i] for i in moving} | set(driven.forces)
    if not film.discrete.odd or not present:
        present.add(film.discrete.even)
    return Classes.spanned(present)


def _some(system: ModalSystem, active: np.ndarray) -> ModalSystem:
    """The equations of some modes, all others at rest."""
    arrays = attrs.asdict(system, recurse=False).items()
    parts = {
        name: array[np.ix_(*(active,) * array.ndim)]
        for name, array in arrays
        if isinstance(array, np.ndarray)
    }
    drives = [
        attrs.evolve(
            drive, direct=drive.direct[active], parametric=drive.parametric[np.ix_(active, active)]
        )
        for drive in system.drives
    ]
    return ModalSystem(**parts, drives=drives)
