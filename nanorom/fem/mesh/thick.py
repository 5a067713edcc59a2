"""Which tetrahedra a solid needs: as coarse as its tolerance allows.

Cells follow the shortest wavelength, and shrink to the thickness towards held faces, where stresses
are not those of a film and, at edges, infinite.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nanorom.fem.mesh import tetrahedra
from nanorom.fem.mesh.arrays import Source
from nanorom.fem.mesh.discretisation import Discretisation, shortest_wave
from nanorom.fem.mesh.shapes import Grid, Rings
from nanorom.fem.mesh.volumes import SolidFile, Thick
from nanorom.fem.symmetry import OPPOSITE
from nanorom.scene.geometry import Disc, MeshFile, Rectangle
from nanorom.scene.scene import Scene

DEGREE = 4
USUAL = 1e-3  # tolerance that the next numbers are for
WAVE = 2.0  # wavenumber x size of cells
HELD, FREE = 0.7, 2.0  # of the thickness: cells at held and at free sides
LAYER = 1.2  # of the thickness: layers of cells
RATE = 2.0  # at which errors fall with cells at edges, where stresses are infinite
SMOOTH_RATE = 6.0  # with cells elsewhere
COARSEST = 0.5  # of the unit of length
SECTORS = 1.25  # cells per quadrant that each ring of a disc has more than the last
FILE_ORDER = 2  # of cells on curved surfaces of a file


def choose(scene: Scene, length: float, aim: float | None) -> Discretisation:
    """Tetrahedra and degree for an error to aim at, None for those that the scene states.

    length : the scene's unit of length in m.
    """
    geometry, accuracy = scene.geometry, scene.accuracy
    degree = accuracy.degree or DEGREE
    thickness = scene.plate.thickness / length
    finer = 1.0 if aim is None else (aim / USUAL) ** (1 / RATE)
    layers = max(1, int(np.ceil(1 / (LAYER * finer) - 1e-9)))
    if isinstance(geometry, MeshFile):
        source = SolidFile(geometry.file, geometry.parameters or {}, finer, thickness, layers)
        return Discretisation(source, degree, min(degree, FILE_ORDER))
    if aim is None:
        assert accuracy.mesh_size is not None
        size = accuracy.mesh_size / length
        held = free = size
        layers = max(1, int(np.ceil(thickness / size - 1e-9)))
    else:
        wavenumber = shortest_wave(geometry, scene.modes.highest) * length
        size = min(COARSEST, WAVE / wavenumber) * (aim / USUAL) ** (1 / SMOOTH_RATE)
        held, free = HELD * thickness * finer, FREE * thickness * finer
    at_side = {side: free if kind == "free" else held for side, kind in scene.supports.items()}
    film, order = _film(geometry, length, size, at_side), 1
    if isinstance(geometry, Disc):
        order = degree
    return Discretisation(Thick(film, thickness, layers), degree, order)


def _film(
    geometry: Disc | Rectangle, length: float, size: float, at_side: Mapping[str, float]
) -> Source:
    """The flat mesh that is made thick, of cells of a size, and of another at each side."""
    if isinstance(geometry, Disc):
        radii = tetrahedra.row(0.0, 1.0, size, (size, at_side["edge"]))
        most = int(np.ceil(SECTORS / size))
        sectors = [min(int(np.ceil(SECTORS * ring)), most) for ring in range(1, len(radii))]
        return Rings(tuple(radii[1:]), tuple(sectors), polar=float(radii[-2]))
    lines = {}
    for axis, side in (("x", geometry.length / length), ("y", geometry.width / length)):
        first, last = (at_side[end] for end in OPPOSITE[axis])
        lines[axis] = tetrahedra.row(-side / 2, side / 2, size, (first, last))
    return Grid(tuple(lines["x"]), tuple(lines["y"]))
