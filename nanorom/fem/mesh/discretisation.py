"""Which mesh and degree a scene needs: as coarse as its tolerance allows.

High order is the lever: degree 8 on few curved cells.  The cell size follows from the shortest
wavelength asked for; edges get rings or rows of cells down to the layer sqrt(D/T) in which a
clamped plate bends; towards corners, where the solution is singular, cells shrink by themselves.
The constants were set against the exact solutions of `nanorom bench --accuracy`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from itertools import pairwise

import attrs
import numpy as np

from nanorom.fem.mesh.arrays import MeshData, Source
from nanorom.fem.mesh.corners import Corners
from nanorom.fem.mesh.cut import Cut
from nanorom.fem.mesh.gmsh import GmshFile
from nanorom.fem.mesh.parted import corners_of, is_cut, is_followed, lines_of, piece, pieces, radii
from nanorom.fem.mesh.shapes import Grid, Rings
from nanorom.fem.mesh.singular import Corner
from nanorom.fem.symmetry import OPPOSITE, Mirrors
from nanorom.scene.geometry import Disc, MeshFile, Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.mass import AddedMass
from nanorom.scene.scene import Scene
from nanorom.scene.support import Kind, Spring, deflection_of

DEGREE = 8
WAVES = (2.66, 3.12)  # wavenumber x size of degree 8 at tolerance 1e-6: plate, membrane (drum)
RATE = 14.0  # at which errors fall with the size
POINT_RATE = 7.0  # of a shape's own value, which counts at a free edge and where films differ
RECTANGLE = 0.85  # of a drum's cells: those of a rectangle, whose peaks are where cells are largest
COARSEST = 1.0  # of the film's half width
GROWTH = 1.25  # cells per quadrant that each ring of a drum has more than the last
FEWEST = 2  # cells per quadrant of a ring
OUTERMOST = 4.0  # of the layer: width of the cells at the edge at tolerance 1e-6
OUTERMOST_RATE = 7.4  # at which errors fall with that width
STEP = 2**0.25  # between such widths, which are rounded down
LAYER_RATIO = 4.0  # widths of neighbouring rings at tolerance 1e-4; smaller for smaller ones
AT_EDGE = 0.75  # of the film's half width: what shrinks towards the edge at most
ALIKE = 0.05  # rings that differ by less than this are one
SLENDERNESS = 8.0  # longest cell of a string by its half width: beyond, rounding errors grow


@attrs.frozen
class Discretisation:
    """What is meshed, the order of its cells' map, and the degree.

    The source describes the part of the film that ``mirrors`` cut out; ``whole``: it is unfolded
    and the whole film is meshed; ``corners``: how cells shrink where the support changes.
    """

    source: Source
    degree: int
    order: int
    mirrors: Mirrors = Mirrors()
    whole: bool = False
    corners: Corners | None = None


def choose(scene: Scene, length: float, layer: float, tolerance: float | None) -> Discretisation:
    """Discretisation for a scene.

    length : the scene's unit of length in m; layer : sqrt(D/T) in that unit, 0 for a membrane;
    tolerance : error to aim at, None for the degree and mesh size that the scene states.
    """
    geometry, accuracy, mirrors = scene.geometry, scene.accuracy, Mirrors.of(scene)
    if isinstance(geometry, MeshFile):
        return _file(scene, geometry, length, tolerance)
    degree = accuracy.degree or DEGREE
    if tolerance is None:
        size = accuracy.mesh_size / length if accuracy.mesh_size else COARSEST
    else:
        size = _cell_size(scene, geometry, length, layer, tolerance)
    order = max(degree, 2)
    if is_cut(scene):
        at_edge = 0.0 if tolerance is None else _outermost(layer, tolerance)
        source = Cut(piece(geometry, length), pieces(scene, length), size, at_edge)
        return Discretisation(source, degree, order, corners=_corners(scene, length, tolerance))
    if isinstance(geometry, Disc):
        circles = radii(scene, length)
        if scene.patches or len(circles) > 1:
            found = _parted_disc(degree, order, size, layer, mirrors, tolerance, circles)
        else:
            spot = _spot(scene, length, tolerance)
            found = _disc(degree, order, size, layer, mirrors, tolerance, spot)
        if not scene.masses:
            return found
        return attrs.evolve(found, corners=_corners(scene, length, tolerance))
    return _rectangle(scene, geometry, degree, size, length, layer, mirrors, tolerance)


def _file(
    scene: Scene, geometry: MeshFile, length: float, tolerance: float | None
) -> Discretisation:
    """The mesh of a file; a geometry file is meshed finer where the tolerance asks for it."""
    degree = scene.accuracy.degree or DEGREE
    finer = 1.0
    if tolerance is not None and scene.accuracy.tolerance is not None:
        finer = (tolerance / scene.accuracy.tolerance) ** (1 / _rate(scene))
    corners = _corners(scene, length, tolerance)
    source = GmshFile(geometry.file, geometry.parameters or {}, size_factor=finer)
    return Discretisation(source, degree, degree, corners=corners)


def _corners(scene: Scene, length: float, tolerance: float | None) -> Corners | None:
    if tolerance is None:
        return None
    points = tuple(
        (mass.position[0] / length, mass.position[1] / length, mass.radius / length)
        for mass in scene.masses
        if not is_followed(mass, scene)
    )
    points += corners_of(scene, length, Mirrors.of(scene))
    nu = scene.material.poisson_ratio
    slenderness = 1.0
    if isinstance(scene.geometry, Rectangle):
        sides = scene.geometry.length, scene.geometry.width
        slenderness = max(sides) / min(sides)
    return Corners(scene.support.kind, nu, tolerance, points, slenderness)


def _cell_size(
    scene: Scene, geometry: Disc | Rectangle, length: float, layer: float, tolerance: float
) -> float:
    """Size of degree-8 cells for a tolerance at the shortest wavelength."""
    wavenumber = shortest_wave(geometry, scene.modes.highest) * length
    plate, membrane = WAVES
    finer = min((tolerance / 1e-6) ** (1 / rate) for rate in (RATE, _rate(scene)))
    scaled = (plate if layer else membrane) * finer
    if isinstance(geometry, Rectangle):
        scaled *= RECTANGLE
    return min(COARSEST, scaled / wavenumber)


def _rate(scene: Scene) -> float:
    """At which errors fall with the size of cells; a tag that has no name may not be there."""
    kinds = list(scene.supports.values())
    if isinstance(scene.geometry, MeshFile):
        kinds = list(scene.support.named.values()) or [scene.support.default]
    pointwise = "free" in map(deflection_of, kinds) or scene.patches
    return POINT_RATE if pointwise else RATE


def shortest_wave(geometry: Disc | Rectangle, count: int) -> float:
    """Wavenumber of the count-th mode in 1/m, by Weyl's law with its boundary term."""
    if isinstance(geometry, Disc):
        area, perimeter = np.pi * geometry.radius**2, 2 * np.pi * geometry.radius
    else:
        area = geometry.length * geometry.width
        perimeter = 2 * (geometry.length + geometry.width)
    if isinstance(geometry, String):
        return (count + 1) * np.pi / geometry.length
    return (perimeter + np.sqrt(perimeter**2 + 16 * np.pi * area * (count + 1))) / (2 * area)


