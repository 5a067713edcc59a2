"""From a scene to its meshed plate: mesh, supports and scaled parameters."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import attrs
import numpy as np
import ufl
from mpi4py import MPI

from nanorom.errors import AccuracyWarning, SceneError
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.discretisation import Discretisation, dofs_of
from nanorom.fem.models import initial_shape
from nanorom.fem.models.added_mass import PointMass
from nanorom.fem.models.patchwork import Patchwork, located
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import compat, groups
from nanorom.fem.solvers.multigrid import Solvers
from nanorom.fem.symmetry import Mirrors, line
from nanorom.scene import elasticity, plausibility
from nanorom.scene.geometry import MeshFile
from nanorom.scene.region import Section
from nanorom.scene.scene import Scene
from nanorom.scene.support import Kind, PlaneSpring, Spring, deflection_of, in_plane_of
from nanorom.scene.units import with_unit
from nanorom.scene.wrinkles import TENSION_KEY

STRAIGHT = 1e-12  # of squares of the film's size: points nearer to a line lie on it
SOFTEST, STIFFEST = 1e-3, 1e9  # springs by the film's own stiffness: beyond lies rounding
ALIKE = 1e-9  # of the thickness: planes nearer than that are one
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
    domain = mesh.build(comm, chosen.source, chosen.order, whole, chosen.corners)
    if across.size > 1:
        domain = attrs.evolve(domain, across=across)
    groups.check_alike(across, domain.mesh.geometry.x)
    cells = domain.mesh.topology.index_map(2).size_global
    groups.check_fits(dofs_of(cells, chosen.degree), comm)
    if isinstance(scene.geometry, MeshFile):
        low, high = extremes(domain)
        short, long = sorted(scales.length * (high - low))
        plausibility.check(scene, (float(short), float(long)))
    kinds = boundary_kinds(scene, list(domain.facets), part)
    check_boundary(scene, domain, kinds)
    check_turning(domain, kinds, part)
    held = {side: deflection_of(kind) for side, kind in kinds.items()}
    in_plane = {side: in_plane_of(kind) for side, kind in kinds.items()}
    plate = Plate.on(
        domain,
        chosen.degree,
        clamped=[side for side, kind in held.items() if kind == "clamped"],
        pinned=[side for side, kind in held.items() if kind == "simply_supported"],
        stiffness=stiffness_of(scene, scales, held, in_plane),
        state=State(
            (scene.tension.x / scales.tension, scene.tension.y / scales.tension),
            shear=scene.tension.xy / scales.tension,
        ),
        mirrors=part,
        in_plane={
            side: kind if isinstance(kind, str) else "free" for side, kind in in_plane.items()
        },
        solvers=Solvers(scene.reduction.solver),
        masses=[
            PointMass(
                mass.value / scales.mass,
                (mass.position[0] / scales.length, mass.position[1] / scales.length),
                mass.radius / scales.length,
            )
            for mass in scene.masses
        ],
    )
    plate = parted(plate, scene, scales) if scene.regions else plate
    return uneven(plate, scene, scales) if scene.tension.variation is not None else plate


def uneven(plate: Plate, scene: Scene, scales: Scales) -> Plate:
    """A scene's plate with what its tension has from place to place, before that relaxes.

    Collective.  Raises SceneError for a table that does not cover it.
    """
    assert scene.tension.variation is not None
    value = initial_shape.read(scene.tension.variation, plate.domain.comm, TENSION_KEY)
    pull = plate.shape_of(lambda x: value(x * scales.length) / scales.tension)
    beside, before = pull * ufl.Identity(2), plate.state.prestress
    prestress = beside if before is None else before + beside
    return plate.about(attrs.evolve(plate.state, prestress=prestress))


def parted(plate: Plate, scene: Scene, scales: Scales) -> Plate:
    """A scene's plate in its regions, under their tension before it relaxes. Collective.

    Raises SceneError if the mesh does not follow them.
    """
    sections = [
        Section.of(region, scene.plate, scene.material, scene.tension) for region in scene.regions
    ]
    steps = [abs(region.offset) for region in scene.regions]
    if plate.bending and max(steps) > ALIKE * scene.plate.thickness:
        number = steps.index(max(steps))
        step = scene.regions[number].offset
        warnings.warn(
            f"region {number + 1}: its neutral plane lies {with_unit(step, 'm', 3)} above the "
            "film's; that step, which couples bending with stretching, is left out",
            AccuracyWarning,
            stacklevel=2,
        )
    which = located(plate, scene.regions, scales.length)
    patchwork = Patchwork.of(plate, which, sections, scene.material.loss)
    bare = np.array([scene.tension.x, scene.tension.y, scene.tension.xy])
    beyond = np.array([np.zeros(3), *((s.tension - bare) / scales.tension for s in sections)])
    state = plate.state
    if np.any(beyond):
        x, y, xy = (patchwork.field(pull) for pull in beyond.T)
        state = attrs.evolve(state, prestress=ufl.as_matrix([[x, xy], [xy, y]]))
    return attrs.evolve(plate, patchwork=patchwork, state=state)


def stiffness_of(
    scene: Scene,
    scales: Scales,
    held: Mapping[str, str | Spring],
    in_plane: Mapping[str, str | PlaneSpring],
) -> Stiffness:
    """What the film and its elastic edges resist with, in its units."""
    unit = scales.cubic * scales.length  # E h per length
    yielding = {
        side: (kind.normal / unit, kind.tangential / unit)
        for side, kind in in_plane.items()
        if isinstance(kind, PlaneSpring)
    }
    springs = {
        side: (
            None if kind.spring is None else kind.spring * scales.length / scales.tension,
            kind.rotational / (scales.length * scales.tension),
        )
        for side, kind in held.items()
        if isinstance(kind, Spring)
    }
    material, laws = scene.material, {}
    if material.crystalline:
        moments = elasticity.scaled(material.law, material.held_ratio)
        laws = {"crystal": material.law, "moments": moments}
    nu = material.poisson_ratio
    return Stiffness(scales.bending, 1.0, nu, springs, yielding, scales.strain, **laws)


def extremes(domain: mesh.Domain) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner (2,) of what is meshed. Collective."""
    x = domain.mesh.geometry.x[:, :2]
    corners = np.concatenate([-x.min(axis=0), x.max(axis=0)])
    domain.comm.Allreduce(MPI.IN_PLACE, corners, op=MPI.MAX)
    return -corners[:2], corners[2:]


