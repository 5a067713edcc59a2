"""Points of the film: the cell that holds one, and where in it."""

from __future__ import annotations

import numpy as np

from nanorom.fem import compat, quadrature
from nanorom.fem.plate import Plate

OUTSIDE = 1e-9  # a point is in a cell if no barycentric coordinate is below minus that
NEWTON_STEPS = 20
MARGIN = 0.05  # of a cell's size, by which a curved one may exceed the box of its nodes


def locate(plate: Plate, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Owned cell (n,), -1 where there is none, and reference point (n, 2) of points (n, 2)."""
    mesh = plate.domain.mesh
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)[: quadrature.owned_cells(plate)], :2]
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    margin = MARGIN * (high - low).max(axis=1, keepdims=True)
    found, at = np.full(len(points), -1), np.zeros((len(points), 2))
    for i, point in enumerate(points):
        near = np.flatnonzero(np.all((point > low - margin) & (point < high + margin), axis=1))
        reference, mapped = _pulled_back(plate, near, point)
        depth = np.minimum(reference.min(axis=1), 1 - reference.sum(axis=1))
        inside = np.flatnonzero(mapped & (depth > -OUTSIDE))
        if len(inside):
            found[i], at[i] = near[inside[0]], reference[inside[0]]
    return found, at


def _pulled_back(
    plate: Plate, cells: np.ndarray, point: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Reference point (c, 2) of every cell that its map takes to a point, and where it exists."""
    reference = np.full((len(cells), 2), 1 / 3)
    for _ in range(NEWTON_STEPS):
        x, jacobian = quadrature.map_points(plate, cells, reference)
        step = np.linalg.solve(jacobian, (point - x)[..., None])[..., 0]
        # far from a curved cell its map means nothing
        reference = np.clip(reference + step, -1.0, 2.0)
    x, jacobian = quadrature.map_points(plate, cells, reference)
    size = np.sqrt(np.abs(np.linalg.det(jacobian)))
    return reference, np.linalg.norm(x - point, axis=1) <= OUTSIDE * size
