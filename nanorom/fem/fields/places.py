"""Points of the film: the cell that holds one, and where in it."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from nanorom.errors import SolverError
from nanorom.fem.fields import quadrature
from nanorom.fem.fields.surface import Surface
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import AXES

OUTSIDE = 1e-9  # a point is in a cell if no barycentric coordinate is below minus that
NEWTON_STEPS = 20
PAIRS = 1e6  # of points and cells that are compared at once
MARGIN = 0.05  # of a cell's size, by which a curved one may exceed the box of its nodes


def locate(plate: Surface, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Owned cell (n,), -1 where there is none, and reference point (n, 2) of points (n, 2)."""
    mesh = plate.domain.mesh
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)[: quadrature.owned_cells(plate)], :2]
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    margin = MARGIN * (high - low).max(axis=1, keepdims=True)
    found, at = np.full(len(points), -1), np.zeros((len(points), 2))
    at_once = max(1, int(PAIRS / max(len(nodes), 1)))
    for start in range(0, len(points), at_once):
        some = points[start : start + at_once]
        above, below = some[:, None] > low - margin, some[:, None] < high + margin
        place, cell = np.nonzero(np.all(above & below, axis=2))
        reference, mapped = _pulled_back(plate, cell, some[place])
        depth = np.minimum(reference.min(axis=1), 1 - reference.sum(axis=1))
        inside = np.flatnonzero(mapped & (depth > -OUTSIDE))
        place, first = np.unique(place[inside], return_index=True)
        found[start + place] = cell[inside[first]]
        at[start + place] = reference[inside[first]]
    return found, at


def _pulled_back(
    plate: Surface, cells: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Reference points (m, 2) that the maps of m cells take to points (m, 2), and which exist."""
    reference = np.full((len(cells), 2), 1 / 3)
    for _ in range(NEWTON_STEPS):
        x, jacobian = quadrature.map_points(plate, cells, reference)
        step = np.linalg.solve(jacobian, (points - x)[..., None])[..., 0]
        # far from a curved cell its map means nothing
        reference = np.clip(reference + step, -1.0, 2.0)
    x, jacobian = quadrature.map_points(plate, cells, reference)
    size = np.sqrt(np.abs(np.linalg.det(jacobian)))
    return reference, np.linalg.norm(x - points, axis=1) <= OUTSIDE * size


def weighed(
    plate: Surface, points: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Local dofs (m, n), basis (m, n) and weights (m,) of those points that this rank holds.

    points : (k, 2); those beyond a mirror are taken for their images.  Every point is held by one
    rank.  Raises SolverError if a point lies outside the film. Collective.
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
    basis = compat.reference_element(plate.degree).tabulate(0, reference[mine])
    dofs = compat.cell_dofs(plate.deflections)[cell[mine]]
    return dofs, np.asarray(basis).reshape(dofs.shape), weights[mine]  # a rank may hold none


def functional(plate: Surface, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Vector (local dofs,) of w -> sum_i weights_i w(points_i), in the plate's deflections.

    points : (n, 2); those beyond a mirror are taken for their images, as an even deflection has it.
    The entries are those assembled on all ranks.  Raises SolverError if a point lies outside the
    film. Collective.
    """
    function = fem.Function(plate.deflections)
    dofs, basis, own = weighed(plate, points, weights)
    np.add.at(function.x.array, dofs, basis * own[:, None])
    compat.scatter_reverse_add(function)
    function.x.scatter_forward()
    return function.x.array.copy()


def evaluate(plate: Surface, w: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Values (n,) of a deflection (local dofs,) at points (n, 2). Collective."""
    n_owned = plate.deflections.dofmap.index_map.size_local
    values = [functional(plate, p[None], np.ones(1))[:n_owned] @ w[:n_owned] for p in points]
    return plate.domain.comm.allreduce(np.array(values))


def centre_value(plate: Surface, w: np.ndarray) -> float | None:
    """Value of a deflection (local dofs,) at the centre of the film's bounding box. Collective.

    None where the film has a hole there.
    """
    low, high = bounding_box(plate)
    middle = (low + high) / 2
    try:
        return float(evaluate(plate, w, middle[None])[0])
    except SolverError:  # no cell holds it: a hole
        return None


def bounding_box(plate: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner (2,) of the whole film. Collective."""
    x = plate.domain.mesh.geometry.x[:, :2]
    corners = np.concatenate([-x.min(axis=0), x.max(axis=0)])
    plate.domain.comm.Allreduce(MPI.IN_PLACE, corners, op=MPI.MAX)
    low, high = -corners[:2], corners[2:]
    cut = [axis in plate.mirrors.axes for axis in AXES]
    return np.where(cut, -high, low), high


def extent(plate: Surface) -> tuple[np.ndarray, float]:
    """Centre (2,) of the whole film and half its longer side: of a disc, its radius. Collective."""
    low, high = bounding_box(plate)
    return (low + high) / 2, float((high - low).max() / 2)


def lattice(n: int) -> np.ndarray:
    """Reference points (i/n, j/n) of a triangle."""
    i, j = np.mgrid[: n + 1, : n + 1]
    inside = i + j <= n
    return np.column_stack([i[inside], j[inside]]) / n
