"""Meshes of gmsh geometries and mesh files, read with their physical curves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.errors import MeshError
from nanorom.fem.mesh import curved, vetting
from nanorom.fem.mesh.corners import Corners, Triangulation
from nanorom.fem.symmetry import AXES, OPPOSITE, Mirrors, line

Placement = Callable[[np.ndarray], np.ndarray]  # points (n, 2) of a flat mesh -> (n, 3)
MESHES = Path(__file__).parents[2] / "meshes"  # geometry files of the package
ON_MIRROR = 1e-9  # of the film's size: points nearer to a mirror lie on it


@attrs.frozen
class Grading:
    """Moves the vertices of a uniform mesh to where small cells are needed.

    move: (n, 2) -> (n, 2); polar: cells beyond this radius of the moved mesh are linear in polar
    coordinates, so that thin rings of wide cells stay valid; within it all edges are straight.
    """

    move: Callable[[np.ndarray], np.ndarray]
    polar: float = np.inf

    def is_beyond(self, points: np.ndarray) -> np.ndarray:
        """Whether points (..., 2) lie on the polar radius or beyond it."""
        return np.linalg.norm(points, axis=-1) > self.polar * (1 - ON_MIRROR)


@attrs.frozen
class MeshData:
    """A mesh as plain arrays: what gmsh gave, before it is distributed.

    points: (n, 2), or (n, 3) of a surface in space; cells: (c, nodes) in the coordinate element's
    order; order: of the map; facets: physical curve -> vertex pairs (m, 2).
    """

    points: np.ndarray
    cells: np.ndarray
    order: int
    facets: Mapping[str, np.ndarray]

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


def load(
    file: Path,
    parameters: Mapping[str, float],
    order: int,
    grading: Grading | None = None,
    size_factor: float = 1.0,
    corners: Corners | None = None,
    in_space: bool = False,
) -> MeshData:
    """Run gmsh on a file; one process only. Raises MeshError with gmsh's own last message."""
    if file.parent != MESHES:
        vetting.check(file)
    gmsh = vetting.start()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.CharacteristicLengthFactor", size_factor)
        gmsh.onelab.clear()
        for name, value in parameters.items():
            gmsh.onelab.setNumber(f"Parameters/{name}", [float(value)])
        try:
            gmsh.open(str(file))
            if len(gmsh.model.mesh.getNodes()[0]) == 0:
                gmsh.model.mesh.generate(2)
                if len(gmsh.model.mesh.getElements(2)[0]) == 0:
                    raise MeshError(f"{file}: no surface in it, or cut short; a film is a surface")
                if not in_space:
                    return _from_geometry(gmsh, file, order, grading, corners)
                gmsh.model.mesh.setOrder(order)
            return _from_mesh(gmsh, file, in_space)
        except MeshError:
            raise
        except Exception as error:  # gmsh raises bare Exception
            raise MeshError(f"{file}: gmsh cannot mesh it: {error}") from error
    finally:
        gmsh.finalize()


def _from_geometry(
    gmsh: Any, file: Path, order: int, grading: Grading | None, corners: Corners | None
) -> MeshData:
    """Straight triangles of the model just meshed, curved to ``order`` on its curves."""
    vertex, points = _vertices(gmsh)
    triangles = _elements(gmsh, 2, vertex)
    _check(points, triangles, file)
    points = points.copy()
    edges = {tag: _curve_edges(gmsh, tag, vertex, points) for _, tag in gmsh.model.getEntities(1)}
    if grading is not None:
        points = grading.move(points)
    if corners is not None:
        named = _named(gmsh, {tag: pairs for tag, (pairs, _) in edges.items()})
        straight = [tag for tag in edges if gmsh.model.getType(1, tag) == "Line"]
        mesh = Triangulation(points, triangles, edges).graded(corners, named, straight)
        points, triangles, edges = mesh.points, mesh.triangles, mesh.edges
        for tag, (pairs, spans) in edges.items():
            if gmsh.model.getType(1, tag) != "Line" and len(pairs):
                on_curve = _on_curve(gmsh, tag, spans)
                moved = grading.move(on_curve.reshape(-1, 2)) if grading else on_curve
                points[pairs] = moved.reshape(on_curve.shape)
    facets = _named(gmsh, {tag: pairs for tag, (pairs, _) in edges.items()})
    if order == 1:
        return MeshData(points, triangles, 1, facets)
    edge_points = {}
    for (i, j), curve in _edge_curves(gmsh, edges, order):
        if grading is not None:
            curve = grading.move(curve)
            if not grading.is_beyond(curve).all():
                continue
        edge_points[i, j] = curve
    cells, n_nodes = curved.number_nodes(triangles, len(points), order)
    vertices = points[triangles]
    places = curved.curve_cells(vertices, _by_cell(triangles, edge_points), order)
    if grading is not None:
        ring = grading.is_beyond(vertices).all(axis=1)
        places[ring] = curved.polar_cells(vertices[ring], order)
    nodes = np.empty((n_nodes, 2))
    nodes[cells] = places
    _check_maps(places, order, file)
    return MeshData(nodes, cells, order, facets)


