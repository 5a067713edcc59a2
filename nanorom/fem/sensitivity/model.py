"""Derivatives of a reduced model's arrays by the numbers of its scene.

Every array depends on the scene through few quantities: T_x, T_y, D, Poisson's ratio, E h, rho h
and the length, of which the last three scale the arrays; the chain from the scene to them is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.output import patterns
from nanorom.fem.output.model import ModalProducts, modal_products, pattern_integrals
from nanorom.fem.plan import Plan
from nanorom.fem.routes.plate import Solution, solve
from nanorom.fem.routes.registry import check_of_plates
from nanorom.fem.routes.tolerance import Refinement, solved_to_tolerance
from nanorom.fem.scales import acting_tension
from nanorom.fem.sensitivity import shapes, tensors
from nanorom.fem.sensitivity.shapes import BENDING, POISSON, TENSION_X, TENSION_Y
from nanorom.fem.solvers.groups import split
from nanorom.fem.statics.state import Units
from nanorom.fem.stopwatch import Stopwatch
from nanorom.rom.patterns import reduced
from nanorom.scene.geometry import Disc, MeshFile
from nanorom.scene.scene import Scene
from nanorom.scene.support import Edge, in_plane_of
from nanorom.scene.units import with_unit
from nanorom.types import Progress

STRETCHING, MASS, LENGTH = "stretching", "mass", "length"  # E h, rho h, L
LENGTHENED = 1e-3  # step of ln L: differences of an explicit function, of fourth order
REFINEMENT = Refinement(most=5, finer=0.3, told="estimated error")


@attrs.frozen(eq=False, kw_only=True)
class Arrays:
    """Arrays of a model in SI, or what they change by.

    frequency, mass: (L,) Hz, kg; stiffness: (L, L) N/m; cubic: (L, L, L, L) N/m^3; drive: (L,) by
    name; parametric: (L, L) by name.
    """

    frequency: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray
    cubic: np.ndarray
    drive: dict[str, np.ndarray]
    parametric: dict[str, np.ndarray]

    def combined(self, join: Callable[..., np.ndarray], *others: Arrays) -> Arrays:
        """What a function makes of every array and its namesakes."""
        return Arrays(
            frequency=join(self.frequency, *(o.frequency for o in others)),
            mass=join(self.mass, *(o.mass for o in others)),
            stiffness=join(self.stiffness, *(o.stiffness for o in others)),
            cubic=join(self.cubic, *(o.cubic for o in others)),
            drive={n: join(a, *(o.drive[n] for o in others)) for n, a in self.drive.items()},
            parametric={
                n: join(a, *(o.parametric[n] for o in others)) for n, a in self.parametric.items()
            },
        )


@attrs.frozen(eq=False)
class ModelSlopes:
    """Arrays of a flat film's model and their derivatives by logarithms of scene numbers.

    slope: by key of the scene; label: L names; number: L positions among all modes.
    """

    value: Arrays
    slope: dict[str, Arrays]
    label: tuple[str, ...]
    number: tuple[int, ...]


def scene_keys(scene: Scene) -> dict[str, dict[str, float]]:
    """By key of a scene, what it changes: d ln(quantity) / d ln(key), or d nu / d ln(key)."""
    material, nu = scene.material, scene.material.poisson_ratio
    found: dict[str, dict[str, float]] = {
        "plate.thickness": {BENDING: 3.0, STRETCHING: 1.0, MASS: 1.0},
        "material.density": {MASS: 1.0},
    }
    if not material.crystalline:  # whose other moduli stay
        found["material.youngs_modulus"] = {BENDING: 1.0, STRETCHING: 1.0}
        found["material.poisson_ratio"] = {POISSON: nu, BENDING: 2 * nu**2 / (1 - nu**2)}
    if material.bending is not None:  # it is none of the others'
        for shares in found.values():
            shares.pop(BENDING, None)
        found["material.bending"] = {BENDING: 1.0}
    pulls = {"x": (TENSION_X, scene.tension.x), "y": (TENSION_Y, scene.tension.y)}
    acting = {axis: {name: 1.0} for axis, (name, tension) in pulls.items() if tension}
    if acting:
        found["tension"] = {name: 1.0 for own in acting.values() for name in own}
        found |= {f"tension.{axis}": own for axis, own in acting.items()}
    if isinstance(scene.geometry, Disc):
        found["geometry.radius"] = {LENGTH: 1.0, BENDING: -2.0}
    return found


def check(scene: Scene) -> None:
    """Raise SceneError for films that are not flat plates on rigid supports."""
    check_of_plates(scene, "a scene whose derivatives are asked for")
    if not scene.flat:
        raise SceneError("load, plate.initial_shape: derivatives are those of a flat film")
    if scene.masses or scene.regions or scene.gas is not None:
        raise SceneError("mass, region, gas: found; allowed with derivatives: none of them")
    if scene.support.springs or any(isinstance(kind, Edge) for kind in scene.support.kinds):
        raise SceneError("support: derivatives are those on rigid supports; found springs or Edge")
    if scene.tension.variation is not None:
        raise SceneError("tension.variation: found; allowed with derivatives: none")
    if any(scene.tension.principal) and _may_relax(scene):
        raise SceneError(
            "tension: found where it relaxes at an edge that is free in the plane; derivatives are "
            "those of a tension that stays"
        )
    if scene.tension.xy:
        shear = with_unit(scene.tension.xy, "N/m", 6)
        raise SceneError(f"tension.xy: found {shear}; allowed with derivatives: 0")


def _may_relax(scene: Scene) -> bool:
    """Whether the tension may not be what acts, as far as the scene tells without a mesh."""
    if isinstance(scene.geometry, MeshFile):
        return any(in_plane_of(kind) != "fixed" for kind in scene.support.kinds)
    return acting_tension(scene) is None


def model_slopes(
    scene: Scene,
    by: Sequence[str] | None = None,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> ModelSlopes:
    """Arrays of a scene's model and their derivatives by keys of it, all if left out. Collective.

    Raises SceneError for a film or a key that has none, MeshError, SolverError.
    """
    check(scene)
    keys = scene_keys(scene)
    for key in by or ():
        if key not in keys:
            raise SceneError(f"by: found {key!r}; allowed: {', '.join(keys)}")
    plan, watch, team = Plan.of(scene), Stopwatch(progress), split(comm, 1)

    def attempt(aim: float | None) -> Solution:
        return solve(team, plan, aim, watch)

    def discard(last: Solution) -> None:
        last.discard(team)

    solution = solved_to_tolerance(scene, attempt, REFINEMENT, discard, Solution.has_mesh_of)
    with watch.stage("derivatives"):
        value, quantities = _by_quantities(plan, solution)
    chosen = keys if by is None else {key: keys[key] for key in by}
    nothing = value.combined(np.zeros_like)
    slope = {}
    for key, shares in chosen.items():
        slope[key] = nothing
        for name in shares.keys() & quantities.keys():
            slope[key] = slope[key].combined(_plus(shares[name]), quantities[name])
    return ModelSlopes(value, slope, tuple(solution.names), tuple(scene.modes.numbers))


def _plus(share: float) -> Callable[..., np.ndarray]:
    return lambda first, second: first + share * second


def _by_quantities(plan: Plan, solution: Solution) -> tuple[Arrays, dict[str, Arrays]]:
    """The arrays and their derivatives by the quantities. Collective."""
    modes, scales, scene = solution.modes, plan.scales, plan.scene
    found = shapes.slopes(modes)
    by_shapes, by_nu = tensors.slopes(modes, found.shapes, scene.reduction.in_plane)
    products = modal_products(modes)
    drive, parametric = _patterns(plan, modes, products)
    value = Arrays(
        frequency=scales.frequency(modes.eigenvalues),
        mass=scales.mass * products.mass,
        stiffness=scales.tension * products.stiffness,
        cubic=solution.force.cubic,
        drive=drive,
        parametric=parametric,
    )
    permitted = np.asarray(solution.force.cubic != 0)
    result: dict[str, Arrays] = {}
    for name, moved in found.shapes.items():
        with_mass = found.moved_products(modes, name)
        with_stiffness = with_mass * modes.eigenvalues  # K phi = lambda M phi
        high, low = (_patterns(plan, _moved(modes, s * moved), products) for s in (1, -1))
        result[name] = Arrays(
            frequency=0.5 * value.frequency * found.eigenvalues[name] / modes.eigenvalues,
            mass=2 * scales.mass * with_mass.diagonal(),
            stiffness=scales.tension * (found.stiffness[name] + with_stiffness + with_stiffness.T),
            cubic=scales.cubic * permitted * (by_shapes[name] + by_nu * (name == POISSON)),
            # linear and bilinear in the shapes: exact
            drive={n: 0.5 * (a - low[0][n]) for n, a in high[0].items()},
            parametric={n: 0.5 * (a - low[1][n]) for n, a in high[1].items()},
        )
    if POISSON not in result:  # a membrane: its shapes do not depend on it
        zero = value.combined(np.zeros_like)
        result[POISSON] = attrs.evolve(zero, cubic=scales.cubic * permitted * by_nu)
    twice = _patterns(plan, modes, products, heavier=2.0)
    # linear in the mass: exact
    heavier = _minus(twice[0], drive), _minus(twice[1], parametric)
    return value, result | _scaling(value, _lengthened(plan, modes, products), heavier)


def _minus(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: array - second[name] for name, array in first.items()}


Patterns = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]  # direct (L,), parametric (L, L)


def _scaling(value: Arrays, lengthened: Patterns, heavier: Patterns) -> dict[str, Arrays]:
    """Derivatives by ln E h, ln rho h and ln L, with which the arrays go by powers.

    lengthened, heavier : those by ln L and by ln rho h of the patterns.
    """
    nothing = value.combined(np.zeros_like)
    return {
        STRETCHING: attrs.evolve(nothing, cubic=value.cubic),
        MASS: attrs.evolve(
            nothing,
            frequency=-0.5 * value.frequency,
            mass=value.mass,
            drive=heavier[0],
            parametric=heavier[1],
        ),
        LENGTH: attrs.evolve(
            nothing,
            frequency=-value.frequency,
            mass=2 * value.mass,
            cubic=-2 * value.cubic,
            drive=lengthened[0],
            parametric=lengthened[1],
        ),
    }


def _lengthened(plan: Plan, modes: Modes, products: ModalProducts) -> Patterns:
    """Derivatives of the patterns by ln L at shapes that grow with the film. Collective.

    The places of aimed ones do not: differences of fourth order of an explicit function.
    """

    def difference(step: float) -> Patterns:
        high, low = (_patterns(plan, modes, products, float(np.exp(s * step))) for s in (1, -1))
        direct, parametric = (
            {name: (array - b[name]) / (2 * step) for name, array in a.items()}
            for a, b in zip(high, low)
        )
        return direct, parametric

    near, far = difference(LENGTHENED), difference(2 * LENGTHENED)
    direct, parametric = (
        {name: (4 * array - b[name]) / 3 for name, array in a.items()} for a, b in zip(near, far)
    )
    return direct, parametric


def _moved(modes: Modes, change: np.ndarray) -> Modes:
    return attrs.evolve(modes, shapes=modes.shapes + change)


def _patterns(
    plan: Plan, modes: Modes, products: ModalProducts, longer: float = 1.0, heavier: float = 1.0
) -> Patterns:
    """Patterns of shapes, in SI, on a film longer by a factor, or heavier by one. Collective."""
    area, slope = pattern_integrals(modes)
    own = attrs.evolve(products, momentum=modes.momentum(), area=area, slope=slope)
    scales = plan.scales
    units = Units.of(plan.scene, scales.length, scales.tension)
    mass = heavier * longer**2 * scales.mass
    work = patterns.PolynomialWork(modes, own, longer * scales.length, units.deflection, mass)
    return reduced(work, plan.scene.drive)
