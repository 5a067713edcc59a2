"""The routes from a scene to its model, by the word that the scene has for its film.

A further model is a further row here, beside what the word means in `nanorom.scene.film.MODELS`.
"""

from __future__ import annotations

from nanorom.errors import SceneError
from nanorom.fem.routes.beam import BeamRoute
from nanorom.fem.routes.plate import PlateRoute
from nanorom.fem.routes.route import Route
from nanorom.fem.routes.shell import ShellRoute
from nanorom.fem.routes.solid import SolidRoute
from nanorom.scene.scene import Scene

ROUTES: dict[str, Route] = {
    "auto": PlateRoute(),
    "membrane": PlateRoute(),
    "plate": PlateRoute(),
    "shell": ShellRoute(),
    "beam": BeamRoute(),
    "solid": SolidRoute(),
}


def check_of_plates(scene: Scene, what: str) -> None:
    """Raise SceneError, which says what is asked, unless a scene's film is a plate or membrane."""
    if not route_of(scene).of_plates:
        allowed = " | ".join(name for name, route in ROUTES.items() if route.of_plates)
        raise SceneError(f"plate.model: found {scene.plate.model}; allowed for {what}: {allowed}")


def route_of(scene: Scene) -> Route:
    """The route that a scene takes."""
    return ROUTES[scene.plate.model]
