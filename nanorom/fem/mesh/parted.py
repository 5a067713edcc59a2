"""Where regions, gates and masses end, in a scene's unit of length: what a mesh has to follow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nanorom.fem.mesh.cut import Piece
from nanorom.fem.symmetry import AXES, Mirrors
from nanorom.scene.geometry import Disc, Geometry, MeshFile, Rectangle
from nanorom.scene.mass import AddedMass
from nanorom.scene.outlines import DiscRegion, RectangleRegion
from nanorom.scene.region import Region
from nanorom.scene.scene import Scene

ROOM = 2e-2  # of a mass's radius, between its rim and others: the mesh follows no rim that has less
ALIKE = 1e-9  # of the film's size: edges nearer than that are one


def is_cut(scene: Scene) -> bool:
    """There are edges that neither a drum's rings nor a rectangle's rows can follow."""
    geometry, regions = scene.geometry, scene.patches
    if isinstance(geometry, MeshFile):
        return False
    discs = [mass for mass in scene.masses if is_followed(mass, scene)]
    if isinstance(geometry, Disc):
        if not all(mass.centred for mass in discs):
            return True
        return not all(isinstance(r, DiscRegion) and r.position == (0.0, 0.0) for r in regions)
    return bool(discs) or not all(isinstance(r, RectangleRegion) for r in regions)


def radii(scene: Scene, length: float) -> tuple[float, ...]:
    """Of the circles inside a drum of radius 1 at which regions, masses or its load end, all
    about the centre.
    """
    found = [r / length for region in scene.patches for r in region.radii]
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
    found = {corner for region in scene.patches for corner in region.corners}
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


def is_followed(mass: AddedMass, scene: Scene) -> bool:
    """Whether the mesh follows a mass's rim: of what is spread over a disc, apart from others."""
    if not mass.radius or isinstance(scene.geometry, MeshFile):
        return False
    return isinstance(scene.geometry, Disc) and mass.centred or _room(mass, scene) > 0


def _room(mass: AddedMass, scene: Scene) -> float:
    """Least width in m of the gaps between a mass's rim and circles or sides that it does not meet,
    of the film and of regions; 0 where there is next to none.
    """
    (x, y), r, geometry = mass.position, mass.radius, scene.geometry
    if isinstance(geometry, Rectangle):
        gaps = [geometry.length / 2 - abs(x) - r, geometry.width / 2 - abs(y) - r]
    else:
        assert isinstance(geometry, Disc)
        gaps = [geometry.radius - np.hypot(x, y) - r]
    circles = [(each.position, each.radius) for each in scene.masses if each.radius]
    for region in scene.patches:
        if isinstance(region, DiscRegion):
            circles += [(region.position, radius) for radius in region.radii]
        else:
            outline = np.array(region.corners) - (x, y)
            sides = zip(outline, np.roll(outline, -1, axis=0))
            gaps += [gap for gap in (_gap(r, *side) for side in sides) if gap > -ALIKE * r]
    for (x0, y0), radius in circles:
        away = np.hypot(x - x0, y - y0)
        if away or radius != r:
            gap = max(away - r - radius, abs(r - radius) - away)
            gaps += [gap] if gap > -ALIKE * r else []  # else they cross
    least = float(min(gaps))
    return least if least > ROOM * r else 0.0


def _gap(radius: float, start: np.ndarray, end: np.ndarray) -> float:
    """Between a circle about the origin and a line from (2,) to (2,), negative if they cross."""
    along = end - start
    share = np.clip(-(start @ along) / (along @ along), 0.0, 1.0)
    nearest = np.linalg.norm(start + share * along)
    farthest = max(np.linalg.norm(start), np.linalg.norm(end))
    return float(max(nearest - radius, radius - farthest))


def pieces(scene: Scene, length: float) -> tuple[Piece, ...]:
    """What cuts it: a ring by both its circles."""
    found = []
    for number, region in enumerate(scene.patches):
        stiff = number < len(scene.regions)
        if isinstance(region, DiscRegion):
            centre = region.position[0] / length, region.position[1] / length
            found += [Piece(centre, r / length, stiff=stiff) for r in region.radii]
        else:
            corners = tuple((x / length, y / length) for x, y in region.corners)
            found.append(Piece(corners=corners, stiff=stiff))
    for mass in scene.masses:
        if is_followed(mass, scene):
            centre, room = (mass.position[0] / length, mass.position[1] / length), np.inf
            if not (mass.centred and isinstance(scene.geometry, Disc)):
                room = _room(mass, scene) / length
            found.append(Piece(centre, mass.radius / length, stiff=False, room=room))
    return tuple(found)
