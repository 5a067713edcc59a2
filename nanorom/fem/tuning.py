"""Deflection and frequencies against a static load, by continuation from state to state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError, SolverError
from nanorom.fem.fields import places
from nanorom.fem.models.build import build_plate
from nanorom.fem.modes import coupled, names
from nanorom.fem.modes.eigen import UnstableError
from nanorom.fem.plan import Plan
from nanorom.fem.routes.hardening import effective_cubic
from nanorom.fem.routes.registry import check_of_plates
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.statics import loads, state
from nanorom.fem.statics import path as loadpath
from nanorom.fem.statics.chords import chord_errors
from nanorom.fem.statics.path import PathPoint
from nanorom.fem.statics.problem import StaticProblem
from nanorom.fem.symmetry import is_symmetric
from nanorom.results.loadcurve import UNITS, LoadCurve
from nanorom.scene import fields as v
from nanorom.scene.load import VACUUM_PERMITTIVITY, Load
from nanorom.scene.scene import Scene
from nanorom.types import Progress

POINTS = 20
Row = tuple[float, float, float, np.ndarray, float, np.ndarray]
MOST_DETOUR = 20  # steps of a path per point asked for


def tune(
    scene: Scene,
    quantity: str,
    values: Sequence[float],
    comm: MPI.Comm = MPI.COMM_WORLD,
    hardening: bool = False,
) -> LoadCurve:
    """States and frequencies of a scene whose [load] takes one value after the other. Collective.

    quantity : "voltage", "pressure" or "force", a key of the scene's [load]; values : rising, in
    SI.  The other loads of the scene rise with it, all gates in proportion.  One mesh serves all
    states: that of the scene's tolerance.  hardening : with cubic coefficients.  Raises SceneError,
    or SolverError that says what load was reached.
    """
    load = scene.load
    if load is None or quantity not in UNITS or load.level(quantity) is None:
        raise SceneError(f"load.{quantity}: missing; it is what the frequencies are tuned by")
    if len(values) == 0 or values[-1] == 0.0 or np.any(np.diff(np.abs(values)) <= 0):
        raise SceneError(
            f"at: found {', '.join(f'{value:g}' for value in values)} {UNITS[quantity]}; allowed: "
            "values that rise, the last one not 0"
        )
    film = LoadedFilm(scene, load.risen(quantity, float(values[-1])), quantity, comm, hardening)
    shares = np.array(values) / values[-1]
    if quantity == "voltage":
        shares = shares**2  # the force goes with the square
    accept = state.steady(film.film, film.unit, film.problem)
    points = loadpath.load_steps(film.problem, [float(s) for s in shares], accept)
    try:
        rows = [film.row(point) for point in points]
    except SolverError as error:
        raise SolverError(state.explained(film.load, error)) from error
    return film.curve(rows)


def follow(
    scene: Scene,
    points: int = POINTS,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> LoadCurve:
    """The path from no load to a scene's [load], through limit points. Collective.

    ``points`` is about how many states there are; what the path does not take of them goes where
    the curves bend most.  A path under a gate ends where it is pulled in;
    another one goes on, unstable states included, up to the whole load.  Raises SceneError, or
    SolverError that says what load was reached.
    """
    load, quantity = grown(scene)
    film = LoadedFilm(scene, load, quantity, comm)
    # the first steps are small, for films that are soft at first; the longest is a share
    path = loadpath.Path(film.problem, points**-2.0, film.accept, longest=points)
    states = [PathPoint(0.0, film.problem.free_values(), 0)]
    rows = [film.row(states[0])]
    try:
        for point in path.towards(1.0, MOST_DETOUR * points):
            if progress is not None:
                progress("load path", min(len(rows), points), points)
            film.problem.set_state(point.values, point.magnitude)
            states.append(point)
            rows.append(film.row(point))
            if point.limit and film.quantity == "voltage":
                break
    except SolverError as error:
        raise SolverError(f"load.{film.quantity}: {error}") from error
    _fill(film, path, states, rows, points)
    return film.curve(rows, [state.magnitude for state in states if state.limit])


def _fill(
    film: LoadedFilm, path: loadpath.Path, states: list[PathPoint], rows: list[Row], points: int
) -> None:
    """Add states where straight lines between the rows leave the curves most. Collective."""
    while len(rows) < points:
        load, _, largest, frequency, *_ = map(np.array, zip(*rows))
        for i in (i for i, point in enumerate(states) if point.limit):
            near = frequency[max(i - 1, 0) : i + 2]
            if np.isfinite(near).any():  # at a limit point the softest mode there has no stiffness
                frequency[i, np.nanargmin(near) % near.shape[1]] = 0.0
        off = chord_errors(load, np.column_stack([largest, frequency]))
        at = int(film.comm.bcast(off.argmax()))
        between = path.between(states[at], states[at + 1])
        if between is None:
            return
        states.insert(at + 1, between)
        rows.insert(at + 1, film.row(between))


def grown(scene: Scene) -> tuple[Load, str]:
    """The load of a scene and the key by which it grows; raises SceneError if there is none."""
    load = scene.load
    asked = [] if load is None else [q for q in UNITS if load.level(q)]
    if load is None or not asked:
        raise SceneError(f"load: a curve needs one; allowed: {', '.join(UNITS)}, not 0")
    return load, asked[0]


def tune_at(scene: Scene, values: Any, comm: MPI.Comm = MPI.COMM_WORLD) -> LoadCurve:
    """`tune` of the key by which a scene's load grows, at quantities or SI numbers. Collective."""
    _, quantity = grown(scene)
    loads = v.read_quantities(values, UNITS[quantity], "at")
    return tune(scene, quantity, loads, comm, hardening=True)


