"""From a scene to its film: mesh, static state and named modes as for a reduction.

A further kind of film is a further row here: one that is not here has no full-order orbits.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.routes.beam import BeamRoute
from nanorom.fem.routes.plate import PlateRoute
from nanorom.fem.routes.registry import ROUTES, route_of
from nanorom.fem.routes.route import Route
from nanorom.scene.scene import Scene
from nanorom.verification import beam, plate
from nanorom.verification.assembled import Film

LEAST_MORE, MOST_MORE = 8, 20  # named modes beyond the model's highest: as many as it has, within

FILMS: dict[type[Route], Callable[[Scene, int, float | None], Film]] = {
    PlateRoute: plate.assemble,
    BeamRoute: beam.assemble,
}


def assemble(scene: Scene, more: int | None = None, tolerance: float | None = None) -> Film:
    """The film of a scene, on this process alone, with ``more`` named modes than the model has.

    tolerance : of the mesh.  Raises SceneError for what is no film, SolverError as `reduce` does.
    """
    made = FILMS.get(type(route_of(scene)))
    if made is None:
        allowed = " | ".join(name for name, route in ROUTES.items() if type(route) in FILMS)
        raise SceneError(
            f"plate.model: found {scene.plate.model}; allowed for full-order orbits: {allowed}"
        )
    if scene.damping is None:
        raise SceneError("damping: missing section [damping], which a periodic orbit needs")
    if more is None:
        more = int(np.clip(scene.modes.highest, LEAST_MORE, MOST_MORE))
    return made(scene, more, tolerance)
