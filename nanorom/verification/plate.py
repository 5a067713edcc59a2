"""A plate or membrane on its mesh: static state and named modes as for a reduction.

It is meshed as for a model of all modes that are named, the model's and some more; then operators,
quadrature and factors are kept as plain arrays.
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
from nanorom.fem.modes import bending
from nanorom.fem.output import losses
from nanorom.fem.output.model import modal_products
from nanorom.fem.plan import Plan
from nanorom.fem.routes.methods import motion_of, viscous
from nanorom.fem.routes.plate import Solution, solve
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.solvers.groups import alone
from nanorom.fem.statics.state import Units as StaticUnits
from nanorom.fem.stopwatch import Stopwatch
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors import squeeze
from nanorom.scene.geometry import Rectangle
from nanorom.scene.scene import Scene
from nanorom.scene.support import Edge, PlaneSpring, deflection_of, in_plane_of
from nanorom.types import Array
from nanorom.verification.assembled import Film, Units
from nanorom.verification.factors import Factors
from nanorom.verification.film import DiscreteFilm, Gate
from nanorom.verification.linear import ClassDynamics, completed
from nanorom.verification.plate_gas import FilmGas
from nanorom.verification.plate_work import PlateWork
from nanorom.verification.tables import Laws, Tables, stretching

MESH_TOLERANCE = 1e-5  # of a mesh: an orbit is compared to 1e-4 at best


@attrs.frozen(eq=False)
class PlateFilm(Film):
    """A plate or membrane on its mesh; pieces : operators by class, made when they are asked for;
    gas : in a gap below it, None without one.

    discrete is the film's force on the mesh, which `film.DiscreteFilm` is.
    """

    discrete: DiscreteFilm
    scales: Scales
    solution: Solution
    pieces: _Pieces
    gas: FilmGas | None = None

    @property
    def plate(self) -> Plate:
        """The plate about its static state."""
        return self.solution.modes.plate

    def shapes(self, parity: Parity) -> Array:
        """Named modes (free, k) of a class, of unit mass on the meshed part."""
        own = self.of_class(parity)
        shapes = self.solution.modes.shapes[self.discrete.free[parity]]
        return np.asarray(shapes[:, own] * (self.scale[own] / self.units.deflection))

    def mass(self, parity: Parity) -> sp.csr_matrix:
        """Matrix (free, free) of a class."""
        free = self.discrete.free[parity]
        return self.pieces.mass[free][:, free]

    def dynamics(self, parity: Parity, highest: float) -> ClassDynamics:
        """Linear dynamics of a class, its modes known up to a frequency (film-scaled)."""
        return self.pieces.dynamics(self, parity, highest)

    @property
    def work(self) -> PlateWork:
        """Of simple forces on all basis functions of the meshed part."""
        return PlateWork(self)


def assemble(scene: Scene, more: int, tolerance: float | None = None) -> PlateFilm:
    """The film of a scene, on this process alone, with ``more`` named modes than the model has.

    It is meshed as for a model of all modes that are named; tolerance : of the mesh.  Raises
    SolverError as `reduce` does.
    """
    highest = scene.modes.highest
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
    scales = plan.scales
    solution = solve(alone(), plan, fine, Stopwatch(None))
    modes = solution.modes
    pieces = _Pieces.of(modes.plate)
    held = scene.reduction.in_plane == "fixed"
    modal, losses = _modal(wide, scales, solution)
    gas = None
    if scene.gas is not None and scene.gas.gap is not None:
        gas = FilmGas.of(modes.plate, scene.gas, scales)
    return PlateFilm(
        scene=scene,
        units=Units(
            time=float(np.sqrt(scales.mass / scales.tension)),
            deflection=StaticUnits.of(wide, scales.length, scales.tension).deflection,
            stiffness=scales.tension,
        ),
        discrete=_discrete(modes.plate, pieces, held),
        names=solution.names,
        parities=modes.parities,
        values=modes.eigenvalues,
        modal=modal,
        losses=losses,
        inside=inside,
        classes=modes.plate.mirrors.classes,
        copies=modes.plate.mirrors.copies,
        scales=scales,
        solution=solution,
        pieces=pieces,
        gas=gas,
    )


def check(scene: Scene) -> None:
    """Raise SceneError for supports that full-order orbits of a plate do not know."""
    if any(isinstance(kind, Edge) or kind == "free" for kind in scene.support.kinds):
        _check_edges(scene)


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
    gas = None
    if scene.gas is not None and scene.gas.gap is not None:
        given = found["mass"], np.diag(found["stiffness"])
        gas = squeeze.one_by_one(solution.modes, scene.gas, scales.length, *given)
        time = np.sqrt(scales.mass / scales.tension)
        rates = 2 * np.pi * gas.frequency * time
        found["stiffness"] = found["stiffness"] + np.diag(gas.stiffness.real)
        found["squeezed"] = np.diag(gas.stiffness.imag / rates)
    motion = motion_of(scene, scales, solution.modes, products, solution.force.stretching, gas)
    lost = losses.losses(scene, motion)
    lost.pop("squeeze", None)  # depends on the frequency: the film's own is no rate of a mode
    return found | viscous(scene, scales, solution.modes), lost


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
        laws=_laws(plate),
        even=plate.mirrors.even,
        shape=None if shape is None else shape.x.array.copy(),
        gate=None if gate is None else Gate(gate.gates[0].gap, gate.gates[0].strength),
    )


def _laws(plate: Plate) -> Laws:
    """By the sections of a patchwork, of which the first is the film itself."""
    cells = quadrature.owned_cells(plate)
    if plate.patchwork is None:
        return Laws(np.array([plate.stiffness.law]), np.zeros(cells, dtype=int))
    return Laws(plate.patchwork.law, plate.patchwork.which[:cells])


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
        found = cls(plate, algebra.as_csr(mass), algebra.as_csr(in_plane), ClassStiffness(plate))
        mass.destroy()
        in_plane.destroy()
        return found

    def dynamics(self, film: PlateFilm, parity: Parity, highest: float) -> ClassDynamics:
        """Linear dynamics of a class; of the same film and frequency, the same object."""
        key = parity, highest
        if key not in self._known:
            self._known[key] = self._dynamics(film, parity, highest)
        return self._known[key]

    def of_deflections(self, parity: Parity, free: np.ndarray) -> sp.csr_matrix:
        """Stiffness (free, free) of tension and bending of a class."""
        return algebra.as_csr(self.stiffness[parity])[free][:, free]

    def _dynamics(self, film: PlateFilm, parity: Parity, highest: float) -> ClassDynamics:
        free = film.discrete.free[parity]
        stiffness = self.of_deflections(parity, free)
        mass = self.mass[free][:, free]
        total, extra = sp.csc_matrix(stiffness), 0
        flat = film.discrete.shape is None
        if not flat:
            rows = membrane.free_dofs(self.plate, parity).local
            held = not film.discrete.in_plane
            assert film.discrete.shape is not None
            tables, laws = film.discrete.tables, film.discrete.laws
            whole = stretching(tables, film.discrete.shape, laws, free, rows, held)
            extra = whole.shape[0] - len(free)
            padding = sp.csc_matrix((extra, extra))
            total = whole + sp.block_diag([total, padding], format="csc")
        static = Factors(total, "film's stiffness")
        own = film.of_class(parity)
        known = film.shapes(parity), film.values[own], film.rates[own]
        viscous = self._viscous(film, parity)
        gas = None if film.gas is None else film.gas.of_class(parity, free)
        dynamics = ClassDynamics(stiffness, mass, static, extra, *known, 0.0, viscous, gas)
        return completed(dynamics, film.quality[-1], highest, stiffness if flat else None)

    def _viscous(self, film: PlateFilm, parity: Parity) -> sp.csr_matrix | None:
        """What a viscoelastic material adds to the damping: its time times the bending."""
        assert film.scene.damping is not None
        time = film.scene.damping.material_time / film.units.time
        if time == 0 or not self.plate.bending:
            return None
        free = film.discrete.free[parity]
        bent = algebra.as_csr(ClassStiffness(bending.alone(self.plate))[parity])
        return time * bent[free][:, free]
