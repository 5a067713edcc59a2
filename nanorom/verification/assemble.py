"""From a scene to its discretised film: mesh, static state and named modes as for a reduction.

The film is meshed as for a model of all modes that are named, the model's and some more; then
operators, quadrature and factors are kept as plain arrays.
"""

from __future__ import annotations

import attrs
import numpy as np
import scipy.sparse as sp

from nanorom.errors import SceneError
from nanorom.fem.fields import membrane, quadrature
from nanorom.fem.models import operators
from nanorom.fem.models.operators import ClassStiffness, free_deflections
from nanorom.fem.models.plate import Plate
from nanorom.fem.output.model import modal_products
from nanorom.fem.plan import Plan
from nanorom.fem.routes.methods import lost, viscous
from nanorom.fem.routes.plate import Solution, solve
from nanorom.fem.routes.registry import check_of_plates
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.solvers.groups import alone
from nanorom.fem.statics.state import Units
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.symmetry import Parity
from nanorom.scene.geometry import Rectangle
from nanorom.scene.scene import Scene
from nanorom.scene.support import Edge, PlaneSpring, deflection_of, in_plane_of
from nanorom.types import Array
from nanorom.verification.factors import Factors
from nanorom.verification.film import DiscreteFilm, Gate, Tables
from nanorom.verification.linear import ClassDynamics, beyond, lowest, stretching

LEAST_MORE, MOST_MORE = 8, 20  # named modes beyond the model's highest: as many as it has, within
MESH_TOLERANCE = 1e-5  # of a mesh: an orbit is compared to 1e-4 at best
FIRST_BEYOND, MOST_MODES = 32, 500  # modes of a class that are computed: at first, and at most


@attrs.frozen(eq=False)
class Film:
    """A scene's film: all that its orbits need, film-scaled, and the units to and from SI.

    modal : modal matrices of named modes in SI units (`MODAL`); inside (L,): places of the model's
    modes among them; scale (N,): amplitude in m per coordinate of unit mass; pieces : operators by
    class, made when they are first asked for.
    """

    scene: Scene
    scales: Scales
    units: Units
    solution: Solution
    discrete: DiscreteFilm
    pieces: _Pieces
    modal: dict[str, Array]
    losses: dict[str, Array]
    inside: np.ndarray

    @property
    def plate(self) -> Plate:
        """The plate about its static state."""
        return self.solution.modes.plate

    @property
    def parities(self) -> list[Parity]:
        """Class of each named mode."""
        return self.solution.modes.parities

    @property
    def quality(self) -> Array:
        """Quality factor (N,) of each named mode, by the film's losses and what the scene gives.

        Outside the model the latter is that of its highest mode.
        """
        assert self.scene.damping is not None
        given = self.scene.damping.per_mode(len(self.inside))
        found = np.full(len(self.parities), given[-1])
        found[self.inside] = given
        return np.asarray(1 / (1 / found + sum(self.losses.values())))

    @property
    def time(self) -> float:
        """Seconds per unit of time."""
        return float(np.sqrt(self.scales.mass / self.scales.tension))

    @property
    def scale(self) -> Array:
        """Amplitude (N,) in m of each named mode per coordinate of unit mass."""
        mass = self.modal["mass"] / self.scales.mass / self.plate.mirrors.copies
        return np.asarray(self.units.deflection / np.sqrt(mass))

    def of_class(self, parity: Parity) -> np.ndarray:
        """Places (k,) of the named modes of a class."""
        return np.array([i for i, p in enumerate(self.parities) if p == parity], dtype=int)

    def shapes(self, parity: Parity) -> Array:
        """Named modes (free, k) of a class, of unit mass on the meshed part."""
        own = self.of_class(parity)
        shapes = self.solution.modes.shapes[self.discrete.free[parity]]
        return np.asarray(shapes[:, own] * (self.scale[own] / self.units.deflection))

    def dynamics(self, parity: Parity, highest: float) -> ClassDynamics:
        """Linear dynamics of a class, its modes known up to a frequency (film-scaled)."""
        return self.pieces.dynamics(self, parity, highest)


