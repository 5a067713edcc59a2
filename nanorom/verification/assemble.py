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
from nanorom.fem.routes.shell import ShellRoute
from nanorom.fem.routes.solid import SolidRoute
from nanorom.scene.drive import Drive
from nanorom.scene.request import MOST_MODES
from nanorom.scene.scene import Scene
from nanorom.verification import beam, plate, shell, solid
from nanorom.verification.assembled import Film
from nanorom.verification.driven import check as check_drive

Check = Callable[[Scene], None]
Assemble = Callable[[Scene, int, float | None], Film]

LEAST_MORE, MOST_MORE = 8, 20  # named modes beyond the model's highest: as many as it has, within
WIDER = 3  # times as many named modes, where these do not lead to an orbit: a search that they are
# too few for costs as much as one that finds
WIDEST = 72  # named modes, of themselves: their cubic tensors have L^4 entries, 200 MB each
WORTH = 1.5  # times as many named modes at least: fewer lead where those before did

FILMS: dict[type[Route], tuple[Check, Assemble]] = {
    PlateRoute: (plate.check, plate.assemble),
    BeamRoute: (BeamRoute().check, beam.assemble),
    ShellRoute: (ShellRoute().check, shell.assemble),
    SolidRoute: (SolidRoute().check, solid.assemble),
}


def check(scene: Scene, drive: Drive | None = None) -> None:
    """Raise SceneError unless full-order orbits of a scene can be solved for under a drive."""
    made = FILMS.get(type(route_of(scene)))
    if made is None:
        allowed = " | ".join(name for name, route in ROUTES.items() if type(route) in FILMS)
        raise SceneError(
            f"plate.model: found {scene.plate.model}; allowed for full-order orbits: {allowed}"
        )
    if scene.load is not None and scene.load.gates is not None:
        raise SceneError(
            "load.gate: found; full-order orbits know of one gate below all of the film, "
            "load.voltage and load.gap"
        )
    if scene.damping is None:
        raise SceneError("damping: missing section [damping], which a periodic orbit needs")
    made[0](scene)
    if drive is not None:
        check_drive(drive)


def assemble(scene: Scene, more: int | None = None, tolerance: float | None = None) -> Film:
    """The film of a scene, on this process alone, with ``more`` named modes than the model has.

    tolerance : of the mesh.  Raises SceneError for what is no film, SolverError as `reduce` does.
    """
    check(scene)
    if more is None:
        more = rungs(scene)[0]
    room = _room(scene)
    if not 0 <= more <= room:
        raise SceneError(f"more: found {more} modes beyond the model's; allowed: 0 to {room}")
    _, made = FILMS[type(route_of(scene))]
    return made(scene, more, tolerance)


def rungs(scene: Scene) -> list[int]:
    """How many named modes more than the model has are to be tried, the next where some fail."""
    own = scene.modes.highest
    named = own + min(int(np.clip(own, LEAST_MORE, MOST_MORE)), _room(scene))
    found = [named - own]
    while (wider := min(WIDER * named, WIDEST)) >= WORTH * named:
        named = wider
        found.append(named - own)
    return found


def _room(scene: Scene) -> int:
    return max(0, MOST_MODES - scene.modes.highest)
