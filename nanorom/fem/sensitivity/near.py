"""Models near that of a scene: exact derivatives where there are any, else reductions beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from nanorom.errors import SceneError, SolverError
from nanorom.fem.sensitivity import model
from nanorom.fem.sensitivity.neighbours import neighbours
from nanorom.results.near import Near, Tangent
from nanorom.scene.scene import Scene
from nanorom.types import Progress


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


def _has_exact(scene: Scene, by: Sequence[str] | None) -> bool:
    try:
        model.check(scene)
    except SceneError:  # that there are none is what is asked
        return False
    if by is None and scene.material.crystalline:  # a part of its numbers has
        return False
    return not scene.lossy and set(by or ()) <= model.scene_keys(scene).keys()