def assemble(scene: Scene, more: int | None = None, tolerance: float | None = None) -> Film:
    """The film of a scene, on this process alone, with ``more`` named modes than the model has.

    tolerance : of the mesh.  Raises SceneError for what is no film, SolverError as `reduce` does.
    """
    check(scene)
    highest = scene.modes.highest
    if more is None:
        more = int(np.clip(highest, LEAST_MORE, MOST_MORE))
    inside = np.array(scene.modes.numbers) - 1
    fine = scene.accuracy.tolerance
    if fine is not None:
        fine = tolerance or max(fine, MESH_TOLERANCE)
    assert scene.damping is not None
    wide = scene.with_(
        modes=highest + more,
        method="direct",
        tolerance=fine,
        damping=attrs.evolve(scene.damping, quality_factor=1.0),
    )
    plan = Plan.of(wide)
    solution = solve(alone(), plan, fine, Stopwatch(None))
    plate, units = solution.modes.plate, Units.of(wide, plan.scales.length, plan.scales.tension)
    pieces = _Pieces.of(plate)
    held = scene.reduction.in_plane == "fixed"
    discrete = _discrete(plate, pieces, held)
    modal, losses = _modal(wide, plan.scales, solution)
    return Film(scene, plan.scales, units, solution, discrete, pieces, modal, losses, inside)


def check(scene: Scene) -> None:
    """Raise SceneError unless a scene has a film whose orbits can be solved for."""
    check_of_plates(scene, "full-order orbits")
    if any(isinstance(kind, Edge) or kind == "free" for kind in scene.support.kinds):
        _check_edges(scene)
    if scene.regions:
        raise SceneError("region: found; full-order orbits are those of one film without regions")
    if scene.damping is None:
        raise SceneError("damping: missing section [damping], which a periodic orbit needs")


def _check_edges(scene: Scene) -> None:
    """Raise SceneError for supports that full-order orbits do not know."""
    kinds = scene.support.kinds
    if scene.support.free or all(deflection_of(kind) == "free" for kind in kinds):
        raise SceneError("support: full-order orbits need a film whose deflection is held")
    sliding = any(in_plane_of(kind) in ("normal", "tangential") for kind in kinds)
    if sliding and not isinstance(scene.geometry, Rectangle):
        raise SceneError(
            "support.in_plane: found normal or tangential; full-order orbits have them on the "
            "sides of a rectangle only"
        )
    if not scene.flat and any(isinstance(in_plane_of(kind), PlaneSpring) for kind in kinds):
        raise SceneError(
            "support.in_plane: found springs; full-order orbits have them in flat films only"
        )


