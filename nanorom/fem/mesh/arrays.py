"""A mesh as plain arrays, before it is distributed, and where it comes from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import attrs
import numpy as np

from nanorom.fem.mesh import curved
from nanorom.fem.mesh.corners import Corners
from nanorom.fem.symmetry import AXES, OPPOSITE, Mirrors, line

Placement = Callable[[np.ndarray], np.ndarray]  # points (n, 2) of a flat mesh -> (n, 3)
ON_MIRROR = 1e-9  # of the film's size: points nearer to a mirror lie on it


@attrs.frozen
class MeshData:
    """A mesh as plain arrays, before it is distributed.

    points: (n, 2), or (n, 3) of a surface in space; cells: (c, nodes) in the coordinate element's
    order; order: of the map; facets: physical curve -> vertex pairs (m, 2); surfaces: physical
    surface -> which cells (c,) are of it, of meshes that are not unfolded; dimension: 3 of a solid
    in tetrahedra, whose facets are physical surface -> vertex triples (m, 3).
    """

    points: np.ndarray
    cells: np.ndarray
    order: int
    facets: Mapping[str, np.ndarray]
    surfaces: Mapping[str, np.ndarray] = attrs.field(factory=dict)
    dimension: int = 2

    @property
    def sides(self) -> np.ndarray:
        """Of the box about it, (2,) or (3,)."""
        return np.asarray(np.ptp(self.points, axis=0))

    def placed(self, place: Placement) -> MeshData:
        """This flat mesh on a surface in space, the upper side of every cell up."""
        corners = self.points[self.cells[:, :3]]
        side = corners[:, 1:] - corners[:, :1]
        under = side[:, 0, 0] * side[:, 1, 1] < side[:, 0, 1] * side[:, 1, 0]
        cells = self.cells.copy()
        cells[under] = cells[under][:, curved.turned_over(self.order)]
        return MeshData(place(self.points), cells, self.order, self.facets)

    def unfolded(self, mirrors: Mirrors) -> MeshData:
        """The whole film from the part that lies at positive coordinates of the mirrors."""
        data = self
        for axis in mirrors.axes:
            data = data._reflected(axis)
        return data

    def _reflected(self, axis: str) -> MeshData:
        """This mesh and its mirror image, the nodes on the mirror shared."""
        column = AXES.index(axis)
        shared = np.abs(self.points[:, column]) < ON_MIRROR * np.ptp(self.points, axis=0).max()
        image = np.arange(len(self.points))
        image[~shared] = len(self.points) + np.arange((~shared).sum())
        flipped = self.points[~shared] * np.where(np.arange(2) == column, -1.0, 1.0)
        near, far = OPPOSITE[axis][::-1]  # the side that is meshed, and its image
        facets: dict[str, np.ndarray] = {}
        for name, pairs in self.facets.items():
            if name == line(axis):
                continue
            if name == near:
                facets |= {near: pairs, far: image[pairs]}
            else:
                facets[name] = np.concatenate([pairs, image[pairs]])
        points = np.concatenate([self.points, flipped])
        cells = np.concatenate([self.cells, image[self.cells]])
        return MeshData(points, cells, self.order, facets)


class Source(Protocol):
    """Where a mesh comes from: a shape of the package, or a file."""

    @property
    def name(self) -> str:
        """For messages."""
        ...

    @property
    def cells(self) -> int | None:
        """How many cells it has before corners are graded, None where only gmsh can tell."""
        ...

    def mesh(self, order: int, corners: Corners | None = None) -> MeshData:
        """Its cells of an order, graded towards corners. One process; raises MeshError."""
        ...
