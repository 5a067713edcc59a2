"""From a scene to its meshed plate: mesh, supports and scaled parameters."""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import compat, groups
from nanorom.fem.solvers.multigrid import Solvers
from nanorom.fem.symmetry import Mirrors, line
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene
from nanorom.scene.support import Kind, Spring

STRAIGHT = 1e-12  # of squares of the film's size: points nearer to a line lie on it
FREE_EDGE_PULL = 1e-6  # of the tension: less is the rounding of an edge's direction


def build_plate(
    comm: MPI.Comm,
    scene: Scene,
    scales: Scales,
    chosen: Discretisation,
    across: MPI.Comm = MPI.COMM_SELF,
) -> Plate:
    """Mesh the scene and set up its plate with the scaled parameters. Collective.

    across : the ranks of this one's number in other groups of ranks.
    """
    whole, part = (chosen.mirrors, Mirrors()) if chosen.whole else (Mirrors(), chosen.mirrors)
    domain = mesh.build(
        comm,
        chosen.file,
        chosen.parameters,
        chosen.order,
        chosen.grading,
        whole,
        chosen.size_factor,
        chosen.corners,
    )
    domain = attrs.evolve(domain, across=across)
    groups.check_alike(across, domain.mesh.geometry.x)
    kinds = boundary_kinds(scene, list(domain.facets), part)
    check_boundary(scene, domain, kinds)
    check_turning(domain, kinds, part)
    springs = {
        side: (
            None if kind.spring is None else kind.spring * scales.length / scales.tension,
            kind.rotational / (scales.length * scales.tension),
        )
        for side, kind in kinds.items()
        if isinstance(kind, Spring)
    }
    return Plate.on(
        domain,
        chosen.degree,
        clamped=[side for side, kind in kinds.items() if kind == "clamped"],
        pinned=[side for side, kind in kinds.items() if kind == "simply_supported"],
        stiffness=Stiffness(
            scales.bending, 1.0, scene.material.poisson_ratio, springs, scales.strain
        ),
        state=State((scene.tension.x / scales.tension, scene.tension.y / scales.tension)),
        mirrors=part,
        solvers=Solvers(scene.reduction.solver),
    )


def pulls_at_free_edge(plate: Plate) -> bool:
    """Whether a constant tension pulls at a free edge: it would not stay there. Collective."""
    surface = plate.domain.mesh
    mirrors = plate.domain.facets_of([line(axis) for axis in plate.mirrors.axes])
    free = np.setdiff1d(compat.exterior_facets(surface), np.union1d(plate.supported, mirrors))
    ends = surface.geometry.x[compat.facet_vertices(surface, free), :2]
    along = ends[:, 1] - ends[:, 0]
    normal = along[:, ::-1] / np.linalg.norm(along, axis=1, keepdims=True)
    pull = np.abs(normal * plate.state.tension)
    return max(plate.domain.comm.allgather(pull.max(initial=0.0))) > FREE_EDGE_PULL


def boundary_kinds(scene: Scene, tags: list[str], mirrors: Mirrors) -> dict[str, Kind]:
    """Kind of support of every boundary curve of the mesh but the mirrors; raises SceneError."""
    tags = [tag for tag in tags if tag not in map(line, mirrors.axes)]
    for side in scene.support.named:
        if side not in tags and isinstance(scene.geometry, MeshFile):
            raise SceneError(
                f"support.{side}: the mesh has no boundary of that name; "
                f"allowed: {', '.join(sorted(tags)) or 'none, as it has no physical curves'}"
            )
    kinds = {tag: scene.support.kind(tag) for tag in tags}
    if all(kind == "free" for kind in kinds.values()):
        raise SceneError(
            "support: no boundary of the mesh is held; name a physical curve of the mesh "
            "and give it a kind"
        )
    return kinds


def check_boundary(scene: Scene, domain: mesh.Domain, kinds: dict[str, Kind]) -> None:
    """Raise SceneError if a mesh file leaves open how its film is held. Collective."""
    exterior = compat.exterior_facets(domain.mesh)
    tagged = domain.facets_of(list(domain.facets))
    open_edges = len(np.setdiff1d(exterior, tagged))
    total, open_edges = domain.comm.allreduce(np.array([len(exterior), open_edges]))
    if open_edges and scene.support.default != "free":
        raise SceneError(
            f"support: {open_edges} of {total} edges of the boundary have no physical curve: are "
            "they held? Give them one, or name the held curves in a table"
        )
    n_owned = domain.mesh.topology.index_map(1).size_local
    for name, kind in kinds.items():
        own = domain.facets[name][domain.facets[name] < n_owned]
        inside = domain.comm.allreduce(len(np.setdiff1d(own, exterior)))
        if inside and kind not in ("simply_supported", "free"):
            raise SceneError(
                f"support.{name}: {inside} of its edges lie inside the film; allowed there: "
                "simply_supported | free"
            )


def check_turning(domain: mesh.Domain, kinds: dict[str, Kind], mirrors: Mirrors) -> None:
    """Raise SceneError if the film can turn about a straight line that alone holds it. Collective.

    What tension there is across the line relaxes: it resists no such motion.
    """
    held = []
    for name, kind in kinds.items():
        if kind == "clamped" or isinstance(kind, Spring) and kind.rotational > 0:
            return
        if kind != "free":
            held.append(name)
    vertices = compat.facet_vertices(domain.mesh, domain.facets_of(held))
    points = domain.mesh.geometry.x[np.unique(vertices), :2]
    points, _ = mirrors.unfold(points, np.empty((0, len(points))), [])
    motions = np.column_stack([np.ones(len(points)), points])
    gram = domain.comm.allreduce(motions.T @ motions)
    squares = np.linalg.eigvalsh(gram)
    if squares[0] < STRAIGHT * squares[-1]:
        raise SceneError(
            f"support: found {' and '.join(held)}, which leave the film free to turn about a "
            "straight line; clamp it there or hold another side"
        )
