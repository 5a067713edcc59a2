"""In-plane resonances of slender films: found where the displacements of modes do not show them.

A narrow film bends in its own plane far below the frequencies of its stretching.  Products of modes
excite that bending beside much else, so that Ritz' method on the displacements they cause sees it
badly.  A few steps of inverse iteration from these displacements, with the factors that condensed
them, lead to the lowest motion that they excite, and to no other.  The tension stiffens it as it
does a string: its geometric stiffness int N:(grad u_i (x) grad u_i) is part of the energy.
"""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc
from scipy.spatial import cKDTree

from nanorom.fem.fields import quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import line
from nanorom.fem.tensors.equilibrium import Equilibrium

SLENDER = 0.3  # width by length below which a film bends in its plane before it stretches there
LOWEST = 6  # Ritz vectors that are iterated
MOST_STEPS = 8
SETTLED = 1e-3  # relative change of the lowest eigenvalue
DEPENDENT = 1e-8  # squares of unit displacements below this are rounding
EXCITED = 1e-4  # of a displacement's energy: motions of less change no coefficient visibly


def is_slender(plate: Plate) -> bool:
    """Whether the film is narrow: its width, by how far parts of it are from a support. Collective.

    The width is twice its area by the length of its edge.
    """
    mesh, comm, copies = plate.domain.mesh, plate.domain.comm, plate.mirrors.copies
    x = mesh.geometry.x[:, :2]
    nodes = plate.in_plane.tabulate_dof_coordinates()[:, :2]
    held = (plate.holding.rigid + plate.holding.elastic).any(axis=1)
    supports = np.concatenate(comm.allgather(nodes[held]))
    away, _ = cKDTree(supports).query(x)
    mirrors = plate.domain.facets_of([line(axis) for axis in plate.mirrors.axes])
    edge = np.setdiff1d(compat.exterior_facets(mesh), mirrors)
    edge = edge[edge < mesh.topology.index_map(1).size_local]
    ends = x[compat.facet_vertices(mesh, edge)]
    corners = x[compat.cell_nodes(mesh)[: quadrature.owned_cells(plate), :3]]
    area = 0.5 * np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum()
    sums = np.array([area, np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()])
    area, perimeter = copies * comm.allreduce(sums)
    length = 2 * comm.allreduce(float(away.max(initial=0.0)), op=MPI.MAX)
    return bool(2 * area / perimeter < SLENDER * length)


def slowest(plate: Plate, equilibrium: Equilibrium, displacements: np.ndarray) -> float:
    """Lowest squared frequency of what displacements (local dofs, m) excite. Collective.

    Per unit of membrane stiffness and mass; all of one class of symmetry, that of the equilibrium.
    """
    space = _Space(plate, equilibrium)
    columns = equilibrium.free.taken(displacements)
    space.add(columns)
    if not space.size:
        return np.inf
    value = np.inf
    for _ in range(MOST_STEPS):
        before = value
        values, vectors = space.ritz()
        value = _excited(space, values, vectors, columns)
        if np.isfinite(value) and before - value < SETTLED * value:
            break
        space.add(space.softened(vectors[:, :LOWEST]))
    return value


def _excited(space: _Space, values: np.ndarray, vectors: np.ndarray, columns: np.ndarray) -> float:
    """The lowest of Ritz values (n,) whose vector has a share of a displacement's energy."""
    energy = space.sum(np.sum(columns * space.stiffness(columns), axis=0))
    moved = energy > 0
    parts = space.sum(vectors.T @ space.inertia(columns[:, moved])) ** 2
    shares = (values[:, None] * parts / energy[moved]).max(axis=1, initial=0.0)
    found = values[shares > EXCITED]
    return float(found.min()) if len(found) else np.inf


class _Space:
    """Displacements (owned free rows, n) that are orthonormal in their mass."""

    def __init__(self, plate: Plate, equilibrium: Equilibrium) -> None:
        self._comm, self._equilibrium = plate.domain.comm, equilibrium
        self._stretching, self._strain = plate.stiffness.stretching, plate.stiffness.strain
        tension, mass = (
            equilibrium.free.restrict(algebra.assemble(compat.form(form))) for form in _forms(plate)
        )
        self._tension: PETSc.Mat = tension
        self._mass: PETSc.Mat = mass
        self._columns = np.empty((len(equilibrium.free.local), 0))

    @property
    def size(self) -> int:
        """How many there are."""
        return int(self._columns.shape[1])

    def sum(self, values: np.ndarray) -> np.ndarray:
        """Over all ranks."""
        return np.asarray(self._comm.allreduce(values))

    def stiffness(self, columns: np.ndarray) -> np.ndarray:
        """Forces of stretching and tension per unit of membrane stiffness. Collective."""
        force = self._equilibrium.product(columns) / self._stretching
        return np.asarray(force + self._strain * algebra.multiply(self._tension, columns))

    def inertia(self, columns: np.ndarray) -> np.ndarray:
        """Forces of a unit acceleration. Collective."""
        return algebra.multiply(self._mass, columns)

    def softened(self, columns: np.ndarray) -> np.ndarray:
        """Displacements by the inertia of others: a step of inverse iteration. Collective."""
        free = self._equilibrium.free
        moved = self._equilibrium.correction(free.extended(self.inertia(columns)))
        return -free.taken(moved)

    def add(self, columns: np.ndarray) -> None:
        """Take displacements (owned free rows, m) in addition. Collective."""
        for _ in range(2):  # once loses orthogonality
            columns = columns - self._columns @ self.sum(self._columns.T @ self.inertia(columns))
            square = self.sum(columns.T @ self.inertia(columns))
            size = np.sqrt(np.maximum(square.diagonal(), 0.0))
            columns, size = columns[:, size > 0], size[size > 0]
            if not len(size):
                return
            square = self.sum(columns.T @ self.inertia(columns)) / np.outer(size, size)
            squares, rotation = np.linalg.eigh(0.5 * (square + square.T))
            kept = squares > DEPENDENT
            columns = columns @ (rotation[:, kept] / np.sqrt(squares[kept]) / size[:, None])
        self._columns = np.hstack([self._columns, columns])

    def ritz(self) -> tuple[np.ndarray, np.ndarray]:
        """Ritz values (n,), sorted, and vectors (owned free rows, n). Collective."""
        energy = self.sum(self._columns.T @ self.stiffness(self._columns))
        values, rotation = np.linalg.eigh(0.5 * (energy + energy.T))
        return values, self._columns @ rotation


def _forms(plate: Plate) -> tuple[ufl.Form, ufl.Form]:
    """Geometric stiffness of the membrane force, and mass, of in-plane displacements."""
    u, v = ufl.TrialFunction(plate.in_plane), ufl.TestFunction(plate.in_plane)
    mesh, state, dx = plate.domain.mesh, plate.state, plate.dx(plate.stretching_degree)
    x, y = (fem.Constant(mesh, float(pull)) for pull in state.tension)
    xy = fem.Constant(mesh, float(state.shear))
    force = ufl.as_matrix([[x, xy], [xy, y]])
    if state.prestress is not None:
        force = force + state.prestress
    tension = ufl.inner(ufl.grad(u) * force, ufl.grad(v)) * dx
    return tension, ufl.inner(u, v) * dx
