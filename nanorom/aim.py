"""Modal forces of a drive that is aimed: a Gaussian spot of light, or a point.

J_r is the virtual work on mode r, int p phi_r dA per unit of the level.  It is taken from the mode
shapes in the model, linear on their fine triangles (right to about 1e-3), so that a spot can be
moved after the reduction; a uniform pressure, which needs no aim, comes with the model.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import ModelError, SceneError
from nanorom.excitation import Drive
from nanorom.rom import ReducedModel, Shapes

Array = NDArray[np.float64]

OUTSIDE = 1e-9  # of a triangle: a point further out is not in it


def spot(shapes: Shapes, position: Sequence[float], radius: float) -> Array:
    """J (L,) in m^2, N per Pa at the centre: int phi_r exp(-2 d^2/radius^2) dA.

    position (x, y) and radius, where the intensity is 1/e^2 of the centre's, in m.
    """
    distance = shapes.points[:, :2] - np.asarray(position)
    intensity = np.exp(-2 * np.sum(distance**2, axis=1) / radius**2)
    corners = shapes.points[shapes.cells, :2]
    (x1, y1), (x2, y2) = (corners[:, i].T - corners[:, 0].T for i in (1, 2))
    area = 0.5 * np.abs(x1 * y2 - x2 * y1)
    return np.asarray((shapes.values * intensity)[:, shapes.cells].mean(axis=2) @ area)


def point(shapes: Shapes, position: Sequence[float]) -> Array:
    """J (L,) of a force at a position (x, y) in m: phi_r there.  Raises SceneError outside."""
    corners = shapes.points[shapes.cells, :2]
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    local = np.linalg.solve(sides, (np.asarray(position) - corners[:, 0])[..., None])[..., 0]
    weights = np.column_stack([1 - local.sum(axis=1), local])
    cell = int(weights.min(axis=1).argmax())
    if weights[cell].min() < -OUTSIDE:
        x, y = position
        raise SceneError(f"drive.position: ({x:g}, {y:g}) m is not on the film")
    return np.asarray(shapes.values[:, shapes.cells[cell]] @ weights[cell])


def aimed(model: ReducedModel, drive: Drive) -> ReducedModel:
    """The model with the drive's direct pattern; raises ModelError if it has no shapes."""
    if drive.position is None:
        return model
    if model.shapes is None:
        raise ModelError("drive.position: the model has no mode shapes to aim at")
    if drive.direct_pattern == "spot":
        assert drive.radius is not None
        force = spot(model.shapes, drive.position, drive.radius)
    else:
        force = point(model.shapes, drive.position)
    return attrs.evolve(model, drive=model.drive | {drive.direct_pattern: force})
