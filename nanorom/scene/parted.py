"""What regions, gates and the rest of a scene say together: off the film, or on one another."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.scene.geometry import Geometry, MeshFile
from nanorom.scene.region import DrawnRegion, Region, overlap
from nanorom.scene.units import place_with_unit, with_unit
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.scene.scene import Scene

TOUCH = 1e-9  # of the film's size: outlines nearer than that are one
FILM = tuple(field.name for field in attrs.fields(Region) if field.default is None)
CRYSTAL = ("youngs_modulus", "poisson_ratio", "bending_ratio")


def check_regions(scene: Scene) -> None:
    """Raise SceneError where regions of a scene do not go together with it."""
    if not scene.regions:
        return
    model, rules = scene.plate.model, scene.plate.rules
    if not (rules.planar and rules.shallow):
        raise SceneError(f"region: found beside plate.model = {model}; allowed: plate, membrane")
    if scene.material.thermal:
        raise SceneError(
            "material.expansion: found beside [[region]]; allowed there: no expansion, as heat "
            "does not know of regions"
        )
    if scene.load is not None and scene.load.stress is not None:
        raise SceneError(
            "load.stress: found beside [[region]], whose thicknesses differ; allowed there: "
            "tension and region.tension"
        )
    if not scene.flat and any(region.loss is not None for region in scene.regions):
        raise SceneError(
            "region.loss: found for a film that is not flat; allowed: material.loss alone"
        )
    for number, region in enumerate(scene.regions, 1):
        _check_one(scene, region, number)
    size = max(np.ptp(_outline(scene, r), axis=0).max() for r in scene.regions)
    for (i, first), (j, second) in combinations(enumerate(scene.regions, 1), 2):
        if overlap(first, second, TOUCH * float(size)):
            raise SceneError(
                f"region: found {i} ({first.shape}) and {j} ({second.shape}) on one another; "
                "allowed: regions that touch at most"
            )


def _check_one(scene: Scene, region: Region, number: int) -> None:
    """One region by itself."""
    geometry, said = scene.geometry, [getattr(region, key) for key in FILM]
    if all(value is None for value in said):
        raise SceneError(
            f"region: found number {number}, a {region.shape} that says nothing of its film; "
            f"allowed: any of {', '.join(FILM)}"
        )
    if not isinstance(region, DrawnRegion) and not isinstance(geometry, MeshFile):
        raise SceneError(
            f"region.surface: found on a {geometry.shape}; allowed: of a mesh file, else a shape"
        )
    if scene.material.crystalline:
        for key in CRYSTAL:
            if getattr(region, key) is not None:
                raise SceneError(f"region.{key}: found on a crystal; allowed: thickness, density")
    if scene.plate.bends is False:
        x, y, xy = region.pull(scene.tension, scene.plate.thickness)
        if not (x + y > 0 and x * y > xy**2):
            found = ", ".join(with_unit(pull, "N/m", 6) for pull in (x, y, xy))
            raise SceneError(
                f"region.tension: found {found}; allowed: greater than 0 in every "
                f"direction for a {scene.plate.model}"
            )
    _check_outline(geometry, region, f"region: found number {number}")


def check_gates(scene: Scene) -> None:
    """Raise SceneError for gates below a part of a film that is not there."""
    geometry, rules = scene.geometry, scene.plate.rules
    for number, gate in enumerate(scene.load.gates or () if scene.load else (), 1):
        if not (rules.planar and rules.shallow):
            raise SceneError(
                f"load.gate: found beside plate.model = {scene.plate.model}; allowed: plate, "
                "membrane"
            )
        if gate.patch is None:
            continue
        if not isinstance(gate.patch, DrawnRegion) and not isinstance(geometry, MeshFile):
            raise SceneError(
                f"load.gate.patch: found surface on a {geometry.shape}; allowed: of a mesh file, "
                "else a shape"
            )
        _check_outline(geometry, gate.patch, f"load.gate: found number {number}")


def check_place(
    geometry: Geometry, key: str, place: tuple[float, float], radius: float = 0.0
) -> None:
    """Raise SceneError for a disc (m) that leaves the film, where no mesh is needed to know."""
    if isinstance(geometry, MeshFile) or geometry.holds(place, radius):
        return
    found = place_with_unit(place) + (f" with radius {with_unit(radius, 'm', 6)}" if radius else "")
    raise SceneError(f"{key}: found {found}; allowed: on the {geometry.shape}")


def _check_outline(geometry: Geometry, region: Region, found: str) -> None:
    """Raise SceneError for an outline that leaves the film, where that is known without a mesh."""
    if isinstance(geometry, MeshFile) or not isinstance(region, DrawnRegion):
        return
    off = [tuple(p) for p in region.outline() if not geometry.holds(_drawn_in(p))]
    if off:
        raise SceneError(
            f"{found}, a {region.shape} that reaches {place_with_unit(off[0])}; allowed: within "
            f"the {geometry.shape}"
        )


def _drawn_in(point: Array) -> tuple[float, float]:
    """A point nearer to the origin by rounding: an outline may lie on the film's edge."""
    x, y = (1 - TOUCH) * point
    return float(x), float(y)


def _outline(scene: Scene, region: Region) -> Array:
    """Outline (n, 2) of a region; of one that a file has, the film's unit of length."""
    if isinstance(region, DrawnRegion):
        return region.outline()
    scale = scene.geometry.scale if isinstance(scene.geometry, MeshFile) else 1.0
    return np.array([[0.0, 0.0], [scale, scale]])
