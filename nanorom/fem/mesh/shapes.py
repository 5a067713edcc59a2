"""Discs and rectangles in triangles, without gmsh: the shapes that a scene names need no file.

``meshes/drum.geo`` and ``meshes/rectangle.geo`` describe the same cells for gmsh.
"""

from __future__ import annotations

from itertools import pairwise

import attrs
import numpy as np

from nanorom.fem.mesh.arrays import MeshData
from nanorom.fem.mesh.corners import Corners
from nanorom.fem.mesh.sketch import Curve, Sketch
from nanorom.fem.symmetry import AXES, OPPOSITE, Mirrors, line


@attrs.frozen
class Rings:
    """A disc about the origin: a fan of triangles inside rings of triangles.

    radii: of the circles, the edge's last; sectors: cells of each in a quadrant; quadrants: 4,
    or 1 for the part at positive x and y; polar: as of `Sketch`.
    """

    radii: tuple[float, ...]
    sectors: tuple[int, ...]
    quadrants: int = 4
    polar: float | None = None
    name: str = "disc"

    @property
    def cells(self) -> int:
        return self.quadrants * (2 * sum(self.sectors) - self.sectors[-1])

    def mesh(self, order: int, corners: Corners | None = None) -> MeshData:
        return self.sketch().mesh(order, corners, self.name)

    def sketch(self) -> Sketch:
        """Its straight triangles and its circles; of a quarter also its sides on the mirrors."""
        points, circles, triangles, curves = [np.zeros((1, 2))], [], [], []
        inner, fewer, first = np.zeros(self.quadrants + 1, dtype=int), 0, 1
        for radius, count in zip(self.radii, self.sectors):
            circle = np.arange(self.quadrants * count + 1)
            angle = circle * (np.pi / 2 / count)
            open_end = len(circle) - (self.quadrants == 4)
            points.append(_on_circle(radius, angle[:open_end]))
            circle = first + circle % open_end
            triangles += self._ring(inner, circle, fewer, count)
            curves.append(_arcs(radius, circle, angle, radius == self.radii[-1]))
            circles.append(circle)
            inner, fewer, first = circle, count, first + open_end
        if self.quadrants == 1:
            for axis, end in (("y", 0), ("x", -1)):
                side = np.array([0, *(circle[end] for circle in circles)])
                curves.append(Curve(_chain(side), (line(axis),)))
        return Sketch(np.concatenate(points), np.array(triangles), tuple(curves), self.polar)

    def _ring(
        self, inner: np.ndarray, outer: np.ndarray, fewer: int, count: int
    ) -> list[tuple[int, int, int]]:
        """Triangles between two circles, of each quadrant by the shorter diagonals."""
        found = []
        for quadrant in range(self.quadrants):
            i, j = 0, 0
            near = inner[quadrant * fewer :] if fewer else inner[:1]
            far = outer[quadrant * count :]
            while i < fewer or j < count:
                # angles of the two diagonals, times both counts
                if i == fewer or (
                    j < count and abs((j + 1) * fewer - i * count) <= (i + 1) * count - j * fewer
                ):
                    found.append((near[i], far[j], far[j + 1]))
                    j += 1
                else:
                    found.append((near[i], far[j], near[i + 1]))
                    i += 1
        return found


@attrs.frozen
class Grid:
    """A rectangle in rows and columns of quadrilaterals, each of two triangles.

    x, y: places of the lines between them, which begin on the axes of ``mirrors``.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    mirrors: Mirrors = Mirrors()
    name: str = "rectangle"

    @property
    def cells(self) -> int:
        return 2 * (len(self.x) - 1) * (len(self.y) - 1)

    def mesh(self, order: int, corners: Corners | None = None) -> MeshData:
        return self.sketch().mesh(order, corners, self.name)

    def sketch(self) -> Sketch:
        """Its triangles, whose diagonals alternate, and its sides."""
        number = np.arange(len(self.x) * len(self.y)).reshape(len(self.x), len(self.y))
        points = np.stack(np.meshgrid(self.x, self.y, indexing="ij"), axis=-1).reshape(-1, 2)
        corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        a, b, c, d = (corner.ravel() for corner in corners)
        even = (np.indices(corners[0].shape).sum(axis=0) % 2).ravel() == 0
        one = np.where(even[:, None], np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
        two = np.where(even[:, None], np.stack([b, c, d], axis=1), np.stack([a, c, d], axis=1))
        ends = {"x": (number[0], number[-1]), "y": (number[:, 0], number[:, -1])}
        curves = []
        for axis in AXES:
            for place, name, side in zip((0, 1), OPPOSITE[axis], ends[axis]):
                mirrored = place == 0 and axis in self.mirrors.axes
                curves.append(Curve(_chain(side), (line(axis) if mirrored else name,)))
        return Sketch(points, np.concatenate([one, two]), tuple(curves))


def _on_circle(radius: float, angle: np.ndarray) -> np.ndarray:
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _arcs(radius: float, vertices: np.ndarray, angle: np.ndarray, outermost: bool) -> Curve:
    """The edges of a circle."""
    return Curve(
        _chain(vertices),
        ("edge",) if outermost else (),
        _chain(angle),
        lambda at: _on_circle(radius, at),
    )


def _chain(values: np.ndarray) -> np.ndarray:
    """Neighbours (m, 2) of a row (m + 1,)."""
    return np.array(list(pairwise(values)))
