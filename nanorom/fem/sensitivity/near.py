"""Models near that of a scene: exact derivatives where there are any, else reductions beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nanorom.errors import SceneError, SolverError
from nanorom.fem.sensitivity import model
from nanorom.fem.sensitivity.neighbours import neighbours
from nanorom.results.near import STEP, Near, Tangent
from nanorom.rom.model import ReducedModel
from nanorom.scene.scene import Scene
from nanorom.scene.spread import tables_of
from nanorom.types import Progress

STENCIL = (-2, -1, 1, 2)  # in steps


def near_of(
    scene: Scene,
    tables: Mapping[str, Any],
    directory: Path,
    by: Sequence[str] | None,
    exact: bool,
    progress: Progress | None = None,
) -> Near:
    """A scene's model and those near it by keys of its tables, all that act if left out.

    exact : raise SceneError where there are no exact derivatives.  Raises as `model_slopes`.
    Collective.
    """
    if exact or _has_exact(scene, by):
        try:
            found = model.model_slopes(scene, by, progress)
        except SolverError:  # modes too near each other for their shapes' equations
            if exact:
                raise
        else:
            return Tangent(scene, found.value, found.slope, found.label, found.number)
    return neighbours(scene, tables, directory, by, progress)


def slopes_of(
    scene: Scene, by: Sequence[str], progress: Progress | None = None
) -> model.ModelSlopes:
    """Arrays of a flat film's model and their derivatives by keys of the scene, exact or by
    reductions beside it, as there are.  Collective.  Raises as `model_slopes`.
    """
    if not scene.flat or _has_exact(scene, by):
        return model.model_slopes(scene, by, progress)
    near = neighbours(scene, tables_of(scene), Path(), by, progress)
    value = _arrays(near.model)
    slope = {
        key: value.combined(_first, *(_arrays(line(s * STEP)) for s in STENCIL))
        for key, line in zip(near.keys, near.lines)
    }
    return model.ModelSlopes(value, slope, near.model.label, tuple(near.model.number.tolist()))


def _arrays(found: ReducedModel) -> model.Arrays:
    return model.Arrays(
        frequency=found.frequency,
        mass=found.mass,
        stiffness=found.stiffness,
        cubic=found.cubic,
        drive=found.drive,
        parametric=found.parametric,
    )


def _first(_: np.ndarray, *values: np.ndarray) -> np.ndarray:
    """Derivative of fourth order at the middle of `STENCIL`."""
    far_low, low, high, far_high = values
    return np.asarray((far_low - far_high + 8 * (high - low)) / (12 * STEP))


def _has_exact(scene: Scene, by: Sequence[str] | None) -> bool:
    try:
        model.check(scene)
    except SceneError:  # that there are none is what is asked
        return False
    if by is None and scene.material.crystalline:  # a part of its numbers has
        return False
    return not scene.lossy and set(by or ()) <= model.scene_keys(scene).keys()