def check_springs(scene: Scene, scales: Scales) -> None:
    """Raise SceneError for springs that cannot be told from none, or from a rigid edge."""
    units = {
        "spring": scales.tension / scales.length,
        "rotational": scales.bending * scales.length * scales.tension,
    }
    for spring in scene.support.springs:
        for key, unit in units.items():
            value, least = getattr(spring, key), SOFTEST * unit if key == "spring" else 0.0
            if value and not least <= value <= STIFFEST * unit > 0:
                what = "a free edge" if value < least else "a rigid one"
                raise SceneError(
                    f"support.{key}: found {value:g}, which no solution tells from {what}; "
                    f"allowed: {least:.1g} to {STIFFEST * unit:.1g}"
                )


def relaxes(plate: Plate) -> bool:
    """Whether the tension before any load is no equilibrium in the plane. Collective.

    It differs from place to place, or pulls at an edge along what nothing rigid holds.
    """
    if plate.state.prestress is not None:
        return True
    surface, edges = plate.domain.mesh, plate.holding.edges
    mirrors = plate.domain.facets_of([line(axis) for axis in plate.mirrors.axes])
    loose = np.setdiff1d(compat.exterior_facets(surface), np.union1d(edges["fixed"], mirrors))
    ends = surface.geometry.x[compat.facet_vertices(surface, loose), :2]
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal = along[:, ::-1] * [1.0, -1.0]
    traction = normal @ plate.state.tensor
    pull = np.abs(np.column_stack([np.sum(traction * d, axis=1) for d in (normal, along)]))
    for column, kind in enumerate(("normal", "tangential")):
        pull[np.isin(loose, edges[kind]), column] = 0.0
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
    if all(kind == "free" for kind in kinds.values()) and not scene.support.free:
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
        kind = deflection_of(kind)
        if kind == "clamped" or isinstance(kind, Spring) and kind.rotational > 0:
            return
        if kind != "free":
            held.append(name)
    if not held:
        return  # its rigid motions are left out
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
