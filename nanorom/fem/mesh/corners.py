"""Cells that shrink geometrically towards the places where a film's support changes.

Where a held edge meets a free one, stress and curvature are singular, and a uniform mesh converges
slowly whatever its degree; on cells that shrink in geometric progression high degrees converge
exponentially (Babuska and Guo 1986, doi:10.1007/BF00298649).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import attrs
import numpy as np

from nanorom.fem.symmetry import AXES, line
from nanorom.scene.support import Kind, Spring

Edges = dict[int, tuple[np.ndarray, np.ndarray]]  # curve -> vertex pairs (m, 2), spans (m, 2)

MIRRORS = tuple(map(line, AXES))
RATIO = 0.7
CORNER_ERROR = 1e-2
STEEPEST = 6.0


@attrs.frozen
class Corners:
    """How to grade: kind of support by name of a curve; ratio of neighbouring cells; how often."""

    kind: Callable[[str], Kind]
    tolerance: float
    nu: float
    square: bool = False
    ratio: float = RATIO

    def smallest(self, kinds: frozenset[str]) -> float:
        """Size of the smallest cells."""
        return float((self.tolerance / CORNER_ERROR) ** (1 / exponent(kinds, self.nu)))


def exponent(kinds: frozenset[str], nu: float) -> float:
    """Error of the energy ~ (smallest cell)^exponent in a corner of 90 degrees.

    Twice the lowest exponent of stress or curvature plus one (Williams 1952, doi:10.1115/1.4010553;
    1951 for plates).
    """
    held = {"clamped", "simply_supported"}
    kappa = (3 - nu) / (1 + nu)
    free = "free" in kinds
    if free and kinds & held:
        found = _root(lambda a, s: s**2 - ((kappa + 1) ** 2 / 4 - a**2) / kappa)
    elif free:
        found = STEEPEST / 2
    else:
        found = _root(lambda a, s: s - a / kappa)
    if kinds == {"free"}:
        found = min(found, _root(lambda a, s: s - a * (1 - nu) / (3 + nu)))
    if kinds == {"free", "clamped"}:
        found = min(found, 1.0)
    return 2 * found


def _root(condition):
    """Lowest root between 0.5 and 2 of a condition on a and sin(a pi/2); 1 where it is complex."""
    a = np.linspace(0.5, 2, 151)
    signs = np.sign(condition(a, np.sin(a * np.pi / 2)))
    turns = np.flatnonzero(signs[:-1] * signs[1:] < 0)
    # a = 1 is rigid rotation
    turns = turns[np.abs(a[turns] - 1) > 0.02]
    return float(a[turns[0]]) if len(turns) else 1.0


@attrs.define(eq=False)
class Triangulation:
    """Straight triangles and the edges that lie on curves, to be cut.

    points (n, 2); triangles (c, 3); edges: their spans are of the curve's own parameter.
    """

    points: np.ndarray
    triangles: np.ndarray
    edges: Edges

    def graded(self, corners: Corners, facets: Mapping[str, np.ndarray]) -> Triangulation:
        """Bisect cells until their size is a share of the distance from the nearest corner.

        facets: named edges (m, 2); those on mirrors are not supports.
        """
        mesh = Triangulation(self.points, self.triangles, dict(self.edges))
        found = changes(mesh.triangles, corners, facets)
        if not found:
            return mesh
        places = np.array(sorted(found), dtype=np.int64)
        first = np.array([mesh._shortest(i) for i in places])
        smallest = first * [corners.smallest(found[i]) for i in places]
        while True:
            large = np.flatnonzero(mesh._excess(places, smallest, corners.ratio) > 1)
            if not len(large):
                return mesh
            mesh._bisect(mesh.triangles[large[0]])

    def _shortest(self, i: int) -> float:
        """Shortest edge of the triangles at a vertex."""
        return float(self._lengths(self.triangles[(self.triangles == i).any(axis=1)]).min())

    def _lengths(self, triangles: np.ndarray) -> np.ndarray:
        """Lengths (c, 3) of the edges opposite to each vertex."""
        x = self.points[triangles]
        return np.linalg.norm(x[:, (1, 2, 0)] - x[:, (2, 0, 1)], axis=2)

    def _excess(self, places: np.ndarray, smallest: np.ndarray, ratio: float) -> np.ndarray:
        """Longest edges (c,) by what is allowed."""
        vertices = self.points[self.triangles]
        away = np.linalg.norm(vertices[:, :, None] - self.points[places], axis=3).min(axis=1)
        allowed = np.maximum(ratio * away, smallest)
        return self._lengths(self.triangles).max(axis=1) / allowed.min(axis=1)

    def _bisect(self, triangle: np.ndarray) -> None:
        """Cut a triangle's longest edge, before it that of its neighbour there if it is longer."""
        while True:
            at = int(self._lengths(triangle[None])[0].argmax())
            i, j = (int(v) for v in np.delete(triangle, at))
            here = (self.triangles == i).any(axis=1) & (self.triangles == j).any(axis=1)
            beside = [t for t in self.triangles[here] if set(t) != set(triangle)]
            length = self._lengths(triangle[None]).max()
            if beside and self._lengths(beside[0][None]).max() > (1 + 1e-9) * length:
                triangle = beside[0]
                continue
            self._cut(i, j, 0.5)
            return

    def _cut(self, i: int, j: int, fraction: float) -> None:
        """Put a vertex on the edge from i to j; it halves the triangles on both sides."""
        new = len(self.points)
        middle = (1 - fraction) * self.points[i] + fraction * self.points[j]
        self.points = np.concatenate([self.points, middle[None]])
        here = (self.triangles == i).any(axis=1) & (self.triangles == j).any(axis=1)
        cells = self.triangles[here]
        halves = [np.where(cells == end, new, cells) for end in (i, j)]
        self.triangles = np.concatenate([self.triangles[~here], *halves])
        for tag, (pairs, spans) in self.edges.items():
            cut = (np.sort(pairs, axis=1) == sorted((i, j))).all(axis=1)
            if not cut.any():
                continue
            share = np.where(pairs[cut, 0] == i, fraction, 1 - fraction)
            t = (1 - share) * spans[cut, 0] + share * spans[cut, 1]
            middles = np.full(len(t), new)
            self.edges[tag] = _halved(pairs, cut, middles), _halved(spans, cut, t)