def _check_maps(places: np.ndarray, order: int, file: Path) -> None:
    """Refuse curved cells that fold over; straight ones were checked before."""
    folded = curved.folded(places, order)
    if folded:
        raise MeshError(
            f"{file}: {folded} of {len(places)} curved cells fold over; make the cells smaller "
            "where the boundary is curved"
        )


def _edge_curves(
    gmsh: Any, edges: Mapping[int, tuple[np.ndarray, np.ndarray]], order: int
) -> Iterator[tuple[tuple[int, int], np.ndarray]]:
    """Vertex pair of every edge on a curve that is no line, and the curve's points between."""
    for tag, (pairs, spans) in edges.items():
        if gmsh.model.getType(1, tag) == "Line" or len(pairs) == 0:
            continue
        t = spans[:, :1] + (spans[:, 1:] - spans[:, :1]) * curved.edge_fractions(order)
        yield from zip(map(tuple, pairs.tolist()), _on_curve(gmsh, tag, t))


def _on_curve(gmsh: Any, tag: int, t: np.ndarray) -> np.ndarray:
    """Points (..., 2) of a model curve at parameters (...)."""
    points = np.reshape(gmsh.model.getValue(1, tag, t.ravel()), (*t.shape, 3))
    return points[..., :2]


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


def _from_mesh(gmsh: Any, file: Path, in_space: bool) -> MeshData:
    """Triangles of any order as they stand in a mesh file."""
    types, _, node_lists = gmsh.model.mesh.getElements(2)
    if len(types) == 0:
        raise MeshError(f"{file}: no triangles in it; a film is a mesh of triangles")
    if len(types) > 1:
        names = ", ".join(gmsh.model.mesh.getElementProperties(t)[0] for t in types)
        raise MeshError(f"{file}: elements of several kinds ({names}); give triangles of one order")
    name, _, order, n_nodes, local, _ = gmsh.model.mesh.getElementProperties(types[0])
    if not name.startswith("Triangle"):
        raise MeshError(f"{file}: elements are {name}; give triangles")
    local = np.reshape(local, (n_nodes, -1))[:, :2]
    ours = curved.reference_nodes(order)[:, 1:]
    distance = np.linalg.norm(ours[:, None] - local[None], axis=2)
    node, points = _vertices(gmsh, np.unique(node_lists[0]), in_space)
    cells = node[np.reshape(node_lists[0], (-1, n_nodes)).astype(np.int64)]
    cells = cells[:, distance.argmin(axis=1)]
    _check(points, cells[:, :3], file)
    if not in_space:
        _check_maps(points[cells], int(order), file)
    edges = {tag: _elements(gmsh, 1, node, tag) for _, tag in gmsh.model.getEntities(1)}
    return MeshData(points, cells, int(order), _named(gmsh, edges))


def _vertices(
    gmsh: Any, triangles: np.ndarray | None = None, in_space: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Map from gmsh node tag to our number, and the coordinates of the numbered nodes."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    coordinates = np.reshape(coordinates, (-1, 3))
    if triangles is None:
        triangles = np.unique(np.concatenate(gmsh.model.mesh.getElements(2)[2]))
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[triangles.astype(np.int64)] = np.arange(len(triangles))
    used = number[tags.astype(np.int64)] >= 0
    points = np.empty((len(triangles), 3))
    points[number[tags[used].astype(np.int64)]] = coordinates[used]
    if in_space:
        return number, points
    if np.ptp(points[:, 2]) > 1e-9 * np.ptp(points, axis=0).max():
        raise MeshError(
            "the mesh is not flat: its z coordinates vary; give a mesh in z = 0, or take "
            "plate.model = shell"
        )
    return number, np.ascontiguousarray(points[:, :2])


def _elements(gmsh: Any, dimension: int, number: np.ndarray, tag: int = -1) -> np.ndarray:
    """Vertex numbers of all elements of a dimension, corners only."""
    corners = []
    for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, tag)):
        n_nodes = gmsh.model.mesh.getElementProperties(kind)[3]
        corners.append(np.reshape(nodes, (-1, n_nodes))[:, : dimension + 1].astype(np.int64))
    if not corners:
        return np.empty((0, dimension + 1), dtype=np.int64)
    return number[np.concatenate(corners)]


