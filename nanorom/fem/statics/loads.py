"""Static loads of a film: pressure, force on a patch, moment, gates."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from nanorom.fem.fields import discs
from nanorom.fem.fields.places import functional
from nanorom.fem.models.coupled import Film
from nanorom.fem.models.gate import Attraction, Gate
from nanorom.fem.models.operators import ClassStiffness, LinearForce
from nanorom.fem.solvers import compat
from nanorom.fem.statics.problem import StaticProblem
from nanorom.fem.symmetry import line


@attrs.frozen(eq=False)
class Load:
    """A static load per unit magnitude.

    form : linear form, or None; nodal : (local dofs of the film,) or None; gates : that attract the
    film, and that it may not reach.
    """

    form: Any = None
    nodal: np.ndarray | None = None
    gates: tuple[Gate, ...] = ()

    def __add__(self, other: Load) -> Load:
        """Both loads together."""
        form, nodal = _sum(self.form, other.form), _sum(self.nodal, other.nodal)
        return Load(form, nodal, self.gates + other.gates)

    def attraction(self, magnitude: float) -> Attraction | None:
        """What attracts the film at a magnitude of the load; None without a gate."""
        return Attraction(self.gates).scaled(magnitude) if self.gates else None


def _sum(a: Any, b: Any) -> Any:
    return b if a is None else a if b is None else a + b


def pressure(film: Film, value: float = 1.0) -> Load:
    """Uniform dead pressure towards positive w."""
    test = ufl.TestFunction(film.space)
    value = fem.Constant(film.plate.domain.mesh, value)
    return Load(form=value * test[2] * film.plate.dx(2 * film.plate.degree))


def gate(film: Film, gap: float, strength: float = 1.0, inside: np.ndarray | None = None) -> Load:
    """Parallel-plate electrostatic pressure strength/2 / (gap - w)^2, strength eps0 V^2.

    The gate lies at ``gap`` above the film's plane, below it if both numbers are negative, in all
    of it or, inside (local cells,), where that is 1; edge effects are neglected.
    """
    w = ufl.variable(film.w)
    height = w if film.plate.state.shape is None else w + film.plate.state.shape
    made = Gate(gap, strength, inside)
    attraction = Attraction((made,)).on(film.plate.domain.mesh)
    form = ufl.diff(attraction.potential(height), w) * ufl.TestFunction(film.space)[2]
    return Load(form * film.plate.dx(film.plate.stretching_degree), None, (made,))


def moment(film: Film, value: float = 1.0) -> Load:
    """Moment per length of a stress in the film, the same everywhere and in every direction.

    Its work m int lap w is that of m on the slopes of the edges that may turn.  Collective.
    """
    plate = film.plate
    mesh, mirrors = plate.domain.mesh, [line(axis) for axis in plate.mirrors.axes]
    still = np.union1d(plate.clamped, plate.domain.facets_of(mirrors))
    turning = np.setdiff1d(compat.exterior_facets(mesh), still).astype(np.int32)
    edge, *_ = compat.facet_measures(mesh, [turning], {"quadrature_degree": 2 * plate.degree}, [])
    slope = ufl.dot(ufl.grad(ufl.TestFunction(plate.deflections)), ufl.FacetNormal(mesh))
    work = fem.Function(plate.deflections)
    fem.assemble_vector(work.x.array, compat.form(fem.Constant(mesh, float(value)) * slope * edge))
    compat.scatter_reverse_add(work)
    work.x.scatter_forward()
    return Load(nodal=film.deflections_to_state(work.x.array))


def patch(film: Film, centre: np.ndarray, radius: float, force: float = 1.0) -> Load:
    """A force spread evenly over a disc; a point force if its radius is 0. Collective.

    The disc is integrated cell by cell where no cell is cut by its rim, else on its own polar Gauss
    points.  On a part of a mirrored film the load is that part's share of one that has the same
    mirrors.
    """
    dx = film.plate.dx(2 * film.plate.degree)
    density = discs.density(film.plate, centre, radius, dx)
    if density is not None:
        value = fem.Constant(film.plate.domain.mesh, float(force))
        return Load(form=value * density * ufl.TestFunction(film.space)[2] * dx)
    points, weights = discs.rule(centre, radius, 4 * film.plate.degree)
    weights = force * weights / film.plate.mirrors.copies
    nodal = functional(film.plate, points, weights)
    return Load(nodal=film.deflections_to_state(nodal))


def problem(film: Film, load: Load | None) -> StaticProblem:
    """Static problem of the film under a load (None: relaxation of its pre-stress)."""
    load = load or Load()
    even = film.plate.mirrors.even
    linear = film.embed(ClassStiffness(film.plate)[even])
    force = LinearForce.of_energy(film.plate, film.state, film.w, film.plate.linear_energy(film.w))
    energy = film.stretching_energy() + film.preload_energy()
    return StaticProblem(
        film.state,
        energy,
        load.form,
        load.nodal,
        film.free_dofs(even),
        constant=linear,
        force=lambda columns: force(even, columns),
    )


def admissible(film: Film, load: Load) -> bool:
    """No node of the film is beyond a gate. Collective."""
    height = film.deflection()
    if film.plate.state.shape is not None:
        height = height + film.plate.state.shape.x.array
    dofs, free = compat.cell_dofs(film.plate.deflections), True
    for gate in load.gates:
        above = height if gate.inside is None else height[dofs[gate.inside > 0]]
        free = free and float((gate.side * above).max(initial=-np.inf)) < abs(gate.gap)
    return bool(film.plate.domain.comm.allreduce(free, op=MPI.LAND))
