"""The static state of a scene: its film under its load, its pre-stress relaxed at free edges."""

from __future__ import annotations

import functools
import operator

import attrs
import numpy as np
import ufl
from dolfinx import fem

from nanorom.errors import LoadError, SceneError, SolverError
from nanorom.fem.models import initial_shape
from nanorom.fem.models.build import relaxes
from nanorom.fem.models.coupled import Film
from nanorom.fem.models.patchwork import located
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import compat
from nanorom.fem.statics import buckled, loads, path
from nanorom.fem.statics.problem import StaticProblem
from nanorom.scene.load import VACUUM_PERMITTIVITY, Load
from nanorom.scene.scene import Scene
from nanorom.scene.units import place_with_unit, with_unit

BEFORE_LIMIT = 0.9  # of the load that steps reached: where the path to the limit point begins
MOST_TO_LIMIT = 60  # steps: load steps end within a few of a limit point


@attrs.frozen
class Units:
    """Units of the film's static problem: SI value = unit x non-dimensional value.

    deflection makes stretching as stiff as the tension; pressure and force follow.
    """

    length: float
    tension: float
    deflection: float
    pressure: float
    force: float
    attraction: float

    @classmethod
    def of(cls, scene: Scene, length: float, tension: float) -> Units:
        """Units of a scene whose length and tension are measured in these."""
        stretch = scene.material.youngs_modulus * scene.plate.thickness
        deflection = length * np.sqrt(tension / stretch)
        pressure = tension * deflection / length**2
        force, attraction = tension * deflection, pressure * deflection**2
        return cls(length, tension, deflection, pressure, force, attraction)


@attrs.frozen(eq=False)
class StaticState:
    """The plate about its equilibrium, and how it came there.

    deflection: (local dofs,) from its first shape; tension: the mean; relaxed: (local dofs,)
    in-plane displacement where pre-stress that pulls at free edges relaxed; other: (local dofs,)
    the deflection on the other side, where a buckled film has a stable state there too.
    """

    plate: Plate
    deflection: np.ndarray | None = None
    tension: float | None = None
    relaxed: np.ndarray | None = None
    other: np.ndarray | None = None


def prepared(scene: Scene, units: Units, plate: Plate) -> Film:
    """The film in its initial shape under its changed stress, before loads act. Collective."""
    state = plate.state
    if scene.plate.initial_shape is not None:
        height = initial_shape.read(scene.plate.initial_shape, plate.domain.comm)
        shape = plate.shape_of(lambda x: height(x * units.length) / units.deflection)
        state = attrs.evolve(state, shape=shape)
    if scene.load is not None and scene.load.stress is not None:
        change = scene.load.stress * scene.plate.thickness / units.tension
        x, y = state.tension
        state = attrs.evolve(state, tension=(x + change, y + change))
    return Film(plate.about(state))


def solve(scene: Scene, units: Units, plate: Plate) -> StaticState:
    """Equilibrium of the film and the plate about it. Collective.

    Raises SolverError, which says which part of the load was reached, where there is none.
    """
    film = prepared(scene, units, plate)
    plate = film.plate
    load = None if scene.load is None else load_on(film, scene.load, units)
    if load is None or scene.load is None:
        if plate.state.shape is None and not relaxes(plate):
            return StaticState(plate, tension=mean_tension(plate))  # it is one already
        loads.problem(film, None).solve(0.0)
        about = film.about()
        moved = None if plate.state.shape is None else film.deflection()
        return StaticState(about, moved, mean_tension(about), film.in_plane())
    acting, problem = load, loads.problem(film, load)

    def accept(_: StaticProblem) -> bool:
        return loads.admissible(film, acting)

    stable = False
    try:
        for point in path.load_steps(problem, [1.0], steady(film, acting, problem)):
            stable = point.stable
    except SolverError as error:
        if isinstance(error, LoadError) and 0.0 < error.reached and load.gates:
            error = pulled_in(problem, error, accept)
        raise SolverError(explained(scene.load, error)) from error
    other = None
    if not stable and not load.gates:
        other = _buckled(film, problem, functools.partial(load_on, load=scene.load, units=units))
    about = film.about(load.attraction(1.0))
    relaxed = film.in_plane() if relaxes(plate) else None
    return StaticState(about, film.deflection(), mean_tension(about), relaxed, other)


