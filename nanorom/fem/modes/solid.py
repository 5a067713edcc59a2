"""Vibration modes of a solid, made unique: turned to the axes, scaled, signed and named.

A mode moves along an axis: the one along which most of its kinetic energy is.  Its largest
displacement along it is 1; of several such places it is positive at the one of the largest x, then
y, then z.
"""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import SolverError
from nanorom.fem.fields import volume
from nanorom.fem.models.solid import Solid
from nanorom.fem.modes import eigen
from nanorom.fem.solvers import algebra, compat

AXES = "xyz"
PAIR = eigen.NEAR  # squared frequencies closer than this (relative): a pair's, but for errors
SPLIT = 0.02  # of the kinetic energy: modes that differ by less in its direction move alike
TIE = 1e-3  # extrema closer than this (relative) are equal, and the place decides
CANDIDATE = 0.05  # below the largest of a lattice: cells in which the true maximum may be
HALVINGS = 24  # of a lattice about a maximum: its place is right to 1e-7 of a cell
PLACE = 1e-6  # of the solid's size: places closer than this are one


@attrs.frozen(eq=False)
class SolidModes:
    """Modes of a solid.

    eigenvalues: (n,) squared frequencies; shapes: (owned free rows, n); axes: (n,) along which they
    move, by number; names: such as z1, y1, by axis and order.
    """

    solid: Solid
    eigenvalues: np.ndarray
    shapes: np.ndarray
    axes: np.ndarray
    names: list[str]

    def take(self, index: np.ndarray) -> SolidModes:
        """Some of the modes, with the names that they have."""
        return SolidModes(
            self.solid,
            self.eigenvalues[index],
            self.shapes[:, index],
            self.axes[index],
            [self.names[i] for i in index],
        )

    def products(self, columns: np.ndarray) -> np.ndarray:
        """Phi^T f (n, m) of forces. Collective."""
        return self.solid.domain.comm.allreduce(self.shapes.T @ columns)

    def masses(self) -> np.ndarray:
        """Phi^T M Phi (n,) of each. Collective."""
        moved = algebra.multiply(self.solid.mass, self.shapes)
        return self.solid.domain.comm.allreduce(np.sum(self.shapes * moved, axis=0))


def solve(solid: Solid, count: int) -> SolidModes:
    """The ``count`` lowest modes and what is near the last. Collective."""
    if count > solid.free.size // 2:
        raise SolverError(
            f"{count} modes asked for, but the solid has only {solid.free.size} free degrees of "
            "freedom: refine the mesh or ask for fewer"
        )
    asked = min(count + eigen.EXTRA, solid.free.size)
    values, vectors = eigen.lowest(solid.stiffness, solid.mass, asked, solid.linear)
    for group in eigen.clusters(values, PAIR):
        if len(group) > 1:
            turn = _turn(solid, vectors[:, group])
            vectors[:, group] = vectors[:, group] @ turn
            values[group] = turn.T**2 @ values[group]
    order = np.argsort(values, kind="stable")
    values, vectors = values[order], vectors[:, order]
    axes = np.array([np.diag(gram) for gram in _grams(solid, vectors)]).argmax(axis=0)
    names = [f"{AXES[axis]}{np.sum(axes[: i + 1] == axis)}" for i, axis in enumerate(axes)]
    scaled = vectors / peaks(solid, vectors, axes)
    return SolidModes(solid, values, scaled, axes, names)