class LoadedFilm:
    """The static problem of a scene under growing shares of a load. Collective."""

    def __init__(
        self, scene: Scene, load: Load, quantity: str, comm: MPI.Comm, hardening: bool = True
    ) -> None:
        check_of_plates(scene, "a curve")
        self.scene, self.load, self.quantity, self.comm = scene, load, quantity, comm
        self.hardening = hardening
        plan = Plan.of(scene)
        self.scales = plan.scales
        chosen = plan.discretisation(scene.accuracy.tolerance)
        chosen = attrs.evolve(chosen, whole=not is_symmetric(scene))
        self.units = state.Units.of(scene, self.scales.length, self.scales.tension)
        self.film = state.prepared(scene, self.units, build_plate(comm, scene, self.scales, chosen))
        self.plate = self.film.plate
        found = state.load_on(self.film, load, self.units)
        assert found is not None  # it has the quantity
        self.unit = found
        self.problem = loads.problem(self.film, found)
        self.problem.solve(0.0)  # the pre-stress may relax
        self.lumped = self._lumped_pull_in()
        self.label: list[str] | None = None  # of the modes, found with the first of them

    def accept(self, _: StaticProblem) -> bool:
        """No part of the film is at the gate."""
        return loads.admissible(self.film, self.unit)

    def row(self, point: PathPoint) -> Row:
        """Load in SI, deflections in m, frequencies in Hz, mean tension in N/m and cubic
        coefficients in N/m^3 of the problem's current state.
        """
        w, count = self.film.deflection(), self.scene.modes.highest
        centre = places.centre_value(self.plate, w)
        largest = max(self.comm.allgather(w[np.abs(w).argmax()]), key=abs)
        frequency, cubic = np.full((2, count), np.nan)
        about = self.film.about(self.unit.attraction(point.magnitude))
        tension = state.mean_tension(about)
        if point.stable and not point.limit:
            try:
                frequency, cubic = self._modal(coupled.solve(about, count), tension)
            except UnstableError:  # at a limit point, to rounding
                pass
        share = np.sqrt(point.magnitude) if self.quantity == "voltage" else point.magnitude
        deflection = self.units.deflection
        return (
            float(share * (self.load.level(self.quantity) or 0.0)) + 0.0,  # no -0
            np.nan if centre is None else deflection * centre,
            deflection * largest,
            frequency,
            self.scales.tension * tension,
            cubic,
        )

    def _modal(self, modes: Any, tension: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies and cubic coefficients (L,) of modes, in the order of their first names.

        Where other modes have come among the lowest, that of their frequencies.
        """
        count = self.scene.modes.highest
        modes, told = names.name(self.scene, modes)
        told = told[:count]
        frequency = self.scales.frequency(modes.eigenvalues[:count])
        cubic = np.full(count, np.nan)
        if self.hardening:
            cubic = effective_cubic(self.scene, self.scales, self.units, modes, told, tension)
        self.label = self.label or told
        if sorted(told) != sorted(self.label):
            return frequency, cubic
        order = [told.index(name) for name in self.label]
        return frequency[order], cubic[order]

    def curve(self, rows: Sequence[tuple[Any, ...]], limits: Sequence[float] = ()) -> LoadCurve:
        """The curve of some rows and of the limit points on their path."""
        load, centre, largest, frequency, tension, cubic = zip(*rows)
        shares = np.sqrt(limits) if self.quantity == "voltage" else np.array(limits)
        turned = shares * (self.load.level(self.quantity) or 0.0)
        return LoadCurve(
            self.quantity,
            load,
            centre,
            largest,
            frequency,
            turned,
            self.lumped,
            self.label,
            tension,
            cubic if self.hardening else None,
        )

    def _lumped_pull_in(self) -> float | None:
        """Pull-in voltage of a rigid plate on a spring of the film's mean stiffness."""
        if (
            self.quantity != "voltage"
            or self.load.gap is None
            or self.plate.state.shape is not None
        ):
            return None
        uniform = loads.problem(self.film, loads.pressure(self.film))
        uniform.factorise()
        pressure = uniform.load()
        work = pressure @ uniform.back_substitute(pressure)  # int w dA under unit pressure
        one = compat.form(loads.pressure(self.film).form)
        area = float(algebra.assemble_vector(one)[2::3].sum())
        work, area = self.comm.allreduce(np.array([work, area]))
        stiffness = area / work * self.units.pressure / self.units.deflection  # Pa/m
        return float(np.sqrt(8 * stiffness * self.load.gap**3 / (27 * VACUUM_PERMITTIVITY)))
