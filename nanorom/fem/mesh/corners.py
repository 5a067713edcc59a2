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
EXPONENT = 1.5  # error of the energy ~ (smallest cell)^exponent: clamped against free, 90 degrees


@attrs.frozen
class Corners:
    """How to grade: kind of support by name of a curve; ratio of neighbouring cells; how often."""

    kind: Callable[[str], Kind]
    ratio: float
    levels: int

    @classmethod
    def to_tolerance(cls, kind: Callable[[str], Kind], tolerance: float) -> Corners:
        """Smaller steps for smaller tolerances: cells of one degree resolve only so much each."""
        ratio = min(0.5, 0.3 * (1e-6 / tolerance) ** 0.1)
        return cls(kind, ratio, int(np.ceil(np.log(tolerance) / np.log(ratio) / EXPONENT)))


@attrs.define(eq=False)
class Triangulation:
    """Straight triangles and the edges that lie on curves, to be cut.

    points (n, 2); triangles (c, 3); edges: their spans are of the curve's own parameter.
    """

    points: np.ndarray
    triangles: np.ndarray
    edges: Edges

    def graded(self, corners: Corners, facets: Mapping[str, np.ndarray]) -> Triangulation:
        """Grade towards every vertex where the kind of support changes.

        facets: named edges (m, 2); those on mirrors are not supports.
        """
        mesh = Triangulation(self.points, self.triangles, dict(self.edges))
        places = changes(mesh.triangles, corners.kind, facets)
        for i in places:
            for j in places[places > i]:
                if mesh._neighbours(i, j):
                    mesh._cut(i, j, 0.5)
        for i in places:
            for _ in range(corners.levels):
                for j in np.setdiff1d(mesh.triangles[(mesh.triangles == i).any(axis=1)], i):
                    mesh._cut(i, j, corners.ratio)
        return mesh

    def _neighbours(self, i: int, j: int) -> bool:
        """Whether an edge joins two vertices."""
        here = (self.triangles == i).any(axis=1) & (self.triangles == j).any(axis=1)
        return bool(here.any())

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
    triangles: np.ndarray, kind: Callable[[str], Kind], facets: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Vertices of the boundary at which edges of different kinds meet."""
    sides = np.sort(triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    edges, count = np.unique(sides, axis=0, return_counts=True)
    kinds = dict.fromkeys(_pairs(edges[count == 1]), "free")
    for name, facet in facets.items():
        for pair in _pairs(np.sort(facet, axis=1)):
            if name in MIRRORS:
                kinds.pop(pair, None)
            else:
                # on springs the film moves, and tiny cells would only add rounding errors
                own = kind(name)
                kinds[pair] = "free" if isinstance(own, Spring) else own
    found: dict[int, set[str]] = {}
    for pair, held in kinds.items():
        for vertex in pair:
            found.setdefault(vertex, set()).add(held)
    return np.array(sorted(v for v, own in found.items() if len(own) > 1), dtype=np.int64)


def _pairs(edges: np.ndarray) -> list[tuple[int, int]]:
    return [(int(i), int(j)) for i, j in edges]
