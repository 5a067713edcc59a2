"""Meshes of gmsh geometries and mesh files, read with their physical curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.errors import MeshError
from nanorom.fem.mesh import curved, vetting
from nanorom.fem.mesh.arrays import MeshData
from nanorom.fem.mesh.corners import Corners
from nanorom.fem.mesh.sketch import Curve, Sketch, check_maps, facets_of

MESHES = Path(__file__).parents[2] / "meshes"  # geometry files of the package


@attrs.frozen
class GmshFile:
    """A ``.geo`` with its parameters, or a ``.msh``, which keeps its cells.

    size_factor: of the cells that the file asks for; in_space: it is a surface in space.
    """

    path: Path
    parameters: Mapping[str, float] = attrs.field(factory=dict)
    size_factor: float = 1.0
    in_space: bool = False

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def cells(self) -> None:
        return None

    def mesh(self, order: int, corners: Corners | None = None) -> MeshData:
        """Run gmsh on the file; one process only. Raises MeshError with gmsh's last message."""
        with opened(self.path, self.parameters, self.size_factor) as gmsh:
            return self._read(gmsh, order, corners)

    def _read(self, gmsh: Any, order: int, corners: Corners | None) -> MeshData:
        if len(gmsh.model.mesh.getNodes()[0]) == 0:
            gmsh.model.mesh.generate(2)
            if len(gmsh.model.mesh.getElements(2)[0]) == 0:
                raise MeshError(f"{self.path}: no surface in it, or cut short; a film is a surface")
            if not self.in_space:
                return sketch(gmsh, self.path).mesh(order, corners, str(self.path))
            gmsh.model.mesh.setOrder(order)
        return _from_mesh(gmsh, self.path, self.in_space)


@contextmanager
def opened(path: Path, parameters: Mapping[str, float], size_factor: float) -> Iterator[Any]:
    """Gmsh with a file open, its parameters set and its cells scaled; raises MeshError."""
    if path.parent != MESHES:
        vetting.check(path)
    with vetting.session(f"{path}: gmsh cannot mesh it") as gmsh:
        gmsh.option.setNumber("Mesh.CharacteristicLengthFactor", size_factor)
        gmsh.onelab.clear()
        for parameter, value in parameters.items():
            gmsh.onelab.setNumber(f"Parameters/{parameter}", [float(value)])
        gmsh.open(str(path))
        yield gmsh


def sketch(gmsh: Any, file: Path) -> Sketch:
    """Straight triangles, curves and surfaces of the model just meshed; raises MeshError."""
    vertex, points = _vertices(gmsh)
    triangles = _one_way_round(gmsh, vertex, points)
    _check(points, triangles, file)
    points, names, curves = points.copy(), _names(gmsh), []
    for _, tag in gmsh.model.getEntities(1):
        pairs, spans = _curve_edges(gmsh, tag, vertex, points)
        straight = gmsh.model.getType(1, tag) == "Line"
        at = None if straight else partial(_on_curve, gmsh, tag)
        curves.append(Curve(pairs, names.get(tag, ()), spans, at))
    return Sketch(points, triangles, tuple(curves), surfaces=_surfaces(gmsh, vertex, triangles))


def _on_curve(gmsh: Any, tag: int, t: np.ndarray) -> np.ndarray:
    """Points (..., 2) of a model curve at parameters (...)."""
    points = np.reshape(gmsh.model.getValue(1, tag, t.ravel()), (*t.shape, 3))
    return points[..., :2]


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
        check_maps(points[cells], int(order), str(file))
    physical = _names(gmsh)
    curves = [
        Curve(_elements(gmsh, 1, node, tag), physical.get(tag, ()))
        for _, tag in gmsh.model.getEntities(1)
    ]
    surfaces = _surfaces(gmsh, node, cells[:, :3])
    return MeshData(points, cells, int(order), facets_of(curves), surfaces)


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
            "plate.model = shell, or solid for volumes"
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


def _one_way_round(gmsh: Any, vertex: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Triangles (c, 3) of all surfaces; a surface that is drawn clockwise is turned over."""
    found = []
    for _, tag in gmsh.model.getEntities(2):
        triangles = _elements(gmsh, 2, vertex, tag)
        clockwise = (_areas(points[triangles]) < 0).all()
        found.append(triangles[:, [0, 2, 1]] if clockwise else triangles)
    return np.concatenate(found)


def _areas(corners: np.ndarray) -> np.ndarray:
    """Areas (c,) of triangles with corners (c, 3, 2), negative if these go round clockwise."""
    (x, y), (u, v) = (corners[:, i].T - corners[:, 0].T for i in (1, 2))
    return np.asarray(0.5 * (x * v - y * u))


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


def _names(gmsh: Any) -> dict[int, tuple[str, ...]]:
    """Physical curves that every curve belongs to."""
    found: dict[int, tuple[str, ...]] = {}
    for dimension, group in gmsh.model.getPhysicalGroups(1):
        name = gmsh.model.getPhysicalName(dimension, group) or str(group)
        for curve in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            found[int(curve)] = (*found.get(int(curve), ()), name)
    return found


def _surfaces(gmsh: Any, number: np.ndarray, triangles: np.ndarray) -> dict[str, np.ndarray]:
    """Which triangles (c,) belong to every physical surface, by its name."""
    place = {tuple(corners): i for i, corners in enumerate(np.sort(triangles, axis=1).tolist())}
    found = {}
    for dimension, group in gmsh.model.getPhysicalGroups(2):
        inside = np.zeros(len(triangles), dtype=bool)
        for tag in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            for corners in np.sort(_elements(gmsh, 2, number, int(tag)), axis=1).tolist():
                inside[place[tuple(corners)]] = True
        found[gmsh.model.getPhysicalName(dimension, group) or str(group)] = inside
    return found


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
    if points.shape[1] == 2:
        area = _areas(x)
    else:
        side = x[:, 1:] - x[:, :1]
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