def _halved(ends: np.ndarray, cut: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Ends (m, 2) of edges of which some are cut in the middle."""
    first = np.column_stack([ends[cut, 0], middles])
    second = np.column_stack([middles, ends[cut, 1]])
    return np.concatenate([ends[~cut], first, second])


def changes(
    triangles: np.ndarray, corners: Corners, facets: Mapping[str, np.ndarray]
) -> dict[int, frozenset[str]]:
    """Vertices of the boundary at which edges of different kinds meet, and their kinds."""
    sides = np.sort(triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    edges, count = np.unique(sides, axis=0, return_counts=True)
    kinds = dict.fromkeys(_pairs(edges[count == 1]), ("", "free"))
    for name, facet in facets.items():
        for pair in _pairs(np.sort(facet, axis=1)):
            if name in MIRRORS:
                kinds.pop(pair, None)
            else:
                own = corners.kind(name)
                kinds[pair] = name, "free" if isinstance(own, Spring) else own
    found: dict[int, set[tuple[str, str]]] = {}
    for pair, held in kinds.items():
        for vertex in pair:
            found.setdefault(vertex, set()).add(held)
    met = {v: frozenset(kind for _, kind in own) for v, own in found.items() if len(own) > 1}
    return {v: own for v, own in met.items() if corners.square or len(own) > 1}


def _pairs(edges: np.ndarray) -> list[tuple[int, int]]:
    return [(int(i), int(j)) for i, j in edges]
