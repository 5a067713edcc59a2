"""Modal forces of a drive that is aimed: a Gaussian spot of light, or a point.

J_r is the virtual work on mode r, int p phi_r dA per unit of the level.  The reduction computes it
for the drive of its scene from the modes' own polynomials.  For any other aim it is taken from the
shapes that the model keeps, linear on their fine triangles, right to about 1e-3.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.errors import AccuracyWarning, ModelError, SceneError
from nanorom.rom.model import ReducedModel
from nanorom.rom.shapes import Shapes
from nanorom.scene import fields as v
from nanorom.scene.drive import Drive
from nanorom.types import Array

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
    """The model with the drive's direct pattern; raises ModelError if it has no shapes.

    Warns with AccuracyWarning where the pattern has to be taken from the drawn shapes.
    """
    if drive.position is None or _made_for(model, drive):
        return model
    if model.shapes is None:
        raise ModelError("drive.position: the model has no mode shapes to aim at")
    if drive.direct_pattern == "spot":
        assert drive.radius is not None
        force = spot(model.shapes, drive.position, drive.radius)
    else:
        force = point(model.shapes, drive.position)
    warnings.warn(
        "drive.position: the model was not reduced with this aim; its modal forces are taken from "
        "the drawn shapes, right to about 1e-3",
        AccuracyWarning,
        stacklevel=3,
    )
    return attrs.evolve(model, drive=model.drive | {drive.direct_pattern: force})


def _made_for(model: ReducedModel, drive: Drive) -> bool:
    """Whether the reduction computed this pattern: its scene's drive has the same aim."""
    if drive.direct_pattern not in model.drive:
        return False
    own = v.parse_toml(model.scene).get("drive", {})
    aims = [(d.direct_pattern, d.position, d.radius) for d in (drive, Drive(**own))]
    return aims[0] == aims[1]
