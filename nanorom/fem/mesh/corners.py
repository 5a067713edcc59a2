"""Cells that shrink geometrically towards corners and towards where a film's support changes.

There stress and curvature are singular, and a uniform mesh converges slowly whatever its degree; on
cells whose size is a share of their distance from the corner high degrees converge exponentially
(Babuska and Guo 1986, doi:10.1007/BF00298649).  Cells are bisected at their longest edges (Rivara
1984, doi:10.1002/nme.1620200412), so that thin ones become as wide as long before they shrink.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import attrs
import numpy as np

from nanorom.fem.mesh.singular import Corner
from nanorom.fem.symmetry import AXES, line
from nanorom.scene.support import Kind

Edges = dict[int, tuple[np.ndarray, np.ndarray]]  # curve -> vertex pairs (m, 2), spans (m, 2)

MIRRORS = tuple(map(line, AXES))
SHARE, SHARE_RATE = 3.2, 10.0  # cell by distance at tolerance 1e-6; errors fall with its power
LARGEST_SHARE = 3.0
CORNER_ERROR = 0.01  # of the energy's singular part where no cell shrinks
AT_POINT = 100.0  # by the root of the tolerance, to which errors at a point mass fall: measured
SMALLEST_MOVING = 0.3  # size of cells that move by that before: rounding grows with them
SINGULAR = 2.5  # exponent of the energy's error up to which they have to shrink further:
SMALLEST_SINGULAR = 1e-3  # to this by the film's slenderness; rounding allows no less
LONGER = 1e-9  # edges that differ by less than this (relative) are as long
STRAIGHT = 1e-3  # radians by which a straight side may turn


@attrs.frozen
class Corners:
    """How to grade: kind of support by name of a curve, Poisson's ratio, tolerance of energies.

    points: x, y inside the film towards which cells shrink too, down to a radius; slenderness:
    length by width, to which cells are made; what bends over the length is the softer for it.
    """

    kind: Callable[[str], Kind]
    nu: float
    tolerance: float
    points: tuple[tuple[float, float, float], ...] = ()
    slenderness: float = 1.0

    @property
    def share(self) -> float:
        """Longest edge of a cell by its distance from the nearest corner."""
        return min(LARGEST_SHARE, SHARE * (self.tolerance / 1e-6) ** (1 / SHARE_RATE))

    @property
    def cells_per_octave(self) -> float:
        """About how many cells halve the size of those at a corner of 90 degrees: counted."""
        return 4.5 if self.share > np.sqrt(2) else 16.0 / self.share

    @property
    def smallest_at_point(self) -> float:
        """Size of the cells at a point of `points` by that before: w has r^2 log r there."""
        return min(1.0, AT_POINT * float(np.sqrt(self.tolerance)))

    def smallest(self, corner: Corner) -> float:
        """Size of the cells at a corner by their size before."""
        exponent = corner.exponent(self.nu)
        size = float((self.tolerance / CORNER_ERROR) ** (1 / exponent))
        if not corner.moves:
            return size
        least = SMALLEST_MOVING
        if exponent < SINGULAR:
            least = min(least, SMALLEST_SINGULAR * self.slenderness)
        return max(size, least)


@attrs.define(eq=False)
class Triangulation:
    """Straight triangles and the edges that lie on curves, to be cut.

    points (n, 2); triangles (c, 3); edges: their spans are of the curve's own parameter; parents:
    (c,) the triangle before any cut that each is a part of.
    """

    points: np.ndarray
    triangles: np.ndarray
    edges: Edges
    parents: np.ndarray = attrs.Factory(lambda self: np.arange(len(self.triangles)), True)

    def graded(
        self, corners: Corners, facets: Mapping[str, np.ndarray], straight: Collection[int] = ()
    ) -> Triangulation:
        """Bisect cells until each is small by its distance from every corner.

        facets: named edges (m, 2), those on mirrors are no supports; straight: curves that are.
        """
        mesh = Triangulation(self.points, self.triangles, dict(self.edges))
        found = self._corners(corners.kind, facets, straight)
        if not found and not corners.points:
            return mesh
        at, inside = sorted(found), np.reshape(corners.points, (-1, 3))
        places = np.concatenate([self.points[at], inside[:, :2]])
        smallest = [mesh._shortest(i) * corners.smallest(found[i]) for i in at]
        for place, radius in zip(inside[:, :2], inside[:, 2]):
            smallest.append(max(radius, mesh._size_at(place) * corners.smallest_at_point))
        while True:
            excess = mesh._excess(places, np.array(smallest), corners.share)
            if excess.max() <= 1:
                return mesh
            mesh._bisect(mesh.triangles[excess.argmax()])

    def _shortest(self, i: int) -> float:
        """Shortest edge of the triangles at a vertex."""
        return float(self._lengths(self.triangles[(self.triangles == i).any(axis=1)]).min())

    def _size_at(self, place: np.ndarray) -> float:
        """Shortest edge of the cell that holds a place, or of the one that is nearest."""
        vertices = self.points[self.triangles]
        here = _holding(vertices, place[None])[:, 0]
        away = np.linalg.norm(vertices.mean(axis=1) - place, axis=1)
        return float(self._lengths(self.triangles[[np.where(here, 0.0, away).argmin()]]).min())

    def _lengths(self, triangles: np.ndarray) -> np.ndarray:
        """Lengths (c, 3) of the edges opposite to each vertex."""
        x = self.points[triangles]
        return np.linalg.norm(x[:, (1, 2, 0)] - x[:, (2, 0, 1)], axis=2)

    def _excess(self, places: np.ndarray, smallest: np.ndarray, share: float) -> np.ndarray:
        """Longest edge of every cell (c,) by the longest that places (m, 2) allow.

        A cell that holds one is at no distance from it.
        """
        vertices = self.points[self.triangles]
        away = np.linalg.norm(vertices[:, :, None] - places, axis=3).min(axis=1)
        away[_holding(vertices, places)] = 0.0
        allowed = np.maximum(share * away, smallest).min(axis=1)
        return np.asarray(self._lengths(self.triangles).max(axis=1) / allowed)

    def _bisect(self, cell: np.ndarray) -> None:
        """Cut a cell's longest edge; where that of its neighbour there is longer, that first."""
        while True:
            lengths = self._lengths(cell[None])[0]
            i, j = np.delete(cell, lengths.argmax())
            here = (self.triangles == i).any(axis=1) & (self.triangles == j).any(axis=1)
            cells = self.triangles[here]
            longest = self._lengths(cells).max(axis=1)
            if longest.max() <= (1 + LONGER) * lengths.max():
                return self._cut(i, j)
            cell = cells[longest.argmax()]

    def _corners(
        self,
        kind: Callable[[str], Kind],
        facets: Mapping[str, np.ndarray],
        straight: Collection[int],
    ) -> dict[int, Corner]:
        """Vertices of the boundary where kinds of support or two straight sides meet."""
        sides = np.sort(self.triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
        edges, count = np.unique(sides, axis=0, return_counts=True)
        kinds: dict[tuple[int, int], Kind] = dict.fromkeys(_pairs(edges[count == 1]), "free")
        for name, facet in facets.items():
            for pair in _pairs(facet):
                if name in MIRRORS:
                    kinds.pop(pair, None)
                else:
                    kinds[pair] = kind(name)
        curves = {pair: tag for tag, (pairs, _) in self.edges.items() for pair in _pairs(pairs)}
        ends: dict[int, list[tuple[int, int]]] = {}
        for pair in kinds:
            for vertex in pair:
                ends.setdefault(vertex, []).append(pair)
        found = {}
        for vertex, pairs in ends.items():
            if len(pairs) < 2:
                continue  # the other edge is on a mirror
            first, last = (kinds[pair] for pair in pairs[:2])
            tags = {curves.get(pair) for pair in pairs}
            angle = self._angle(vertex)
            turns = len(tags) > 1 and tags <= set(straight) and abs(angle - np.pi) > STRAIGHT
            if turns or first != last:
                found[vertex] = Corner(first, last, angle)
        return found

    def _angle(self, vertex: int) -> float:
        """Angle of the film at a vertex of its boundary."""
        at, place = np.nonzero(self.triangles == vertex)
        first, last = (self.points[self.triangles[at, (place + k) % 3]] for k in (1, 2))
        a, b = first - self.points[vertex], last - self.points[vertex]
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        return float(np.abs(np.arctan2(cross, np.sum(a * b, axis=1))).sum())

    def _cut(self, i: int, j: int) -> None:
        """Put a vertex on the middle of an edge; it halves the triangles on both sides."""
        new = len(self.points)
        middle = 0.5 * (self.points[i] + self.points[j])
        self.points = np.concatenate([self.points, middle[None]])
        here = (self.triangles == i).any(axis=1) & (self.triangles == j).any(axis=1)
        cells = self.triangles[here]
        halves = [np.where(cells == end, new, cells) for end in (i, j)]
        self.triangles = np.concatenate([self.triangles[~here], *halves])
        parents = self.parents[here]
        self.parents = np.concatenate([self.parents[~here], parents, parents])
        for tag, (pairs, spans) in self.edges.items():
            cut = (np.sort(pairs, axis=1) == sorted((i, j))).all(axis=1)
            if not cut.any():
                continue
            t = spans[cut].mean(axis=1)
            middles = np.full(len(t), new)
            self.edges[tag] = _halved(pairs, cut, middles), _halved(spans, cut, t)


def _holding(triangles: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Whether triangles (c, 3, 2) hold places (m, 2), as (c, m)."""
    sides = np.roll(triangles, -1, axis=1) - triangles
    to = places[:, None] - triangles[:, None]
    cross = sides[:, None, :, 0] * to[..., 1] - sides[:, None, :, 1] * to[..., 0]
    return np.asarray((cross >= 0).all(axis=2) | (cross <= 0).all(axis=2))


def _halved(ends: np.ndarray, cut: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Ends (m, 2) of edges of which some are cut in the middle."""
    first = np.column_stack([ends[cut, 0], middles])
    second = np.column_stack([middles, ends[cut, 1]])
    return np.concatenate([ends[~cut], first, second])


def _pairs(edges: np.ndarray) -> list[tuple[int, int]]:
    """Edges (m, 2) with the smaller vertex first."""
    return [(int(i), int(j)) for i, j in np.sort(edges, axis=1)]
