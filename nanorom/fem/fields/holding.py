"""In which directions of its plane a film's nodes are held, and what rigid motions that leaves.

Every edge that holds a direction d adds d d^T to the tensor of its nodes: one of rank two holds
both components, one of rank one the displacement along one direction, whatever the edge's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np
from dolfinx import fem
from mpi4py import MPI

from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Parity

SHARP = 0.07  # ratio of a tensor's eigenvalues where edges meet at 30 degrees: less is one curve
ALONG_AXIS = 1e-9  # of a unit vector: a smaller component is the rounding of an edge's direction
RIGID = 1e-12  # share of its square that supports see of a motion that they leave free
RIGID_KINDS = ("fixed", "normal", "tangential")
SIDES = np.array([[-1.0, 1.0], [0.0, 1.0], [1.0, 0.0]])  # of the reference triangle


@attrs.frozen(eq=False)
class Constraints:
    """What holds a film's nodes in its plane, numbered as the in-plane space does.

    fixed : for each component the nodes (n,) where it is held; turned : nodes (k,) held along
    directions (k, 2) that are none of the axes'; motions : (local nodes, 2, m) rigid motions that
    are left, each of which a pin at one node, among the fixed ones, stops.
    """

    fixed: tuple[np.ndarray, np.ndarray]
    turned: tuple[np.ndarray, np.ndarray]
    motions: np.ndarray


@attrs.frozen(eq=False)
class Holding:
    """How supports hold a film in its plane.

    edges : local facets by what they hold rigidly, "fixed", "normal" or "tangential"; rigid,
    elastic : (local nodes, 3) sums of d d^T (xx, yy, xy) over the edges that hold a direction d;
    known : what they leave of motions by the parity of strains, as far as it has been asked.
    """

    edges: Mapping[str, np.ndarray]
    rigid: np.ndarray
    elastic: np.ndarray
    known: dict[Parity, Constraints] = attrs.field(factory=dict, init=False)

    @classmethod
    def of(
        cls,
        domain: Domain,
        degree: int,
        space: Any,
        kinds: Mapping[str, str],
        springs: Mapping[str, tuple[float, float]],
    ) -> Holding:
        """Of kinds and springs (normal, tangential) by boundary curve. Collective."""

        def over(found: Mapping[str, list[str]]) -> tuple[dict[str, np.ndarray], np.ndarray]:
            facets = {kind: domain.facets_of(names) for kind, names in found.items()}
            return facets, directions(domain, degree, space, facets)

        rigid = {kind: [name for name in kinds if kinds[name] == kind] for kind in RIGID_KINDS}
        stiff = {
            kind: [name for name, spring in springs.items() if spring[i] > 0]
            for i, kind in enumerate(RIGID_KINDS[1:])
        }
        return cls(*over(rigid), over(stiff)[1])


def directions(
    domain: Domain, degree: int, space: Any, edges: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Sums (local nodes, 3) of d d^T (xx, yy, xy) over edges of a vector-valued space. Collective.

    edges : facets by what they hold: "fixed", "normal" or "tangential".
    """
    sums = [fem.Function(space), fem.Function(space)]
    tensors = np.zeros((2, len(sums[0].x.array) // 2, 2))
    for kind, facets in edges.items():
        if not len(facets):
            continue
        nodes, tangent = _edge_nodes(domain, degree, space, facets)
        x, y = tangent.T if kind == "tangential" else (tangent * [1.0, -1.0])[:, ::-1].T
        if kind == "fixed":
            x, y, xy = np.ones(len(nodes)), np.ones(len(nodes)), np.zeros(len(nodes))
        else:
            x, y, xy = x * x, y * y, x * y
        np.add.at(tensors[0], nodes, np.column_stack([x, y]))
        np.add.at(tensors[1], nodes, np.column_stack([xy, 0 * xy]))
    for total, own in zip(sums, tensors):
        total.x.array[:] = own.ravel()
        compat.scatter_reverse_add(total)
        total.x.scatter_forward()
    diagonal, mixed = (total.x.array.reshape(-1, 2) for total in sums)
    return np.column_stack([diagonal, mixed[:, 0]])


def _edge_nodes(
    domain: Domain, degree: int, space: Any, facets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n,) on facets of owned cells, and unit tangents (n, 2) there."""
    mesh = domain.mesh
    mesh.topology.create_connectivity(2, 1)
    n_owned = mesh.topology.index_map(2).size_local
    of_cell = mesh.topology.connectivity(2, 1).array[: 3 * n_owned].reshape(-1, 3)
    reference = np.asarray(compat.reference_element(degree).points)
    distance = np.column_stack([1 - reference.sum(axis=1), reference])
    dofs = compat.cell_dofs(space)
    nodes, tangents = [np.empty(0, dtype=np.int64)], [np.empty((0, 2))]
    for side in range(3):
        cells = np.flatnonzero(np.isin(of_cell[:, side], facets))
        on_side = np.flatnonzero(np.abs(distance[:, side]) < ALONG_AXIS)
        if len(cells):
            tangent = _along(mesh, cells, reference[on_side], SIDES[side]).reshape(-1, 2)
            nodes.append(dofs[cells][:, on_side].ravel())
            tangents.append(tangent / np.linalg.norm(tangent, axis=1, keepdims=True))
    return np.concatenate(nodes), np.concatenate(tangents)


def _along(mesh: Any, cells: np.ndarray, points: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Images (c, q, 2) of a direction in the reference cell at its points (q, 2)."""
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)[cells], :2]
    element = compat.reference_element(compat.degree_of(nodes.shape[1]), equispaced=True)
    slopes = np.asarray(element.tabulate(1, points)).reshape(3, len(points), -1)[1:]
    return np.einsum("kqn,cnd,k->cqd", slopes, nodes, side, optimize=True)


