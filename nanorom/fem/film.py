"""The film's displacement (u, w) as one field, its static loads, and its state under them.

The unit of displacement is such that stretching and tension have the same unit (the plate's
membrane stiffness stays 1), so a load is measured in tension x displacement / length^n.
"""

from __future__ import annotations

import copy
from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem import compat
from nanorom.fem.modes import ClassStiffness
from nanorom.fem.places import locate
from nanorom.fem.plate import Attraction, Plate
from nanorom.fem.ritz import LinearForce
from nanorom.fem.shapes import bounding_box
from nanorom.fem.statics import StaticProblem
from nanorom.fem.symmetry import AXES, Parity

RESOLVED = 1e-8  # relative error of the area of a disc that cells fill without being cut


class Film:
    """A plate's in-plane displacement and deflection in one space of three components."""

    def __init__(self, plate: Plate) -> None:
        self.plate = plate
        self.space = compat.lagrange_space(plate.domain.mesh, plate.degree, components=3)
        self.state = fem.Function(self.space)
        # the three spaces number the same nodes, each in its own order
        self._node = np.empty(len(self.state.x.array) // 3, dtype=np.int64)
        self._node[compat.cell_dofs(self.space)] = compat.cell_dofs(plate.deflections)
        self._in_plane_node = np.empty_like(self._node)
        self._in_plane_node[compat.cell_dofs(self.space)] = compat.cell_dofs(plate.in_plane)

    @property
    def u(self) -> Any:
        """In-plane displacement (UFL)."""
        return ufl.as_vector([self.state[0], self.state[1]])

    @property
    def w(self) -> Any:
        """Deflection (UFL)."""
        return self.state[2]

    def stretching_energy(self) -> Any:
        """Energy of the displacement, tension and bending apart."""
        return self.plate.stretching_energy(self.u, self.w)

    def preload_energy(self) -> Any:
        """What is linear in the displacement: pre-stress that is not in equilibrium."""
        return self.plate.preload_energy(self.u, self.w)

    def fixed(self, parity: Parity) -> np.ndarray:
        """Degrees of freedom (unrolled) that supports and mirrors hold at zero.

        A displacement has the parity of its deflection; the shape of the film is even.
        """
        plate = self.plate
        blocks = fem.locate_dofs_topological(self.space, 1, plate.supported)
        held = fem.locate_dofs_topological(self.space, 1, plate.held)
        fixed = [3 * blocks, 3 * blocks + 1, 3 * held + 2]
        for axis, odd in zip(plate.mirrors.axes, parity):
            blocks = fem.locate_dofs_topological(self.space, 1, plate.on_mirror(axis))
            across = AXES.index(axis)
            fixed += [3 * blocks + 1 - across, 3 * blocks + 2] if odd else [3 * blocks + across]
        return np.unique(np.concatenate(fixed))

    def embed(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """A matrix of the plate's deflections as one of the film. Collective."""
        rows, columns = (s.dofmap.index_map for s in (self.plate.deflections, self.space))
        sizes = [[n * m.size_local, n * m.size_global] for n, m in ((1, rows), (3, columns))]
        inject = PETSc.Mat().createAIJ(sizes, nnz=1, comm=self.plate.domain.comm)
        owned = np.arange(columns.size_local, dtype=np.int32)
        row = rows.local_to_global(self._node[owned].astype(np.int32))
        column = 3 * columns.local_to_global(owned) + 2
        for i, j in zip(row, column):
            inject.setValue(int(i), int(j), 1.0)
        inject.assemble()
        return matrix.ptap(inject)

    def deflection(self) -> np.ndarray:
        """(local dofs,) of the deflection of the current state, numbered as the plate does."""
        w = np.empty(len(self._node))
        w[self._node] = self.state.x.array.reshape(-1, 3)[:, 2]
        return w

    def in_plane(self) -> np.ndarray:
        """(local dofs,) of the in-plane displacement of the current state, the same."""
        u = np.empty((len(self._node), 2))
        u[self._in_plane_node] = self.state.x.array.reshape(-1, 3)[:, :2]
        return u.ravel()

    def deflections_to_state(self, w: np.ndarray) -> np.ndarray:
        """(local dofs,) of a state that has a nodal vector (local plate dofs,) as deflection."""
        state = np.zeros((len(self._node), 3))
        state[:, 2] = w[self._node]
        return state.ravel()

    def about(self, load: Load | None = None, magnitude: float = 0.0) -> Plate:
        """The plate about the current state, which is in equilibrium under a load. Collective."""
        plate = self.plate
        u, w = fem.Function(plate.in_plane), fem.Function(plate.deflections)
        u.x.array[:], w.x.array[:] = self.in_plane(), self.deflection()
        about = copy.copy(plate)
        force = plate.stretching_force(u, w)
        about.prestress = force if plate.prestress is None else plate.prestress + force
        shape = w.x.array if plate.shape is None else w.x.array + plate.shape.x.array
        if plate.domain.comm.allreduce(float(np.abs(shape).max(initial=0.0)), op=MPI.MAX) > 0:
            about.shape = fem.Function(plate.deflections)
            about.shape.x.array[:] = shape
        if load is not None and load.gap < np.inf:
            about.attraction = Attraction(load.gap, magnitude * load.strength)
        return about


# -- loads ----------------------------------------------------------------------------------------


@attrs.frozen(eq=False)
class Load:
    """A static load per unit magnitude.

    form : linear form, or None; nodal : (local dofs of the film,) or None; gap : height of the
    gate that attracts the film and that no part of it may reach; strength : of its attraction.
    """

    form: Any = None
    nodal: np.ndarray | None = None
    gap: float = np.inf
    strength: float = 1.0

    def __add__(self, other: Load) -> Load:
        """Both loads together, at most one of them a gate."""
        gate = self if self.gap < np.inf else other
        form, nodal = _sum(self.form, other.form), _sum(self.nodal, other.nodal)
        return Load(form, nodal, gate.gap, gate.strength)


def _sum(a: Any, b: Any) -> Any:
    return b if a is None else a if b is None else a + b


def pressure(film: Film, value: float = 1.0) -> Load:
    """Uniform dead pressure towards positive w."""
    test = ufl.TestFunction(film.space)
    value = fem.Constant(film.plate.domain.mesh, value)
    return Load(form=value * test[2] * film.plate.dx(2 * film.plate.degree))


def gate(film: Film, gap: float, strength: float = 1.0) -> Load:
    """Parallel-plate electrostatic pressure strength/2 / (gap - w)^2, strength eps0 V^2.

    The gate lies at ``gap`` above the film's plane, edge effects are neglected.
    """
    w = ufl.variable(film.w)
    height = w if film.plate.shape is None else w + film.plate.shape
    attraction = Attraction(gap, strength).on(film.plate.domain.mesh)
    form = ufl.diff(attraction.potential(height), w) * ufl.TestFunction(film.space)[2]
    return Load(form * film.plate.dx(film.plate.stretching_degree), None, gap, strength)


def patch(film: Film, centre: np.ndarray, radius: float, force: float = 1.0) -> Load:
    """A force spread evenly over a disc; a point force if its radius is 0. Collective.

    The disc is integrated cell by cell where no cell is cut by its rim, else on its own polar Gauss
    points.  On a part of a mirrored film the load is that part's share of one that has the same
    mirrors.
    """
    if radius > 0:
        plate, mesh = film.plate, film.plate.domain.mesh
        at = ufl.SpatialCoordinate(mesh) - fem.Constant(mesh, np.asarray(centre, dtype=float))
        square, value = fem.Constant(mesh, float(radius) ** 2), fem.Constant(mesh, 1.0)
        inside = ufl.conditional(ufl.lt(ufl.inner(at, at), square), value, 0.0)
        dx = plate.dx(2 * plate.degree)
        area = plate.domain.comm.allreduce(fem.assemble_scalar(compat.form(inside * dx)))
        whole = np.pi * radius**2
        if abs(plate.mirrors.copies * area / whole - 1) < RESOLVED:
            value.value = force / whole
            return Load(form=inside * ufl.TestFunction(film.space)[2] * dx)
    points, weights = np.zeros((1, 2)), np.ones(1)
    if radius > 0:
        n = 4 * film.plate.degree
        s, radial = np.polynomial.legendre.leggauss(n)
        r, radial = radius * (s + 1) / 2, radial * (s + 1) / 2
        angle = 2 * np.pi * np.arange(2 * n) / (2 * n)
        points = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))], axis=2)
        points = points.reshape(-1, 2)
        weights = np.repeat(radial / radial.sum(), 2 * n) / (2 * n)
    weights = force * weights / film.plate.mirrors.copies
    nodal = functional(film.plate, np.asarray(centre) + points, weights)
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
        film.fixed(even),
        constant=linear,
        force=lambda columns: force(even, columns),
    )


