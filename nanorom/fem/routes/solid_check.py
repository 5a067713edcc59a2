"""What a scene of a solid cannot be asked, in one line each."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.mesh import thick
from nanorom.fem.models import build_solid
from nanorom.fem.models.solid import HIGHEST_DEGREE, LOWEST_DEGREE
from nanorom.fem.scales import Scales
from nanorom.scene.geometry import MeshFile
from nanorom.scene.request import USUAL_TOLERANCE
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit

INCOMPRESSIBLE = 0.49  # Poisson's ratio beyond which displacements alone lock


def check(scene: Scene) -> None:
    """Raise SceneError for what a solid does not know, before anything expensive."""
    check_parts(scene)
    check_numbers(scene)
    check_tolerance(scene)


def check_parts(scene: Scene) -> None:
    """Sections, supports and settings."""
    only = "allowed with another plate.model than solid"
    given = {
        "load": scene.load is not None,
        "plate.initial_shape": scene.plate.initial_shape is not None,
        "region": bool(scene.regions),
        "gas": scene.gas is not None,
        "material.expansion": scene.material.thermal,
        "damping.material_time": scene.damping is not None and scene.damping.material_time > 0,
    }
    for key, found in given.items():
        if found:
            raise SceneError(f"{key}: found beside plate.model = solid; {only}")
    for side, kind in scene.supports.items():
        if kind not in ("clamped", "free"):
            raise SceneError(
                f"support.{side}: found {kind} for the face of a solid; allowed: clamped | free"
            )
    reduction = scene.reduction
    for key, allowed in (("method", "direct"), ("in_plane", "free"), ("outside", "static")):
        value = getattr(reduction, key)
        if value != allowed:
            raise SceneError(
                f"reduction.{key}: found {value} beside plate.model = solid; allowed: {allowed}"
            )


def check_numbers(scene: Scene) -> None:
    """Degree, material, tension, and which faces of a file are held."""
    degree = scene.accuracy.degree
    if degree is not None and degree > HIGHEST_DEGREE:
        raise SceneError(
            f"accuracy.degree: found {degree}; allowed: {LOWEST_DEGREE} to {HIGHEST_DEGREE} for a "
            "solid"
        )
    if scene.material.poisson_ratio > INCOMPRESSIBLE:
        raise SceneError(
            f"material.poisson_ratio: found {scene.material.poisson_ratio:g}; allowed: up to "
            f"{INCOMPRESSIBLE:g} for a solid, which locks beyond"
        )
    along = build_solid.stretched(scene)
    for axis, name in enumerate(("x", "y")):
        pull = getattr(scene.tension, name)
        if pull and axis not in along:
            raise SceneError(
                f"tension.{name}: found {with_unit(pull, 'N/m', 6)} across a free face of a "
                "solid, which does not bear it; allowed: 0"
            )
    if isinstance(scene.geometry, MeshFile) and not isinstance(scene.support.edge, Mapping):
        raise SceneError(
            f"support.edge: found {scene.support.edge} for all faces of a mesh file's solid; "
            'allowed: a table that names faces, such as { ends = "clamped" }, or has a default'
        )


def check_tolerance(scene: Scene) -> None:
    """Raise SceneError for a tolerance that no solid meets which is small enough to be solved."""
    tolerance, length = scene.accuracy.tolerance, Scales.of(scene).length
    if tolerance is None:
        return

    def unknowns(aim: float) -> int:
        chosen = thick.choose(scene, length, aim)
        return build_solid.unknowns_of(chosen.source.cells or 0, chosen.degree)

    asked = unknowns(tolerance)
    if asked <= build_solid.MOST_UNKNOWNS:
        return
    least = tolerance
    while least < 1 and unknowns(least) > build_solid.MOST_UNKNOWNS:
        least *= 2
    usual = " (as where none is given)" if tolerance == USUAL_TOLERANCE else ""
    power = 10 ** np.floor(np.log10(least))
    raise SceneError(
        f"accuracy.tolerance: found {tolerance:g}{usual}, for which this solid has "
        f"about {asked} "
        f"unknowns; allowed: {power * np.ceil(least / power):g} or more, of which "
        f"{build_solid.MOST_UNKNOWNS} are enough"
    )
