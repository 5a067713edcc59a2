"""Invariant manifolds from a film's own forms: a few modes, and every degree of freedom follows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from nanorom.errors import SceneError
from nanorom.fem.routes.plate import PlateRoute
from nanorom.fem.routes.registry import ROUTES, route_of
from nanorom.fem.routes.route import Route
from nanorom.fem.routes.shell import ShellRoute
from nanorom.fem.routes.solid import SolidRoute
from nanorom.rom.manifold.direct import check_products, fields
from nanorom.rom.manifold.projection import project
from nanorom.rom.manifold.reduced import Reduced, check, check_size, reaching
from nanorom.rom.manifold.reduced import manifold as of_model
from nanorom.rom.model import ReducedModel
from nanorom.scene.scene import Scene
from nanorom.verification import shell, solid
from nanorom.verification.assemble import check as check_film
from nanorom.verification.body import Body, model_of
from nanorom.verification.body_film import FilmBody
from nanorom.verification.body_whole import WholeBody

FURTHER = 2  # orders of fields above the manifold's, for the estimate of what it leaves out
Made = Callable[[Scene, Sequence[int | str], int, float | None], Body]
BODIES: dict[type[Route], Made] = {
    PlateRoute: FilmBody.of,
    ShellRoute: partial(WholeBody.of, shell.assemble),
    SolidRoute: partial(WholeBody.of, solid.assemble),
}


def manifold(
    scene: Scene,
    masters: Sequence[int | str] = (1,),
    order: int = 7,
    style: str = "normal",
    *,
    mesh: float | None = None,
    reach: float | None = None,
    **options: Any,
) -> Reduced:
    """The manifold of some modes of a scene's film, with all its degrees of freedom as slaves.

    In-plane inertia is included.  Slaves are the scene's other modes of the classes of symmetry
    that take part, and fields.  Arguments and result as of
    `nanorom.rom.manifold.reduced.manifold`; mesh : tolerance of the mesh, that of the scene if left
    out.  Raises SceneError for a film whose forces are no polynomials, else the errors of `reduce`
    and of `manifold`.
    """
    check(order, style)
    check_size(max(len(masters), 1), 1, order)
    body = body_of(scene, masters, order, mesh)
    names = body.names[: len(masters)]
    if scene.drive is not None:
        options = {
            "direct": scene.drive.direct_pattern,
            "parametric": scene.drive.parametric_pattern,
        } | options

    def made(higher: int) -> Reduced:
        model = following(body, len(masters), higher)
        return of_model(model, names, higher, style, **options)

    if reach is None:
        return made(order)
    return reaching(made, order, reach)


def body_of(scene: Scene, masters: Sequence[int | str], order: int, mesh: float | None) -> Body:
    """The film of a scene; raises SceneError for one that has no manifold, before it is meshed."""
    made = BODIES.get(type(route_of(scene)))
    if made is None:
        allowed = " | ".join(name for name, route in ROUTES.items() if type(route) in BODIES)
        raise SceneError(
            f"plate.model: found {scene.plate.model}; allowed for manifolds of all degrees of "
            f"freedom: {allowed}"
        )
    check_scene(scene)
    check_products(len(masters), _fields_order(len(masters), order))
    numbers = [master for master in masters if isinstance(master, int)]
    more = max(0, max(numbers, default=0) - scene.modes.highest)
    return made(scene, masters, more, mesh)


def check_scene(scene: Scene) -> None:
    """Raise SceneError for what no manifold of all degrees of freedom knows."""
    check_film(scene, scene.drive)
    if scene.drive is not None and scene.drive.harmonics is not None:
        raise SceneError("drive.harmonics: found some; manifolds are driven by cos(omega t) alone")
    if scene.gas is not None and scene.gas.gap is not None:
        raise SceneError("gas.gap: found; manifolds know of no squeezed gas")
    if scene.damping is not None and scene.damping.material_time:
        raise SceneError(
            "damping: found a viscoelastic material; manifolds of all degrees of freedom know "
            "modal damping alone"
        )


def following(body: Body, masters: int, order: int) -> ReducedModel:
    """The model of a body on the fields of the manifold of its first modes, and its other ones."""
    shapes, squares = body.shapes[:, :masters], body.squares[:masters]
    found = fields(body.system, shapes, squares, _fields_order(masters, order))
    projected = project(body.system, body.shapes, body.squares, found, body.answers(masters))
    return model_of(body, projected, masters, order)


def _fields_order(masters: int, order: int) -> int:
    """Of several masters the manifold's own fields are many enough."""
    return order + FURTHER if masters == 1 else order
