"""Curved triangles of any order whose boundary nodes lie on the true curve.

Each curved edge moves the nodes of its cell by a polynomial of the order of the map itself: with
the displacement d(t) of the edge from its chord, d vanishes at both ends, so
``d = t (1 - t) g(2 t - 1)`` with g a polynomial of degree order - 2, and the cell is moved by
``lambda_a lambda_b g(lambda_b - lambda_a)``.  This is the hierarchical extension of
high-order finite elements (Szabo and Babuska 1991); being a polynomial it is smooth up to the
opposite corner, which is what high degrees need to converge.
"""

from __future__ import annotations

import numpy as np

from nanorom.fem.solvers.compat import reference_element

EDGES = ((1, 2), (0, 2), (0, 1))  # local vertices of the reference triangle's edges


def edge_fractions(order: int) -> np.ndarray:
    """Fractions (order - 1,) along an edge at which its interior nodes lie."""
    return np.arange(1, order) / order


def reference_nodes(order: int) -> np.ndarray:
    """Barycentric coordinates (n, 3) of the nodes of the coordinate element, in its order."""
    points = np.asarray(reference_element(order, equispaced=True).points)
    return np.column_stack([1 - points.sum(axis=1), points])


def turned_over(order: int) -> np.ndarray:
    """Order of a cell's nodes (n,) in which its second and third vertex have changed places."""
    nodes = np.rint(order * reference_nodes(order)).astype(int).tolist()
    place = {tuple(node): i for i, node in enumerate(nodes)}
    return np.array([place[a, c, b] for a, b, c in nodes])


def number_nodes(triangles: np.ndarray, n_vertices: int, order: int) -> tuple[np.ndarray, int]:
    """Number the nodes of order-``order`` triangles so that neighbours share them.

    ``triangles`` (c, 3) are vertex numbers below ``n_vertices``.  Returns the node numbers
    (c, (order + 1)(order + 2)/2) in the coordinate element's order and how many there are.
    """
    n_cells, inside = len(triangles), order - 1
    n_nodes = (order + 1) * (order + 2) // 2
    cells = np.empty((n_cells, n_nodes), dtype=np.int64)
    cells[:, :3] = triangles
    ends = np.stack([triangles[:, pair] for pair in EDGES], axis=1)  # (c, 3, 2)
    _, edges = np.unique(np.sort(ends, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    edges = edges.reshape(n_cells, 3)
    along = np.arange(inside)
    for local in range(3):
        forward = (ends[:, local, 0] < ends[:, local, 1])[:, None]
        position = np.where(forward, along, inside - 1 - along)
        columns = slice(3 + local * inside, 3 + (local + 1) * inside)
        cells[:, columns] = n_vertices + edges[:, local, None] * inside + position
    first = n_vertices + (edges.max() + 1) * inside
    n_interior = n_nodes - 3 - 3 * inside
    cells[:, 3 + 3 * inside :] = first + np.arange(n_cells * n_interior).reshape(n_cells, -1)
    return cells, int(first + n_cells * n_interior)


def curve_cells(
    corners: np.ndarray, edge_points: dict[tuple[int, int], np.ndarray], order: int
) -> np.ndarray:
    """Node coordinates (c, n, 2) of triangles with corners (c, 3, 2) and some curved edges.

    ``edge_points[cell, local_edge]`` (order - 1, 2) are points of the true curve at
    `edge_fractions`, from the edge's first to its second local vertex.
    """
    barycentric = reference_nodes(order)
    nodes = np.einsum("na,cad->cnd", barycentric, corners)
    fractions = edge_fractions(order)[:, None]
    for local, (a, b) in enumerate(EDGES):
        lift = _extension(barycentric[:, a], barycentric[:, b], order)
        for (cell, edge), curve in edge_points.items():
            if edge == local:
                chord = (1 - fractions) * corners[cell, a] + fractions * corners[cell, b]
                nodes[cell] += lift @ (curve - chord)
    return nodes


def folded(places: np.ndarray, order: int) -> int:
    """How many cells with nodes (c, n, 2) fold over: their map turns round somewhere inside."""
    points = reference_nodes(order)[:, 1:]
    basis = np.asarray(reference_element(order, equispaced=True).tabulate(1, points))
    slopes = np.einsum("kqn,cnd->cqdk", basis.reshape(3, len(points), -1)[1:], places)
    turns = np.sign(np.linalg.det(slopes))
    return int(np.sum((turns != turns[:, :1]).any(axis=1)))


def polar_cells(corners: np.ndarray, order: int) -> np.ndarray:
    """Node coordinates (c, n, 2) of cells that are triangles in radius and angle."""
    barycentric = reference_nodes(order)
    radius = np.linalg.norm(corners, axis=2)
    angle = np.arctan2(corners[..., 1], corners[..., 0])
    angle = np.unwrap(angle, axis=1)
    r, theta = radius @ barycentric.T, angle @ barycentric.T
    return np.stack([r * np.cos(theta), r * np.sin(theta)], axis=2)


def _extension(a: np.ndarray, b: np.ndarray, order: int) -> np.ndarray:
    """Matrix (n, order - 1) from an edge's displacements to those of all nodes of its cell."""
    t = edge_fractions(order)
    vandermonde = np.polynomial.legendre.legvander
    bubble = (a * b)[:, None]
    to_coefficients = np.linalg.inv(vandermonde(2 * t - 1, order - 2))
    return bubble * vandermonde(b - a, order - 2) @ (to_coefficients / (t * (1 - t)))
