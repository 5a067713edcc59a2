"""From a scene to its film: mesh, static state and named modes as for a reduction.

A further kind of film is a further row here: the films of `nanorom.fem.routes` that are not here
have no full-order orbits.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.errors import SceneError
from nanorom.scene.scene import Scene
from nanorom.verification import beam, plate
from nanorom.verification.assembled import Film

LEAST_MORE, MOST_MORE = 8, 20  # named modes beyond the model's highest: as many as it has, within

FILMS: dict[str, Callable[[Scene, int, float | None], Film]] = {
    "auto": plate.assemble,
    "membrane": plate.assemble,
    "plate": plate.assemble,
    "beam": beam.assemble,
}


def assemble(scene: Scene, more: int | None = None, tolerance: float | None = None) -> Film:
    """The film of a scene, on this process alone, with ``more`` named modes than the model has.

    tolerance : of the mesh.  Raises SceneError for what is no film, SolverError as `reduce` does.
    """
    kind = scene.plate.model
    if kind not in FILMS:
        allowed = " | ".join(FILMS)
        raise SceneError(f"plate.model: found {kind}; allowed for full-order orbits: {allowed}")
    if scene.damping is None:
        raise SceneError("damping: missing section [damping], which a periodic orbit needs")
    if more is None:
        more = int(np.clip(scene.modes.highest, LEAST_MORE, MOST_MORE))
    return FILMS[kind](scene, more, tolerance)