def _disc(
    degree: int,
    order: int,
    size: float,
    layer: float,
    mirrors: Mirrors,
    tolerance: float | None,
    spot: float,
) -> Discretisation:
    """Drum of radius 1 in rings of equal width, then of widths that shrink to the layer.

    spot : radius on which a force at the centre acts, 0 without one; it gets a ring of its own, and
    rings grow from it to the others.
    """
    shrinking = np.empty(0)
    if tolerance is not None:
        rings = _shrinking(size, _outermost(layer, tolerance), _layer_ratio(tolerance))
        shrinking = _within(1.0, rings)
    inner = 1 - shrinking.sum()
    n_inner = max(1, int(np.ceil(inner / size - 1e-9)))
    uniform = inner / n_inner * np.arange(1, n_inner + 1)
    core = np.empty(0)
    if 0 < spot < inner and tolerance is not None:
        uniform = uniform[uniform > spot * (1 + ALIKE)]
        count = int(np.ceil(np.log(uniform[0] / spot) / np.log(_layer_ratio(tolerance))))
        core = spot * (uniform[0] / spot) ** (np.arange(count) / count)
        core = np.concatenate([inner / n_inner * np.arange(1, spot * n_inner / inner), core])
    radii = np.concatenate([[0.0], core, uniform, inner + np.cumsum(shrinking)])
    radii[-1] = 1.0
    polar = spot if len(core) else min(inner, radii[-2])
    at_most = int(np.ceil(GROWTH * np.ceil(1 / size - 1e-9)))
    sectors = [min(int(np.ceil(GROWTH * ring)), at_most) for ring in range(1, len(radii))]
    disc = Rings(tuple(radii[1:]), tuple(sectors), 4 // mirrors.copies, polar)
    return Discretisation(disc, degree, order, mirrors)


def _parted_disc(
    degree: int,
    order: int,
    size: float,
    layer: float,
    mirrors: Mirrors,
    tolerance: float | None,
    circles: Sequence[float],
) -> Discretisation:
    """Drum of radius 1 whose rings end at circles, the edges of regions, on both sides of which
    they shrink to the layer.
    """
    at_edge = np.empty(0)
    if tolerance is not None:
        at_edge = _shrinking(size, _outermost(layer, tolerance), _layer_ratio(tolerance))
    ends = [0.0, *circles, 1.0]
    rows = [
        _row(low, high, size, at_edge if low else at_edge[:0], at_edge)
        for low, high in pairwise(ends)
    ]
    radii = np.concatenate([row[1:] for row in rows])
    sectors = [max(FEWEST, int(np.ceil(GROWTH * radius / size - 1e-9))) for radius in radii]
    disc = Rings(tuple(radii), tuple(sectors), 4 // mirrors.copies, circles[0])
    return Discretisation(disc, degree, order, mirrors)


def _row(low: float, high: float, size: float, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Places from low to high at most a size apart, widths that shrink towards the ends."""
    span = high - low
    first, last = (_within(span / 2, widths[widths < span / 2]) for widths in (first, last))
    inner = span - first.sum() - last.sum()
    count = max(1, int(np.ceil(inner / size - 1e-9)))
    widths = np.concatenate([first[::-1], np.full(count, inner / count), last])
    places = low + np.concatenate([[0.0], np.cumsum(widths)])
    places[-1] = high
    return places


def _spot(scene: Scene, length: float, tolerance: float | None) -> float:
    """Radius on which a force or a mass at a drum's centre acts, 0 without one.

    Under a point force the deflection is smooth but for r^2 log r.
    """
    centred: list[Load | AddedMass] = [mass for mass in scene.masses if mass.centred]
    if scene.load is not None and scene.load.force and scene.load.centred:
        centred.append(scene.load)
    if not centred or tolerance is None:
        return 0.0
    return max(each.radius for each in centred) / length or float(np.sqrt(tolerance))


def _outermost(layer: float, tolerance: float) -> float:
    """Width of the cells at a clamped edge."""
    width = layer * OUTERMOST * (tolerance / 1e-6) ** (1 / OUTERMOST_RATE)
    if width:  # on few meshes: films that differ by little have one
        width = STEP ** float(np.floor(np.log(width) / np.log(STEP) + 1e-9))
    return width


def _layer_ratio(tolerance: float) -> float:
    """Widths of neighbouring rings towards the edge."""
    return max(2.0, LAYER_RATIO * (tolerance / 1e-4) ** 0.06)


def _shrinking(size: float, smallest: float, ratio: float) -> np.ndarray:
    """Widths that fall from below ``size`` to about ``smallest``, each by a ratio."""
    if smallest <= 0 or smallest >= size:
        return np.empty(0)
    count = int(np.ceil(np.log(size / smallest) / np.log(ratio)))
    return size * (smallest / size) ** (np.arange(1, count + 1) / count)


def _within(half: float, widths: np.ndarray) -> np.ndarray:
    """Widths towards an edge, all narrower where they would take more than a share of the half."""
    return widths * (AT_EDGE * half / max(widths.sum(), AT_EDGE * half))


def _rectangle(
    scene: Scene,
    geometry: Rectangle,
    degree: int,
    size: float,
    length: float,
    layer: float,
    mirrors: Mirrors,
    tolerance: float | None,
) -> Discretisation:
    """Rows and columns that shrink towards clamped sides; corners are graded by themselves."""
    sides = {"x": geometry.length / length, "y": geometry.width / length}
    size = min(size, max(sides.values()) / 2, SLENDERNESS * min(sides.values()) / 2)
    lines = {}
    for axis, side in sides.items():
        low, high = (
            _within(side / 2, _end_rows(scene.supports[end], min(size, side / 2), layer, tolerance))
            for end in OPPOSITE[axis]
        )
        half = axis in mirrors.axes
        start = 0.0 if half else -side / 2
        low = np.empty(0) if half else low
        inner = side / 2 - start - low.sum() - high.sum()
        n_inner = max(1, int(np.ceil(inner / size - 1e-9)))
        widths = np.concatenate([low[::-1], np.full(n_inner, inner / n_inner), high])
        lines[axis] = np.concatenate([[0.0], np.cumsum(widths)]) + start
        edges = lines_of(scene.patches, length, axis, (start, side / 2))
        if edges:
            inside = _end_rows("clamped", min(size, side / 2), layer, tolerance)
            ends = [start, *edges, side / 2]
            rows = [
                _row(a, b, size, low if a == start else inside, high if b == ends[-1] else inside)
                for a, b in pairwise(ends)
            ]
            lines[axis] = np.concatenate([[start], *(row[1:] for row in rows)])
    grid = Grid(tuple(lines["x"]), tuple(lines["y"]), mirrors)
    corners = _corners(scene, length, tolerance)
    return Discretisation(grid, degree, 1, mirrors, corners=corners)


def _end_rows(kind: Kind, size: float, layer: float, tolerance: float | None) -> np.ndarray:
    """Widths of the rows towards a side of a kind, from the inside outwards.

    layer : in which it bends, if clamped.
    """
    kind = deflection_of(kind)
    if tolerance is None or not (kind == "clamped" or isinstance(kind, Spring)):
        return np.empty(0)
    return _shrinking(size, _outermost(layer, tolerance), _layer_ratio(tolerance))


def dofs_of(cells: int, degree: int) -> int:
    """About how many degrees of freedom a deflection has on so many cells."""
    return int(cells * degree**2 / 2 * 1.05)


def surface(chosen: Discretisation) -> Discretisation:
    """A file's as one in space, whose corners are not graded."""
    if not isinstance(chosen.source, GmshFile):
        return chosen
    return attrs.evolve(chosen, source=attrs.evolve(chosen.source, in_space=True), corners=None)


def meshed(chosen: Discretisation, in_space: bool = False) -> MeshData:
    """The mesh of a discretisation, not yet distributed. One process.

    Raises MeshError as meshing does.
    """
    chosen = surface(chosen) if in_space else chosen
    return chosen.source.mesh(1, chosen.corners)


def cells_of(chosen: Discretisation) -> int | None:
    """How many cells a discretisation has, None where only gmsh can tell."""
    cells = chosen.source.cells
    return cells if cells is None else int(cells + _corner_cells(chosen))


def _corner_cells(chosen: Discretisation) -> float:
    """About how many cells the corners of a rectangle add."""
    if chosen.corners is None:
        return 0.0
    kind, octaves = chosen.corners.kind, 0.0
    ends = [
        [end for end in OPPOSITE[axis] if not (axis in chosen.mirrors.axes and end == half)]
        for axis, half in (("x", "left"), ("y", "bottom"))
    ]
    for first, last in itertools.product(*ends):
        corner = Corner(kind(first), kind(last), np.pi / 2)
        octaves -= np.log2(chosen.corners.smallest(corner))
    return octaves * chosen.corners.cells_per_octave