def _turn(solid: Solid, pair: np.ndarray) -> np.ndarray:
    """Orthogonal matrix that tells modes of one frequency apart. Collective.

    First the most vertical; of those that move alike, the nearest to the x axis, by a weight that
    has every even angular harmonic, as of films (`modes.normal`).
    """
    _, y, z = _grams(solid, pair)
    values, turn = np.linalg.eigh(y - z)
    for alike in eigen.clusters(values + 2, SPLIT):
        own = pair @ turn[:, alike]
        points = solid.space.tabulate_dof_coordinates()[solid.free.local // 3, :2]
        radius = solid.domain.comm.allreduce(
            np.linalg.norm(points, axis=1).max(initial=0.0), MPI.MAX
        )
        square = (points @ np.array([1, 1j]) / radius) ** 2
        weight = np.real(square / (1 - 0.9 * square))
        moved = algebra.multiply(solid.mass, own)
        form = solid.domain.comm.allreduce((weight[:, None] * own).T @ moved)
        turn[:, alike] = turn[:, alike] @ np.linalg.eigh(-form - form.T)[1]
    return np.asarray(turn)


def _grams(solid: Solid, vectors: np.ndarray) -> list[np.ndarray]:
    """Kinetic energies (n, n) of the displacements along x, y and z. Collective."""
    component = solid.free.local % 3
    return [_gram(solid, vectors, component == axis) for axis in range(3)]


def _gram(solid: Solid, vectors: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Kinetic energy (n, n) of the displacement along one axis. Collective."""
    along = vectors * rows[:, None]
    return solid.domain.comm.allreduce(along.T @ algebra.multiply(solid.mass, along))


def peaks(solid: Solid, vectors: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Largest displacement (n,) of columns along an axis each, signed where it is. Collective."""
    comm, n = solid.domain.comm, vectors.shape[1]
    whole = solid.free.extended(vectors).reshape(-1, 3, n)
    values = whole[:, axes, np.arange(n)]
    gathered = comm.allgather(_extrema(solid, values))
    mode, size, place = (np.concatenate(parts) for parts in zip(*gathered))
    extent = np.ptp(solid.domain.mesh.geometry.x, axis=0).max(initial=0.0)
    unit = PLACE * comm.allreduce(float(extent), op=MPI.MAX)
    found = np.empty(n)
    for i in range(n):
        own = np.flatnonzero(mode == i)
        largest = np.abs(size[own]).max()
        tied = own[np.abs(size[own]) > (1 - TIE) * largest]
        first = tied[np.lexsort(np.rint(-place[tied] / unit).T[::-1])[0]]
        found[i] = np.copysign(largest, size[first])
    return found


def _extrema(solid: Solid, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mode (k,), value (k,) and place (k, 3) of what may be the largest, of nodal values (N, n)."""
    degree = solid.degree
    element = compat.reference_element(degree, dimension=3)
    mesh, dofs = solid.domain.mesh, compat.cell_dofs(solid.space)
    dofs = dofs[: mesh.topology.index_map(3).size_local]
    grid = _lattice(2 * degree)
    basis = np.asarray(element.tabulate(0, grid)).reshape(len(grid), -1)
    seen = np.abs(np.einsum("qn,cnm->cqm", basis, values[dofs], optimize=True))
    tops = seen.max(axis=1, initial=0.0)
    largest = tops.max(axis=0, initial=0.0)
    solid.domain.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
    cell, mode = np.nonzero(tops > (1 - CANDIDATE) * largest)
    if len(cell) == 0:
        return mode, np.empty(0), np.empty((0, 3))
    local = values[dofs[cell], mode[:, None]]
    x = grid[seen[cell, :, mode].argmax(axis=1)]
    step = 1 / (2 * degree)
    around = np.array(np.meshgrid(*(np.arange(-1, 2),) * 3)).reshape(3, -1).T
    for _ in range(HALVINGS):
        step /= 2
        tried = _inside(x[:, None] + step * around)
        basis = np.asarray(element.tabulate(0, tried.reshape(-1, 3)))
        there = np.einsum("kqn,kn->kq", basis.reshape(*tried.shape[:2], -1), local)
        best = np.abs(there).argmax(axis=1)
        x = tried[np.arange(len(x)), best]
    place = np.stack(
        [volume.map_cells(mesh, cell[i : i + 1], x[i : i + 1])[0][0, 0] for i in range(len(cell))]
    )
    return mode, there[np.arange(len(x)), best], place


def _lattice(fineness: int) -> np.ndarray:
    """Points (q, 3) of the reference tetrahedron."""
    steps = np.arange(fineness + 1)
    x, y, z = np.meshgrid(steps, steps, steps, indexing="ij")
    inside = x + y + z <= fineness
    return np.stack([x[inside], y[inside], z[inside]], axis=1) / fineness


def _inside(points: np.ndarray) -> np.ndarray:
    """Points (..., 3) pulled back into the reference tetrahedron."""
    points = np.maximum(points, 0.0)
    return points / np.maximum(points.sum(axis=-1, keepdims=True), 1.0)
