"""What each skip of the plan saves, and that it changes nothing."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.bench.measure import timed
from nanorom.errors import AccuracyWarning
from nanorom.exact import cases as exact
from nanorom.fem import reduce, stopwatch
from nanorom.fem.mesh import discretisation
from nanorom.fem.models import build
from nanorom.fem.modes import eigen, names
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.modes.normal import normalise
from nanorom.fem.plan import Plan
from nanorom.fem.routes import plate as plates
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import Team
from nanorom.fem.statics import loads, state
from nanorom.fem.tensors import selection
from nanorom.fem.tensors.cases import amplitudes_of, load_cases
from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.loaded_cases import StaticCases
from nanorom.fem.tensors.step import coefficients
from nanorom.scene.scene import Scene

TOLERANCE = 1e-6
REPEATS = 2
AMPLITUDE = 0.5  # of a load case's modes, in the unit of the membrane stiffness
ALONE = Team(MPI.COMM_SELF, MPI.COMM_SELF)


@attrs.frozen
class Saving:
    """Processor times (s) with a skip and without, their ratio, and the largest difference.

    difference: of frequencies and tensors, relative to the largest of their kind; not a number
    where nothing is computed twice.
    """

    name: str
    skipped: float
    full: float
    ratio: float
    difference: float


class WholePlan(Plan):
    """A plan that ignores the mirrors."""

    def discretisation(self, aim: float | None) -> discretisation.Discretisation:
        """Mesh and degree for the whole film."""
        return attrs.evolve(super().discretisation(aim), whole=True)


def rows() -> Iterator[Saving]:
    """Every skip that has a full computation to be compared with."""
    drum = exact.with_tolerance(exact.paper_drum(), TOLERANCE).scene
    membrane = exact.with_tolerance(exact.drum(1e10, 4), 1e-3).scene
    auto = membrane.with_(plate=attrs.evolve(membrane.plate, model="auto"))
    few = drum.with_(modes=3)
    yield compared("mirrors: a quarter of the drum", plan(drum), plan(drum, WholePlan))
    yield opposite_cases(drum.with_(modes=4))
    yield compared("bending of a film at T R^2/D = 1e10", plan(auto), plan(membrane))
    yield compared("modes outside the band: 3 of 11", plan(few), plan(drum))
    yield compared("352 load cases: 66 pairs instead", plan(drum), plan(drum.with_(method="step")))
    yield image_cases(drum)
    yield prestress(drum)
    yield beam()


def plan(scene: Scene, kind: type[Plan] = Plan) -> Callable[[], tuple[np.ndarray, np.ndarray]]:
    """What finds frequencies (Hz) and the cubic tensor of a scene by a kind of plan."""

    def solve() -> tuple[np.ndarray, np.ndarray]:
        made = kind.of(scene)
        found = plates.solve(ALONE, made, scene.accuracy.tolerance, stopwatch.Stopwatch(None))
        result = made.scales.frequency(found.modes.eigenvalues), found.force.cubic
        compat.free_memory(MPI.COMM_SELF)
        return result

    return solve


def compared(name: str, skipped: Callable, full: Callable) -> Saving:
    """Times of both, and the difference of what they have in common."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        (one, _, short), (other, _, long) = (timed(solve, REPEATS) for solve in (skipped, full))
    common = [tuple(slice(n) for n in a.shape) for a in one]
    differences = [
        np.abs(a - b[part]).max() / np.abs(b[part]).max() for a, b, part in zip(one, other, common)
    ]
    return Saving(name, short, long, long / short, float(max(differences)))


def opposite_cases(scene: Scene) -> Saving:
    """Half of STEP's cases and the products of other parity, against all on the whole film."""
    count = len(scene.modes.numbers)

    def forces(kind: type[Plan], cases: Callable) -> Callable[[], tuple[np.ndarray]]:
        modes = modes_of(scene, kind)
        q = amplitudes_of(list(load_cases(count)), count, AMPLITUDE)
        return lambda: (cases(modes).nonlinear_force(q),)

    return compared(
        "cases solved in blocks by symmetry, four modes",
        forces(Plan, FlatCases),
        forces(WholePlan, StaticCases),
    )


def image_cases(scene: Scene) -> Saving:
    """STEP's cases without those that are mirror images of others, against all of them."""
    count = len(scene.modes.numbers)
    modes = modes_of(scene, Plan)

    def tensor(signs: list[np.ndarray]) -> tuple[np.ndarray]:
        sources = selection.solved_for(load_cases(count), signs)
        solved = [case for case, (source, _) in sources.items() if source == case]
        found = FlatCases(modes).nonlinear_force(amplitudes_of(solved, count, AMPLITUDE))
        forces = dict(zip(solved, found.T))
        every = {case: signs * forces[source] for case, (source, signs) in sources.items()}
        return (coefficients(every, count, AMPLITUDE)[1],)

    return compared(
        "352 load cases: mirror images left out",
        lambda: tensor(selection.images(modes.parities, odd=True)),
        lambda: tensor([np.ones(count, dtype=int)]),
    )


def modes_of(scene: Scene, kind: type[Plan]) -> Modes:
    """Normalised modes on the mesh of a kind of plan."""
    made, count = kind.of(scene), len(scene.modes.numbers)
    chosen = made.discretisation(TOLERANCE)
    plate = build.build_plate(MPI.COMM_SELF, scene, made.scales, chosen)
    modes, _ = names.name(scene, eigen.solve(plate, count))
    return normalise(modes.take(np.arange(count)))


def prestress(scene: Scene) -> Saving:
    """Equilibrium of a constant tension that has one already."""
    made = Plan.of(scene)
    units = state.Units.of(scene, made.scales.length, made.scales.tension)

    def solve(relaxed: bool) -> tuple[np.ndarray]:
        chosen = made.discretisation(TOLERANCE)
        plate = build.build_plate(MPI.COMM_SELF, scene, made.scales, chosen)
        if relaxed:
            film = state.prepared(scene, units, plate)
            loads.problem(film, None).solve(0.0)
            plate = film.about()
        return (eigen.solve(plate, 11).eigenvalues,)

    return compared("pre-stress that is in equilibrium", lambda: solve(False), lambda: solve(True))


def beam() -> Saving:
    """A string as a beam, where nothing depends on y, against the plate strip."""
    case = exact.string()
    thin, strip = (
        exact.with_tolerance(exact.string(model=model), TOLERANCE).scene
        for model in ("beam", "plate")
    )

    def solve(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
        model = reduce.reduce_scene(scene, comm=MPI.COMM_SELF)
        return model.frequency, exact.with_signs_of(model.cubic, case.cubic())

    return compared("a string as a beam", lambda: solve(thin), lambda: solve(strip))