def _curve_edges(
    gmsh: Any, tag: int, number: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Edges (m, 2) of a model curve and their parameter spans (m, 2).

    The vertices are put exactly onto the curve: gmsh's own are right to 1e-9 only.
    """
    pairs = _elements(gmsh, 1, number, tag)
    tags, _, parameters = gmsh.model.mesh.getNodes(1, tag, True, True)
    if len(pairs) == 0:
        return pairs, np.empty((0, 2))
    low, high = (float(bound[0]) for bound in gmsh.model.getParametrizationBounds(1, tag))
    t = np.full(number.max() + 1, np.nan)
    t[number[tags.astype(np.int64)]] = parameters
    spans = t[pairs]
    inner = (spans > low) & (spans < high)
    points[pairs[inner]] = _on_curve(gmsh, tag, spans[inner])
    # on a closed curve the seam's vertex has two parameters: take the one on its edge's side
    far = np.abs(spans[:, 0] - spans[:, 1]) > 0.5 * (high - low)
    if len(pairs) > 2:
        at_seam = np.isclose(spans, low) | np.isclose(spans, high)
        flip = far[:, None] & at_seam
        spans = np.where(flip, low + high - spans, spans)
    return pairs, spans


def _named(gmsh: Any, edges: Mapping[int, np.ndarray]) -> dict[str, np.ndarray]:
    """Vertex pairs of every named physical curve."""
    facets = {}
    for dimension, group in gmsh.model.getPhysicalGroups(1):
        name = gmsh.model.getPhysicalName(dimension, group) or str(group)
        curves = gmsh.model.getEntitiesForPhysicalGroup(dimension, group)
        facets[name] = np.concatenate([edges[curve] for curve in curves])
    return facets


def _check(points: np.ndarray, triangles: np.ndarray, file: Path) -> None:
    """Refuse meshes that give nonsense later: inverted or flat cells, several parts."""
    if not np.isfinite(points).all():
        raise MeshError(f"{file}: a node's coordinates are not finite; mend the mesh")
    edges = np.sort(triangles[:, np.array(curved.EDGES)], axis=2).reshape(-1, 2)
    crowded = int((np.unique(edges, axis=0, return_counts=True)[1] > 2).sum())
    if crowded:
        raise MeshError(
            f"{file}: {crowded} edges belong to more than two triangles; a film has no such edges"
        )
    x = points[triangles]
    side = x[:, 1:] - x[:, :1]
    if points.shape[1] == 2:
        area = 0.5 * (side[:, 0, 0] * side[:, 1, 1] - side[:, 0, 1] * side[:, 1, 0])
    else:
        area = 0.5 * np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1)
        _check_sides(triangles, file)
    bad = np.abs(area) < 1e-12 * np.ptp(points, axis=0).max() ** 2
    if bad.any():
        raise MeshError(f"{file}: {bad.sum()} of {len(area)} triangles have no area; mend the mesh")
    if (area > 0).any() and (area < 0).any():
        n = min((area > 0).sum(), (area < 0).sum())
        raise MeshError(f"{file}: {n} of {len(area)} triangles are inverted; mend the mesh")
    parts = _parts(triangles, len(points))
    if parts > 1:
        raise MeshError(f"{file}: the mesh falls into {parts} separate parts; give one film")


def _check_sides(triangles: np.ndarray, file: Path) -> None:
    """Refuse a surface in space whose triangles do not agree on their upper side."""
    edges = triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2)
    _, count = np.unique(edges, axis=0, return_counts=True)
    if (count > 1).any():
        raise MeshError(
            f"{file}: {(count > 1).sum()} edges run the same way in two triangles: the surface has "
            "no side that is up everywhere; reverse some of its surfaces, and let it not branch"
        )


def _parts(triangles: np.ndarray, n_points: int) -> int:
    """Number of connected parts of a triangulation."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    links = np.concatenate([triangles[:, (0, 1)], triangles[:, (1, 2)]])
    graph = coo_matrix((np.ones(len(links)), links.T), shape=(n_points, n_points))
    used = np.unique(triangles)
    return int(connected_components(graph.tocsr()[used][:, used], directed=False)[0])