def _modal(
    scene: Scene, scales: Scales, solution: Solution
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Matrices and tensors of the named modes, and their losses."""
    products = modal_products(solution.modes)
    found = {
        "mass": scales.mass * products.mass,
        "stiffness": scales.tension * (products.stiffness + solution.force.stretching),
        "quadratic": solution.force.quadratic,
        "cubic": solution.force.cubic,
        "slope": products.slope,
    }
    losses = lost(scene, scales, solution.modes, products, solution.force.stretching)
    return found | viscous(scene, scales, solution.modes), losses


def _discrete(plate: Plate, pieces: _Pieces, held: bool) -> DiscreteFilm:
    rule = list(quadrature.fields(plate))
    tables = Tables(
        gradients=np.concatenate([_by_component(f.gradients) for f in rule]),
        values=rule[0].values,
        weights=np.concatenate([f.weights for f in rule]),
        dofs=np.concatenate([f.dofs for f in rule]),
        in_plane=compat.cell_dofs(plate.in_plane)[: quadrature.owned_cells(plate)],
        nodes=len(plate.w.x.array),
    )
    gate, shape = plate.state.attraction, plate.state.shape
    return DiscreteFilm(
        tables=tables,
        free={p: free_deflections(plate, p).local for p in plate.mirrors.classes},
        in_plane={} if held else _InPlane(pieces),
        law=np.array(plate.stiffness.law),
        even=plate.mirrors.even,
        shape=None if shape is None else shape.x.array.copy(),
        gate=None if gate is None else Gate(float(gate.gap), float(gate.strength)),
    )


def _by_component(gradients: Array) -> Array:
    """(c, 2 q, n), d/dx of all points first, of gradients (c, q, 2, n)."""
    c, q, _, n = gradients.shape
    return np.ascontiguousarray(gradients.transpose(0, 2, 1, 3).reshape(c, 2 * q, n))


class _InPlane(dict[Parity, tuple[np.ndarray, Factors]]):
    """Free rows and factors of the in-plane stiffness, by class, factorised when asked for."""

    def __init__(self, pieces: _Pieces) -> None:
        super().__init__()
        self._pieces = pieces

    def __bool__(self) -> bool:
        return True

    def __missing__(self, parity: Parity) -> tuple[np.ndarray, Factors]:
        rows = membrane.free_dofs(self._pieces.plate, parity).local
        matrix = self._pieces.in_plane[rows][:, rows]
        self[parity] = rows, Factors(matrix, "in-plane stiffness")
        return self[parity]


@attrs.frozen(eq=False)
class _Pieces:
    """Assembled operators on all degrees of freedom."""

    plate: Plate
    mass: sp.csr_matrix
    in_plane: sp.csr_matrix
    stiffness: ClassStiffness
    _known: dict[tuple[Parity, float], ClassDynamics] = attrs.field(factory=dict)

    @classmethod
    def of(cls, plate: Plate) -> _Pieces:
        mass = operators.mass(plate)
        in_plane = algebra.assemble(plate.compiled(plate.in_plane_form))
        found = cls(plate, _csr(mass), _csr(in_plane), ClassStiffness(plate))
        mass.destroy()
        in_plane.destroy()
        return found

    def dynamics(self, film: Film, parity: Parity, highest: float) -> ClassDynamics:
        """Linear dynamics of a class; of the same film and frequency, the same object."""
        key = parity, highest
        if key not in self._known:
            self._known[key] = self._dynamics(film, parity, highest)
        return self._known[key]

    def _dynamics(self, film: Film, parity: Parity, highest: float) -> ClassDynamics:
        free = film.discrete.free[parity]
        stiffness = _csr(self.stiffness[parity])[free][:, free]
        mass = self.mass[free][:, free]
        total, extra = sp.csc_matrix(stiffness), 0
        flat = film.discrete.shape is None
        if not flat:
            rows = membrane.free_dofs(self.plate, parity).local
            held = not film.discrete.in_plane
            assert film.discrete.shape is not None
            tables, law = film.discrete.tables, film.discrete.law
            whole = stretching(tables, film.discrete.shape, law, free, rows, held)
            extra = whole.shape[0] - len(free)
            padding = sp.csc_matrix((extra, extra))
            total = whole + sp.block_diag([total, padding], format="csc")
        static = Factors(total, "film's stiffness")
        named, values, rates = _named(film, parity)
        dynamics = ClassDynamics(stiffness, mass, static, extra, named, values, rates, 0.0)
        return _completed(film, dynamics, highest, flat)


def _named(film: Film, parity: Parity) -> tuple[Array, Array, Array]:
    """Named modes (n, k) of a class, of unit mass, squared frequencies and damping rates (k,)."""
    own = film.of_class(parity)
    values = film.solution.modes.eigenvalues[own]
    return film.shapes(parity), values, np.sqrt(values) / film.quality[own]


def _completed(film: Film, dynamics: ClassDynamics, highest: float, flat: bool) -> ClassDynamics:
    """The same with modes up to a frequency, and with the damping of what is beyond."""
    count = dynamics.modes.shape[1] + FIRST_BEYOND
    stiffness = dynamics.stiffness if flat else None
    while True:
        values, modes = lowest(dynamics.mass, dynamics.flexibility, count, stiffness)
        if len(values) < count or values[-1] >= highest**2 or count >= MOST_MODES:
            break
        count *= 2
    values, modes = beyond(dynamics, values, modes)
    quality = film.quality[-1]
    together = np.concatenate([dynamics.values, values])
    return attrs.evolve(
        dynamics,
        modes=np.column_stack([dynamics.modes, modes]),
        values=together,
        rates=np.concatenate([dynamics.rates, np.sqrt(values) / quality]),
        loss=1.0 / (quality * np.sqrt(together.max())),
    )


def _csr(matrix: object) -> sp.csr_matrix:
    indices, columns, values = matrix.getValuesCSR()  # type: ignore[attr-defined]
    return sp.csr_matrix((values, columns, indices), matrix.getSize())  # type: ignore[attr-defined]