def _buckled(film: Film, problem: StaticProblem, load_on: buckled.LoadOn) -> np.ndarray | None:
    """Bring a film to its stable state on the load's side; the deflection on the other. Collective.

    Where none is found the state stays as it is: it is told to be unstable with its modes.
    """
    before = problem.free_values()
    try:
        state, other = buckled.states(film, problem, load_on)
    except SolverError:  # its modes tell that it is not stable
        problem.set_state(before, 1.0)
        return None
    if other is None:
        return None
    problem.set_state(other, 1.0)
    deflection = film.deflection()
    problem.set_state(state, 1.0)
    return deflection


def steady(film: Film, load: loads.Load, problem: StaticProblem) -> path.Accept:
    """What load steps from the current state may find. Collective.

    States that are not at a gate, and before its pull-in: Newton's method finds those beyond it
    too, which are less stable than the state where the steps begin.
    """
    most = None
    if load.gates:
        problem.factorise()
        most = problem.negative_pivots()

    def accept(_: StaticProblem) -> bool:
        if not loads.admissible(film, load):
            return False
        if most is None:
            return True
        problem.factorise()
        return problem.negative_pivots() <= most

    return accept


def pulled_in(problem: StaticProblem, error: LoadError, accept: path.Accept) -> LoadError:
    """The error of load steps, which end somewhere near, with the limit point itself. Collective.

    As it is where no limit point comes.
    """
    try:
        problem.solve(BEFORE_LIMIT * error.reached)
        step = (1 - BEFORE_LIMIT) / 2 * error.reached
        limit = path.limit_point(problem, step, most_steps=MOST_TO_LIMIT, accept=accept)
    except (SolverError, ValueError):  # no root where the path turns too sharply
        return error
    return LoadError(str(error), reached=limit.magnitude)


def load_on(film: Film, load: Load, units: Units) -> loads.Load | None:
    """A scene's load on its film, in the film's units; None if it only changes the stress."""
    parts = []
    if load.pressure is not None:
        parts.append(loads.pressure(film, load.pressure / units.pressure))
    for number, gate in enumerate(load.electrodes, 1):
        side, inside = np.sign(gate.gap), None
        strength = side * VACUUM_PERMITTIVITY * gate.voltage**2 / units.attraction
        if gate.patch is not None:
            found = f"load.gate: found number {number}"
            inside = located(film.plate, [gate.patch], units.length, found).astype(float)
        parts.append(loads.gate(film, gate.gap / units.deflection, strength, inside))
    if load.force is not None:
        centre, radius = np.array(load.position) / units.length, load.radius / units.length
        try:
            parts.append(loads.patch(film, centre, radius, load.force / units.force))
        except SolverError:
            raise SceneError(
                f"load.position: found {place_with_unit(load.position)}; allowed: a point of the "
                f"film, whose disc of load.radius = {with_unit(load.radius, 'm', 6)} lies on the "
                "film too"
            ) from None
    if load.moment is not None:
        parts.append(loads.moment(film, load.moment / units.force))
    return functools.reduce(operator.add, parts) if parts else None


def explained(load: Load, error: SolverError) -> str:
    """What the load case's failure means for the scene's load."""
    reached = error.reached if isinstance(error, LoadError) else 0.0
    if load.electrodes and (load.pressure, load.force) != (None, None):
        return (
            f"load: only {100 * reached:.4g} % of it can be applied before the gate pulls the film "
            "in; lower the load or widen the gap"
        )
    if not load.electrodes or reached == 0.0:
        return f"load: only {100 * reached:.4g} % of it can be applied: {error}"
    found = [abs(gate.voltage) for gate in load.electrodes if gate.voltage]
    at = " and ".join(f"{np.sqrt(reached) * volts:.6g}" for volts in found)
    return (
        f"load.voltage: found {' and '.join(f'{volts:g}' for volts in found)} V, but the film is "
        f"pulled in at {at} V; lower the voltage or widen the gap"
    )


def mean_tension(plate: Plate) -> float:
    """Half the trace of the membrane force, averaged over the film. Collective."""
    mesh = plate.domain.mesh
    force = ufl.tr(plate.membrane_force())
    dx = plate.dx(plate.stretching_degree)
    one = fem.Constant(mesh, 1.0)
    sums = [fem.assemble_scalar(compat.form(density * dx)) for density in (0.5 * force, one)]
    total, area = plate.domain.comm.allreduce(np.array(sums))
    return float(total / area)
