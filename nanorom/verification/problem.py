"""The equations of one orbit: which classes of symmetry take part, and where Newton starts."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.system import ModalSystem
from nanorom.errors import SceneError
from nanorom.fem.symmetry import Parity
from nanorom.scene.drive import Drive
from nanorom.types import Array
from nanorom.verification import drives
from nanorom.verification.assemble import Film
from nanorom.verification.equations import Drive as FilmDrive
from nanorom.verification.equations import OrbitEquations
from nanorom.verification.linear import ClassDynamics
from nanorom.verification.preconditioner import Model
from nanorom.verification.symmetry import Classes

REACH = 1.3  # times the highest harmonic: frequencies up to which modes have equations of their own
LADDER = 1.25  # ratio of the frequencies up to which a basis of modes is kept
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
        return rate * self.equations.period_multiple / self.film.time

    def coordinates(self, amplitudes: Array) -> Array:
        """Modal coordinates (2H + 1, active) of the model's amplitudes (2H + 1, L) in m."""
        whole = np.zeros((len(amplitudes), len(self.film.parities)))
        whole[:, self.film.inside] = amplitudes
        return np.asarray(whole[:, self.active] / self.film.scale[self.active])


def pose(
    film: Film, drive: Drive, orbit: PeriodicOrbit, direct: float, parametric: float
) -> Problem:
    """The problem that a modal orbit starts, at levels of the drive's patterns in SI units.

    Raises SceneError if the orbit has not as many modes as the scene.
    """
    count = len(film.inside)
    if orbit.coefficients.ndim != 2 or orbit.coefficients.shape[1] != count:
        raise SceneError(
            f"orbit: found coefficients of shape {orbit.coefficients.shape}; allowed: (2H + 1, "
            f"{count}), as modes.count of the scene has it"
        )
    forces = drives.direct_forces(film, drive) if direct else {}
    classes = _taking_part(film, orbit, forces)
    rate = orbit.omega / orbit.period_multiple * film.time
    highest = _rung(REACH * rate * orbit.harmonics)
    dynamics = [film.dynamics(p, highest) for p in classes.deflections]
    unit, stiff = film.units.force, film.scales.tension
    pushed = [
        direct / unit * forces.get(p, np.zeros(d.size))
        for p, d in zip(classes.deflections, dynamics)
    ]
    modulated = None
    if parametric:
        modulated = [
            parametric / stiff * drives.modulation(film, drive, p) for p in classes.deflections
        ]
    assert film.scene.damping is not None
    equations = OrbitEquations(
        film.discrete,
        classes,
        dynamics,
        FilmDrive(pushed, modulated),
        orbit.harmonics,
        orbit.period_multiple,
        film.scene.damping.material_time / film.time,
    )
    own = [[i for i, q in enumerate(film.parities) if q == p] for p in classes.deflections]
    active = np.array([i for some in own for i in some])
    system = _system(film, equations, active, dynamics)
    model = Model(equations, [len(some) for some in own], system)
    problem = Problem(film, model, active, np.empty(0), rate)
    start = model.expand(problem.coordinates(orbit.coefficients).T)
    return attrs.evolve(problem, start=start)


def _rung(frequency: float) -> float:
    """The next frequency of a ladder: orbits of like frequencies share a basis."""
    return float(LADDER ** np.ceil(np.log(frequency) / np.log(LADDER)))


def _taking_part(film: Film, orbit: PeriodicOrbit, forces: dict[Parity, Array]) -> Classes:
    size = np.abs(orbit.coefficients).max(axis=0)
    moving = film.inside[size > MOVING * size.max()]
    present = {film.parities[i] for i in moving} | set(forces)
    if film.discrete.shape is not None or film.discrete.gate is not None or not present:
        present.add(film.discrete.even)
    return Classes.spanned(present)


def _system(
    film: Film, equations: OrbitEquations, active: np.ndarray, dynamics: Sequence[ClassDynamics]
) -> ModalSystem:
    """Modal equations of the active modes in coordinates of unit mass, at the levels that act."""
    modal, scale = film.modal, film.scale[active]
    energy = film.units.deflection**2 * film.scales.tension * film.plate.mirrors.copies

    def tensor(name: str) -> Array:
        array = modal[name]
        part = array[np.ix_(*(active,) * array.ndim)]
        for axis in range(array.ndim):
            part = part * scale.reshape([-1 if i == axis else 1 for i in range(array.ndim)])
        return np.asarray(part / energy)

    time = equations.material_time
    parities = [film.parities[i] for i in active]
    named = [parities.count(p) for p in equations.classes.deflections]
    shapes = [d.modes[:, :count] for d, count in zip(dynamics, named)]
    damping = np.diag(np.concatenate([d.rates[:count] for d, count in zip(dynamics, named)]))
    direct = np.concatenate([s.T @ f for s, f in zip(shapes, equations.drive.direct)])
    parametric = np.zeros((len(active),) * 2)
    offsets = np.cumsum([0, *named])
    for place, (first, last) in enumerate(zip(offsets[:-1], offsets[1:])):
        if equations.drive.modulation is not None:
            work = shapes[place].T @ (equations.drive.modulation[place] @ shapes[place])
            parametric[first:last, first:last] = -work
    return ModalSystem(
        stiffness=tensor("stiffness"),
        damping=damping + (time * tensor("bending") if time else 0.0),
        quadratic=tensor("quadratic"),
        cubic=tensor("cubic"),
        cubic_damping=time * tensor("stretching") if time else None,
        direct=direct,
        parametric=parametric,
    )
