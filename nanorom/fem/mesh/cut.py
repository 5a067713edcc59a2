"""Discs and rectangles cut along the edges of regions and masses on them, by gmsh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.fem.mesh import vetting
from nanorom.fem.mesh.arrays import MeshData
from nanorom.fem.mesh.corners import Corners
from nanorom.fem.mesh.gmsh import sketch

STEEPEST = 0.7  # size of a cell by its distance from an edge that has smaller ones
FINEST = 1 / 64  # cells at an edge by the others: beyond, there would be too many
ROUND = 10  # cells around a circle at least

Point = tuple[float, float]


@attrs.frozen
class Piece:
    """A disc of a radius about a centre, or what lies within corners in their order.

    stiff: the film's stiffness ends at its edge, about which it bends in a layer;
    room: between a disc's rim and others.
    """

    centre: Point = (0.0, 0.0)
    radius: float = 0.0
    corners: tuple[Point, ...] = ()
    stiff: bool = True
    room: float = np.inf

    def at_edge(self, size: float) -> float:
        """Size of the cells that its edge needs by itself, where the others have a size."""
        if self.radius:
            # an arc leaves its chord by less than a thin cell is wide
            across = np.sqrt(0.5 * self.room * self.radius)
            return float(min(size, 2 * np.pi * self.radius / ROUND, across))
        return min(size, max(_shortest(self.corners), FINEST * size))


@attrs.frozen
class Cut:
    """A film and the pieces that cut it; cells of a size, of another where it bends at edges.

    film: its disc, or its rectangle from the lower left corner on; at_edge: 0 if no cell shrinks.
    """

    film: Piece
    pieces: tuple[Piece, ...]
    size: float
    at_edge: float = 0.0

    @property
    def name(self) -> str:
        return "disc" if self.film.radius else "rectangle"

    @property
    def cells(self) -> None:
        return None

    def mesh(self, order: int, corners: Corners | None = None) -> MeshData:
        """Its cells of an order; one process only. Raises MeshError with gmsh's last message."""
        with vetting.session(f"regions: gmsh cannot cut the {self.name}") as gmsh:
            return self._meshed(gmsh).mesh(order, corners, self.name)

    def _meshed(self, gmsh: Any) -> Any:
        gmsh.model.add("cut")
        film = _add(gmsh, self.film)
        pieces = [(2, _add(gmsh, piece)) for piece in self.pieces]
        parts, made = gmsh.model.occ.fragment([(2, film)], pieces)
        gmsh.model.occ.synchronize()
        surfaces = [part for part in parts if part[0] == 2]
        names: dict[str, list[int]] = {}
        for _, tag in gmsh.model.getBoundary(surfaces, combined=True, oriented=False):
            names.setdefault(self._side(gmsh, tag), []).append(tag)
        for name, tags in names.items():
            group = gmsh.model.addPhysicalGroup(1, tags)
            gmsh.model.setPhysicalName(1, group, name)
        self._set_sizes(gmsh, made)
        gmsh.model.mesh.generate(2)
        return sketch(gmsh, Path(self.name))

    def _side(self, gmsh: Any, curve: int) -> str:
        """Name of the film's side that a curve is a part of."""
        if self.film.radius:
            return "edge"
        low, high = np.array(self.film.corners[0]), np.array(self.film.corners[2])
        x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(1, curve)
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
        away = np.abs(np.concatenate([middle - low, middle - high]))
        return ("left", "bottom", "right", "top")[int(away.argmin())]

    def _set_sizes(self, gmsh: Any, made: list[Any]) -> None:
        """Cells of the size, and smaller ones at edges; made: parts of the film and the pieces."""
        for option in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", self.size)
        layer = min(self.size, max(self.at_edge or self.size, FINEST * self.size))
        sizes = [layer]
        for piece in self.pieces:
            own = piece.at_edge(self.size)
            sizes.append(min(own, layer) if piece.stiff else own)
        field, smaller = gmsh.model.mesh.field, []
        for parts, at_edge in zip(made, sizes):
            if at_edge == self.size:
                continue
            edges = gmsh.model.getBoundary(parts, combined=True, oriented=False)
            distance, size = field.add("Distance"), field.add("Threshold")
            field.setNumbers(distance, "CurvesList", [tag for _, tag in edges])
            for key, value in {
                "InField": distance,
                "SizeMin": at_edge,
                "SizeMax": self.size,
                "DistMin": 0.0,
                "DistMax": (self.size - at_edge) / STEEPEST,
            }.items():
                field.setNumber(size, key, value)
            smaller.append(size)
        smallest = field.add("Min")
        field.setNumbers(smallest, "FieldsList", smaller)
        if smaller:
            field.setAsBackgroundMesh(smallest)


def _add(gmsh: Any, piece: Piece) -> int:
    occ = gmsh.model.occ
    if piece.radius:
        return int(occ.addDisk(*piece.centre, 0.0, piece.radius, piece.radius))
    points = [occ.addPoint(x, y, 0.0) for x, y in piece.corners]
    ends = points[1:] + points[:1]
    lines = [occ.addLine(a, b) for a, b in zip(points, ends)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def _shortest(corners: tuple[Point, ...]) -> float:
    sides = np.roll(np.array(corners), -1, axis=0) - np.array(corners)
    return float(np.hypot(*sides.T).min())
