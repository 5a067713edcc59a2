"""Invariant manifolds from a film's own forms: a few modes, and every degree of freedom follows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nanorom.errors import ModelError, SceneError
from nanorom.rom.manifold.direct import fields
from nanorom.rom.manifold.full import FullSystem
from nanorom.rom.manifold.projection import Projection, in_units, near, project
from nanorom.rom.manifold.reduced import TOLERANCE, Reduced, check, check_size, of_equations
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assemble import assemble
from nanorom.verification.plate import PlateFilm
from nanorom.verification.system import FilmSystem

FURTHER = 2  # orders of fields above the manifold's, for the estimate of what it leaves out


def manifold(
    scene: Scene,
    masters: Sequence[int | str] = (1,),
    order: int = 7,
    style: str = "normal",
    *,
    tolerance: float = TOLERANCE,
    mesh: float | None = None,
) -> Reduced:
    """The manifold of some modes of a scene's film, with all its degrees of freedom as slaves.

    In-plane inertia is included.  Arguments and result as of `nanorom.rom.manifold.reduced
    .manifold`; slaves are the fields of which the manifold is made, in coordinates whose mass is
    that of the first master.  mesh : tolerance of the mesh, that of the scene if left out.  Raises
    SceneError for a film whose forces are no polynomials, else the errors of `reduce` and of
    `manifold`.
    """
    check(order, style)
    film = assemble(scene, _more(scene, masters), mesh)
    if not isinstance(film, PlateFilm):
        raise SceneError(
            f"plate.model: found {scene.plate.model}; allowed for manifolds of all degrees of "
            "freedom: plate | membrane"
        )
    if scene.damping is not None and scene.damping.material_time:
        raise SceneError(
            "damping: found a viscoelastic material; manifolds of all degrees of freedom know "
            "modal damping alone"
        )
    places = _places(film, masters)
    check_size(len(places), 1, order)
    system = FilmSystem.of(film, places)
    shapes, squares = _modes(film, system, places)
    found = spanned(system, shapes, squares, order)
    quality = np.full(len(found.squares), film.quality[-1])
    quality[: len(places)] = film.quality[places]
    scale = np.full(len(found.squares), film.scale[places[0]])
    scale[: len(places)] = film.scale[places]
    names = [film.names[place] for place in places]
    equations = in_units(found, quality, scale, film.units.time)
    label = (*names, *(f"field {n + 1}" for n in range(len(scale) - len(names))))
    return of_equations(equations, np.arange(len(places)), label, order, style, tolerance)


def spanned(system: FullSystem, shapes: Array, squares: Array, order: int) -> Projection:
    """The equations of a film or a solid on the fields of its manifold of masters.

    shapes (n, m) of unit mass, squares (m,) their squared frequencies.  Raises ModelError.
    """
    return project(system, shapes, squares, fields(system, shapes, squares, order + FURTHER))


def _more(scene: Scene, masters: Sequence[int | str]) -> int:
    numbers = [master for master in masters if isinstance(master, int)]
    return max(0, max(numbers, default=0) - scene.modes.highest)


def _places(film: PlateFilm, masters: Sequence[int | str]) -> list[int]:
    """Places of masters, by number or name, among the film's named modes."""
    found = []
    for master in masters:
        if master in film.names:
            found.append(film.names.index(str(master)))
        elif isinstance(master, int) and 1 <= master <= len(film.names):
            found.append(master - 1)
        else:
            raise ModelError(
                f"masters: found {master!r}; allowed: 1 to {len(film.names)} | "
                + " | ".join(film.names)
            )
    if not found or len(set(found)) < len(found):
        raise ModelError(f"masters: found {list(masters)}; allowed: one or more different modes")
    return found


def _modes(film: PlateFilm, system: FilmSystem, places: list[int]) -> tuple[Array, Array]:
    """Modes (n, m) of unit mass on the meshed part, in-plane motion and inertia included, from the
    named ones; and their squared frequencies (m,).
    """
    start = np.concatenate([_deflection(film, system, place) for place in places], axis=1)
    values = film.values[places]
    if film.discrete.shape is None:
        return start, values
    return near(system, start, values)


def _deflection(film: PlateFilm, system: FilmSystem, place: int) -> Array:
    """Deflection (n, 1) of a named mode, of unit mass."""
    parity = film.parities[place]
    column = film.of_class(parity).tolist().index(place)
    number = system.classes.deflections.index(parity)
    return system.embed(number, film.shapes(parity)[:, [column]])
