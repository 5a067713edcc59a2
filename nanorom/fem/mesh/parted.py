"""Where edges of regions and masses lie, in a scene's unit of length: what a mesh has to follow."""

from __future__ import annotations

from collections.abc import Sequence

from nanorom.fem.mesh.cut import Piece
from nanorom.fem.symmetry import AXES, Mirrors
from nanorom.scene.geometry import Disc, Geometry, MeshFile, Rectangle
from nanorom.scene.outlines import DiscRegion, RectangleRegion
from nanorom.scene.region import Region
from nanorom.scene.scene import Scene

ALIKE = 1e-9  # of the film's size: edges nearer than that are one


def is_cut(scene: Scene) -> bool:
    """There are edges that neither a drum's rings nor a rectangle's rows can follow."""
    geometry, regions = scene.geometry, scene.regions
    discs = [mass for mass in scene.masses if mass.radius]
    if isinstance(geometry, MeshFile):
        return False
    if isinstance(geometry, Disc):
        if not all(mass.centred for mass in discs):
            return True
        return not all(isinstance(r, DiscRegion) and r.position == (0.0, 0.0) for r in regions)
    return bool(discs) or not all(isinstance(r, RectangleRegion) for r in regions)


def radii(scene: Scene, length: float) -> tuple[float, ...]:
    """Of the circles inside a drum of radius 1 at which regions, masses or its load end, all
    about the centre.
    """
    found = [r / length for region in scene.regions for r in region.radii]
    found += [mass.radius / length for mass in scene.masses if mass.radius]
    if scene.load is not None and scene.load.force and scene.load.centred and scene.load.radius:
        found.append(scene.load.radius / length)
    return _apart([r for r in found if r < 1 - ALIKE])


def lines_of(
    regions: Sequence[Region], length: float, axis: str, between: tuple[float, float]
) -> tuple[float, ...]:
    """Places along an axis where rectangles end, between two."""
    number, (low, high) = AXES.index(axis), between
    found = [corner[number] / length for region in regions for corner in region.corners]
    return _apart([x for x in found if low + ALIKE < x < high - ALIKE])


def _apart(places: Sequence[float]) -> tuple[float, ...]:
    """Sorted, each once."""
    found: list[float] = []
    for place in sorted(places):
        if not found or place - found[-1] > ALIKE:
            found.append(place)
    return tuple(found)


def corners_of(
    scene: Scene, length: float, mirrors: Mirrors
) -> tuple[tuple[float, float, float], ...]:
    """Corners inside the part that is meshed, towards which cells shrink to no radius."""
    geometry, grown = scene.geometry, 1 + ALIKE
    found = {corner for region in scene.regions for corner in region.corners}
    if not isinstance(geometry, MeshFile):
        found = {(x, y) for x, y in found if geometry.holds((grown * x, grown * y))}
    cut = [axis in mirrors.axes for axis in AXES]
    found = {c for c in found if all(each >= 0 for each, half in zip(c, cut) if half)}
    return tuple((x / length, y / length, 0.0) for x, y in sorted(found))


def piece(geometry: Geometry, length: float) -> Piece:
    """The film."""
    if isinstance(geometry, Disc):
        return Piece(radius=geometry.radius / length)
    assert isinstance(geometry, Rectangle)
    x, y = geometry.length / length / 2, geometry.width / length / 2
    return Piece(corners=((-x, -y), (x, -y), (x, y), (-x, y)))


def pieces(scene: Scene, length: float) -> tuple[Piece, ...]:
    """What cuts it: a ring by both its circles."""
    found = []
    for region in scene.regions:
        if isinstance(region, DiscRegion):
            centre = region.position[0] / length, region.position[1] / length
            found += [Piece(centre, r / length) for r in region.radii]
        else:
            found.append(Piece(corners=tuple((x / length, y / length) for x, y in region.corners)))
    for mass in scene.masses:
        if mass.radius:
            centre = mass.position[0] / length, mass.position[1] / length
            found.append(Piece(centre, mass.radius / length, stiff=False))
    return tuple(found)
