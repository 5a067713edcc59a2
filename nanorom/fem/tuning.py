"""Frequencies against a static load, by continuation from state to state."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError, SolverError
from nanorom.fem import film as films
from nanorom.fem import loaded, state, statics
from nanorom.fem.build import build_plate
from nanorom.fem.plan import Plan
from nanorom.fem.symmetry import is_symmetric
from nanorom.loadcurve import UNITS, LoadCurve
from nanorom.scene import Scene


def tune(
    scene: Scene, quantity: str, values: Sequence[float], comm: MPI.Comm = MPI.COMM_WORLD
) -> LoadCurve:
    """States and frequencies of a scene whose [load] takes one value after the other. Collective.

    quantity : "pressure", "voltage" or "force", a key of the scene's [load]; values : rising, in
    SI.  The other loads of the scene rise with it.  One mesh serves all states: that of the
    scene's tolerance.  Raises SceneError, or SolverError that says what load was reached.
    """
    load = scene.load
    if load is None or quantity not in UNITS or getattr(load, quantity) is None:
        raise SceneError(f"load.{quantity}: missing; it is what the frequencies are tuned by")
    last = float(values[-1])
    if len(values) == 0 or last == 0.0 or np.any(np.diff(np.abs(values)) <= 0):
        raise SceneError(f"load.{quantity}: the values of the curve are not rising")
    load = attrs.evolve(load, **{quantity: last})
    shares = np.array(values) / last
    if quantity == "voltage":
        shares = shares**2  # the force goes with the square
    plan = Plan.of(scene)
    scales = plan.scales
    chosen = plan.discretisation(scene.accuracy.tolerance)
    chosen = attrs.evolve(chosen, whole=not is_symmetric(scene))
    plate = build_plate(comm, scene, scales, chosen)
    units = state.Units.of(scene, scales.length, scales.tension)
    film = state.prepared(scene, units, plate)
    found = state.load_on(film, load, units)
    assert found is not None  # it has the quantity
    unit_load = found
    problem = films.problem(film, unit_load)
    count = scene.modes.highest
    rows = []
    try:
        for point in statics.load_steps(
            problem, [float(s) for s in shares], lambda _: films.admissible(film, unit_load)
        ):
            w = film.deflection()
            centre = films.centre_value(plate, w)
            modes = loaded.solve(film.about(unit_load, point.magnitude), count)
            largest = comm.allgather(w[np.abs(w).argmax()])
            rows.append(
                (
                    np.nan if centre is None else units.deflection * centre,
                    units.deflection * max(largest, key=abs),
                    scales.frequency(modes.eigenvalues[:count]),
                )
            )
    except SolverError as error:
        raise SolverError(state.explained(load, error)) from error
    centres, largest, frequency = zip(*rows)
    return LoadCurve(quantity, values, centres, largest, frequency)