def constraints(space: Any, held: np.ndarray, elastic: np.ndarray) -> Constraints:
    """What tensors (local nodes, 3) of rigid and of elastic supports leave of a film's motions.

    Collective.
    """
    xx, yy, xy = held.T
    middle, radius = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    some, sharp = middle > 0, middle - radius > SHARP * (middle + radius)
    both, one = np.flatnonzero(some & sharp), np.flatnonzero(some & ~sharp)
    angle = 0.5 * np.arctan2(2 * xy[one], xx[one] - yy[one])
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    small = np.abs(direction) < ALONG_AXIS
    fixed = [np.concatenate([both, one[small[:, 1 - axis]]]) for axis in (0, 1)]
    oblique = ~small.any(axis=1)
    motions = np.zeros((len(held), 2, 0))
    if not _fully_held(space, both):
        motions, pins = _motions(space, held + elastic, elastic, fixed, one[oblique])
        fixed = [np.unique(np.concatenate([own, pin])) for own, pin in zip(fixed, pins)]
    return Constraints((fixed[0], fixed[1]), (one[oblique], direction[oblique]), motions)


def _fully_held(space: Any, both: np.ndarray) -> bool:
    """Whether two nodes are held in both components: no rigid motion is left. Collective."""
    return bool(space.mesh.comm.allreduce(np.sum(both < space.dofmap.index_map.size_local)) > 1)


def _motions(
    space: Any,
    tensor: np.ndarray,
    elastic: np.ndarray,
    fixed: list[np.ndarray],
    turned: np.ndarray,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Rigid motions (local nodes, 2, m) that a tensor (local nodes, 3) does not see, and pins.

    Pins are nodes by component that stop them, free ones.  Collective.
    """
    comm, index_map = space.mesh.comm, space.dofmap.index_map
    places = space.tabulate_dof_coordinates()[:, :2]
    motions = np.zeros((len(places), 2, 3))
    motions[:, 0, 0] = motions[:, 1, 1] = 1.0
    motions[:, :, 2] = places[:, ::-1] * [-1.0, 1.0]
    owned = motions[: index_map.size_local]
    x, y = owned[:, 0], owned[:, 1]
    xx, yy, xy = tensor[: index_map.size_local].T[..., None]
    seen = x.T @ (xx * x + xy * y) + y.T @ (xy * x + yy * y)
    seen, square = comm.allreduce(np.array([seen, x.T @ x + y.T @ y]))
    root = np.linalg.inv(np.linalg.cholesky(square))
    values, vectors = np.linalg.eigh(root @ seen @ root.T)
    motions = motions @ (root.T @ vectors[:, values < RIGID])
    barred = np.zeros((len(places), 2), dtype=bool)
    for axis in (0, 1):
        barred[fixed[axis], axis] = True
    barred[turned] = True
    barred[elastic.any(axis=1)] = True
    return motions, _pins(comm, index_map, motions, barred)


def _pins(
    comm: MPI.Comm, index_map: Any, motions: np.ndarray, barred: np.ndarray
) -> list[np.ndarray]:
    """Local nodes by component that stop motions (local nodes, 2, m), one for each. Collective."""
    n_owned = index_map.size_local
    pins: list[list[int]] = [[], []]
    left = np.eye(motions.shape[2])
    numbers = index_map.local_to_global(np.arange(len(motions), dtype=np.int32))
    for _ in range(motions.shape[2]):
        size = np.linalg.norm(motions[:n_owned] @ left, axis=2)
        size[barred[:n_owned]] = 0.0
        best = (0.0, -1, 0, np.zeros(len(left)))
        if size.size:
            node, axis = np.unravel_index(size.argmax(), size.shape)
            best = float(size.max()), int(numbers[node]), int(axis), motions[node, axis]
        _, number, axis, row = max(comm.allgather(best), key=lambda found: found[:2])
        pins[axis] += np.flatnonzero(numbers == number).tolist()
        stopped = row @ left
        left = left @ np.linalg.svd(stopped[None])[2][1:].T
    return [np.array(own, dtype=np.int64) for own in pins]
