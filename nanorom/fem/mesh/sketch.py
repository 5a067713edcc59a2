"""Straight triangles that know on which curves their edges lie, made into cells of any order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

import attrs
import numpy as np

from nanorom.errors import MeshError
from nanorom.fem.mesh import curved
from nanorom.fem.mesh.arrays import ON_MIRROR, MeshData
from nanorom.fem.mesh.corners import Corners, Triangulation


@attrs.frozen(eq=False)
class Curve:
    """A curve of the geometry and the edges of the mesh that lie on it.

    pairs: their vertices (m, 2); names: physical curves that it belongs to; spans: its parameter
    at these vertices (m, 2); at: parameters (...) -> points (..., 2), None for a straight line.
    """

    pairs: np.ndarray
    names: tuple[str, ...] = ()
    spans: np.ndarray = attrs.Factory(lambda self: np.zeros(self.pairs.shape), takes_self=True)
    at: Callable[[np.ndarray], np.ndarray] | None = None


@attrs.frozen(eq=False)
class Sketch:
    """Straight triangles (c, 3) of points (n, 2), and the curves between them.

    polar: cells beyond this radius are linear in polar coordinates, so that thin rings of wide
    cells stay valid; within it all edges are straight.  None: edges on curves are curved.
    surfaces: physical surface -> which triangles (c,) are of it.
    """

    points: np.ndarray
    triangles: np.ndarray
    curves: tuple[Curve, ...]
    polar: float | None = None
    surfaces: Mapping[str, np.ndarray] = attrs.field(factory=dict)

    def mesh(self, order: int, corners: Corners | None, name: str) -> MeshData:
        """Cells of an order on the true curves; raises MeshError, for a shape of that name."""
        return (self._graded(corners) if corners else self)._of_order(order, name)

    def _graded(self, corners: Corners) -> Sketch:
        edges = {i: (curve.pairs, curve.spans) for i, curve in enumerate(self.curves)}
        straight = [i for i, curve in enumerate(self.curves) if curve.at is None]
        cut = Triangulation(self.points, self.triangles, edges)
        cut = cut.graded(corners, facets_of(self.curves), straight)
        points, curves = cut.points.copy(), []
        for i, curve in enumerate(self.curves):
            pairs, spans = cut.edges[i]
            if curve.at is not None and len(pairs):
                points[pairs] = curve.at(spans)
            curves.append(attrs.evolve(curve, pairs=pairs, spans=spans))
        surfaces = {name: inside[cut.parents] for name, inside in self.surfaces.items()}
        return Sketch(points, cut.triangles, tuple(curves), self.polar, surfaces)

    def _of_order(self, order: int, name: str) -> MeshData:
        if order == 1:
            return MeshData(self.points, self.triangles, 1, facets_of(self.curves), self.surfaces)
        cells, n_nodes = curved.number_nodes(self.triangles, len(self.points), order)
        vertices = self.points[self.triangles]
        on_curves = _by_cell(self.triangles, dict(self._curved_edges(order)))
        places = curved.curve_cells(vertices, on_curves, order)
        ring = self._is_beyond(vertices).all(axis=1)
        places[ring] = curved.polar_cells(vertices[ring], order)
        nodes = np.empty((n_nodes, 2))
        nodes[cells] = places
        check_maps(places, order, name)
        return MeshData(nodes, cells, order, facets_of(self.curves), self.surfaces)

    def _curved_edges(self, order: int) -> Iterator[tuple[tuple[int, int], np.ndarray]]:
        """Vertex pair of every edge that is curved, and the curve's points between."""
        for curve in self.curves:
            if curve.at is None or len(curve.pairs) == 0:
                continue
            first, last = curve.spans[:, :1], curve.spans[:, 1:]
            points = curve.at(first + (last - first) * curved.edge_fractions(order))
            if self.polar is None or self._is_beyond(points).all():
                yield from zip(map(tuple, curve.pairs.tolist()), points)

    def _is_beyond(self, points: np.ndarray) -> np.ndarray:
        """Whether points (..., 2) lie on the polar radius or beyond it."""
        radius = np.inf if self.polar is None else self.polar * (1 - ON_MIRROR)
        return np.asarray(np.linalg.norm(points, axis=-1) > radius)


def facets_of(curves: Iterable[Curve]) -> dict[str, np.ndarray]:
    """Vertex pairs (m, 2) of every named physical curve."""
    found: dict[str, list[np.ndarray]] = {}
    for curve in curves:
        for name in curve.names:
            found.setdefault(name, []).append(curve.pairs)
    return {name: np.concatenate(pairs) for name, pairs in found.items()}


def check_maps(places: np.ndarray, order: int, name: str) -> None:
    """Raise MeshError for curved cells that fold over; straight ones are checked elsewhere."""
    folded = curved.folded(places, order)
    if folded:
        raise MeshError(
            f"{name}: {folded} of {len(places)} curved cells fold over; make the cells smaller "
            "where the boundary is curved"
        )


def _by_cell(
    triangles: np.ndarray, edge_points: Mapping[tuple[int, int], np.ndarray]
) -> dict[tuple[int, int], np.ndarray]:
    """Points on edges by cell and local edge, in the edge's direction within the cell."""
    found = {}
    for local, (a, b) in enumerate(curved.EDGES):
        for cell, (i, j) in enumerate(triangles[:, (a, b)].tolist()):
            if (i, j) in edge_points:
                found[cell, local] = edge_points[i, j]
            elif (j, i) in edge_points:
                found[cell, local] = edge_points[j, i][::-1]
    return found
