"""Solids in tetrahedra: a flat mesh made thick, or the volumes of a gmsh file.

A triangle made thick is a prism, and every prism is cut into three tetrahedra by the diagonals that
leave the vertex of the smallest number of each of its sides, so that neighbours agree (Dompierre et
al. 1999).  Nodes of higher order lie where the map of the triangle puts them: a solid is as curved
as the film that it is made of.
"""

from __future__ import annotations

import numpy as np

from nanorom.errors import MeshError
from nanorom.fem.mesh.arrays import MeshData
from nanorom.fem.solvers.compat import reference_element

MERGE = 1e-9  # of the solid's size: nearer nodes are one
UPPER, LOWER = "upper", "lower"  # faces of a film made thick
SAMPLES = 20_001  # of the widths of a row
GROWTH = 1.0  # of cells by their distance to an end: each is about twice as long as the last


def barycentric(order: int) -> np.ndarray:
    """Barycentric coordinates (n, 4) of the nodes of a tetrahedron of an order, in its order."""
    points = np.asarray(reference_element(order, True, 3).points)
    return np.column_stack([1 - points.sum(axis=1), points])


def thickened(film: MeshData, thickness: float, layers: int) -> MeshData:
    """A flat mesh made as thick as that, in layers, the film in the middle.

    Its sides keep their names; beside them there are the faces "upper" and "lower".
    """
    n, count = len(film.points), len(film.cells)
    corners = film.cells[:, :3]
    prisms = np.sort(corners, axis=1)  # the diagonals need no more than an order of the vertices
    # vertex i below is i, above i + 3: paths from the first below to the last above
    paths = np.array([(0, 1, 2, 5), (0, 1, 4, 5), (0, 3, 4, 5)])
    local = np.argsort(corners, axis=1)  # of the sorted vertices in the cell
    below = np.arange(layers) * n
    nodes = np.concatenate([prisms, prisms + n], axis=1)[:, paths]  # (c, 3, 4)
    tetrahedra = (below[:, None, None, None] + nodes).reshape(-1, 4)
    points = _places(film, local[:, paths % 3], paths // 3, thickness, layers)
    cells, places = _merged(points.reshape(len(tetrahedra), -1, 3))
    vertex = np.full((layers + 1) * n, -1)
    vertex[tetrahedra] = cells[:, :4]
    facets = {
        name: vertex[_walls(pairs, below, n)].reshape(-1, 3) for name, pairs in film.facets.items()
    }
    facets |= {LOWER: vertex[corners], UPPER: vertex[corners + layers * n]}
    assert len(cells) == 3 * layers * count
    return oriented(MeshData(places, cells, film.order, facets, dimension=3), "the thick film")


def _places(
    film: MeshData, local: np.ndarray, above: np.ndarray, thickness: float, layers: int
) -> np.ndarray:
    """Nodes (layers, c, 3, nodes, 3) of the tetrahedra of every prism.

    local (c, 3, 4): vertices of the triangle below or above which theirs lie; above (3, 4).
    """
    weights = barycentric(film.order)
    shares = np.einsum("nv,ctvk->ctnk", weights, np.eye(3)[local])  # of the triangle's vertices
    height = weights @ above.T  # (nodes, 3), in its layer
    triangle = reference_element(film.order, True)
    basis = np.asarray(triangle.tabulate(0, shares[..., 1:].reshape(-1, 2)))
    basis = basis.reshape(*shares.shape[:3], -1)
    flat = np.einsum("ctnm,cmd->ctnd", basis, film.points[film.cells], optimize=True)
    z = (np.arange(layers)[:, None, None] + height.T) / layers - 0.5  # (layers, 3, nodes)
    points = np.empty((layers, *flat.shape[:3], 3))
    points[..., :2] = flat
    points[..., 2] = thickness * z[:, None]
    return points


def _walls(pairs: np.ndarray, below: np.ndarray, n: int) -> np.ndarray:
    """Triangles (layers, m, 2, 3) of the walls above edges (m, 2), cut as the prisms are."""
    first, last = np.sort(pairs, axis=1).T
    two = np.stack([[first, last, last + n], [first, first + n, last + n]])  # (2, 3, m)
    return below[:, None, None, None] + np.moveaxis(two, 2, 0)


def _merged(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers (c, n) and nodes (N, 3) of cells whose nodes (c, n, 3) are one where they meet.

    Each direction is measured by its own extent: a solid may be thin.
    """
    points = places.reshape(-1, 3)
    extent = np.ptp(points, axis=0)
    grid = np.rint((points - points.min(axis=0)) / (MERGE * extent)).astype(np.int64)
    _, first, number = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return number.reshape(places.shape[:2]), points[first]


def oriented(data: MeshData, name: str) -> MeshData:
    """The mesh, whose cells' maps are checked; raises MeshError, for a mesh of that name."""
    turns = np.sign(determinants(data.points[data.cells], data.order))
    folded = (turns != turns[:, :1]).any(axis=1) | (turns[:, 0] == 0)
    if folded.any():
        raise MeshError(
            f"{name}: {folded.sum()} of {len(folded)} cells are flat or fold over; make the cells "
            "smaller where the surface is curved"
        )
    return data


def determinants(nodes: np.ndarray, order: int) -> np.ndarray:
    """Of the maps of cells with nodes (c, n, 3), at those nodes: (c, n)."""
    points = barycentric(order)[:, 1:]
    basis = np.asarray(reference_element(order, True, 3).tabulate(1, points))
    slopes = np.einsum("kqn,cnd->cqdk", basis.reshape(4, len(points), -1)[1:], nodes)
    return np.asarray(np.linalg.det(slopes))


def row(low: float, high: float, size: float, ends: tuple[float, float]) -> np.ndarray:
    """Places from low to high: cells of at most a size, which shrink to a width at either end."""
    x = np.linspace(low, high, SAMPLES)
    first, last = (min(end, size) for end in ends)
    width = np.minimum(size, first + GROWTH * (x - low))
    width = np.minimum(width, last + GROWTH * (high - x))
    cells = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(x) * (1 / width[1:] + 1 / width[:-1]))])
    count = max(1, int(np.ceil(cells[-1] - 1e-6)))
    places = np.interp(np.linspace(0, cells[-1], count + 1), cells, x)
    places[[0, -1]] = low, high
    return places