def admissible(film: Film, load: Load) -> bool:
    """No node of the film is beyond the gate. Collective."""
    height = film.deflection()
    if film.plate.shape is not None:
        height = height + film.plate.shape.x.array
    highest = film.plate.domain.comm.allreduce(float(height.max(initial=-np.inf)), op=MPI.MAX)
    return highest < load.gap


# -- values at points -----------------------------------------------------------------------------


def functional(plate: Plate, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Vector (local dofs,) of w -> sum_i weights_i w(points_i), in the plate's deflections.

    points : (n, 2); those beyond a mirror are taken for their images, as an even deflection has it.
    The entries are those assembled on all ranks.  Raises SolverError if a point lies outside the
    film. Collective.
    """
    comm = plate.domain.comm
    points = np.array(points, dtype=float)
    for axis in plate.mirrors.axes:
        points[:, AXES.index(axis)] = np.abs(points[:, AXES.index(axis)])
    cell, reference = locate(plate, points)
    rank = comm.allgather(cell >= 0)
    if not np.any(rank, axis=0).all():
        outside = points[~np.any(rank, axis=0)][0]
        raise SolverError(f"the point ({outside[0]:g}, {outside[1]:g}) lies outside the film")
    mine = np.argmax(rank, axis=0) == comm.rank
    function = fem.Function(plate.deflections)
    if mine.any():
        basis = compat.reference_element(plate.degree).tabulate(0, reference[mine])
        basis = np.asarray(basis).reshape(mine.sum(), -1)
        dofs = compat.cell_dofs(plate.deflections)[cell[mine]]
        np.add.at(function.x.array, dofs, basis * weights[mine, None])
    compat.scatter_reverse_add(function)
    function.x.scatter_forward()
    return function.x.array.copy()


def evaluate(plate: Plate, w: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Values (n,) of a deflection (local dofs,) at points (n, 2). Collective."""
    n_owned = plate.deflections.dofmap.index_map.size_local
    values = [functional(plate, p[None], np.ones(1))[:n_owned] @ w[:n_owned] for p in points]
    return plate.domain.comm.allreduce(np.array(values))


def centre_value(plate: Plate, w: np.ndarray) -> float | None:
    """Value of a deflection (local dofs,) at the centre of the film's bounding box. Collective.

    None where the film has a hole there.
    """
    low, high = bounding_box(plate)
    middle = (low + high) / 2
    try:
        return float(evaluate(plate, w, middle[None])[0])
    except SolverError:
        return None
