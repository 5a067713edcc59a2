"""The solid of a scene: what is held, and the stress that it bears."""

from __future__ import annotations

from mpi4py import MPI

from nanorom.errors import SceneError, SolverError
from nanorom.fem.mesh import mesh, tetrahedra
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.models.solid import Solid
from nanorom.fem.solvers import groups
from nanorom.fem.symmetry import AXES, OPPOSITE
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene

MOST_UNKNOWNS = 120_000  # factors of a compact solid of so many take 3 GB and minutes
BYTES = 2e4  # per unknown of a compact solid; it grows as their cube root
OWN_FACES = (tetrahedra.UPPER, tetrahedra.LOWER)  # of a film made thick: they are free


def build_domain(comm: MPI.Comm, chosen: Discretisation) -> Domain:
    """The mesh of a solid; raises MeshError, or SolverError if it is too large. Collective."""
    known = chosen.source.cells
    if known is not None:  # before it is made
        check_size(known, chosen.degree, comm)
    domain = mesh.build(comm, chosen.source, chosen.order)
    check_size(domain.mesh.topology.index_map(3).size_global, chosen.degree, comm)
    return domain


def check_size(cells: int, degree: int, comm: MPI.Comm) -> None:
    """Raise SolverError for too many tetrahedra, or for too little memory. Collective."""
    unknowns = unknowns_of(cells, degree)
    found = f"a solid of {cells} tetrahedra of degree {degree} has about {unknowns} unknowns"
    remedy = "ask for a larger tolerance or fewer modes"
    if unknowns > MOST_UNKNOWNS:
        raise SolverError(f"{found}, more than {MOST_UNKNOWNS}; {remedy}")
    left, needed = groups.memory(comm), BYTES * unknowns
    if 0 < left < needed:
        raise SolverError(
            f"{found}, which need {needed / 2**30:.3g} GB or more, and {left / 2**30:.3g} GB of "
            f"memory are left; {remedy}"
        )


def unknowns_of(cells: int, degree: int) -> int:
    """About how many a solid of so many tetrahedra has."""
    return int(3 * cells * degree**3 / 6 * 1.3)


def build_solid(scene: Scene, domain: Domain, degree: int) -> Solid:
    """The solid of a scene on a domain, in units of its length, modulus and density. Collective."""
    held = held_of(scene, list(domain.facets))
    return Solid.on(domain, degree, scene.material.poisson_ratio, held, borne(scene))


def held_of(scene: Scene, faces: list[str]) -> list[str]:
    """The faces that are held; raises SceneError for names that the solid does not have."""
    for name in scene.support.named:
        if name not in faces:
            raise SceneError(
                f"support.{name}: the solid has no face of that name; "
                f"allowed: {', '.join(sorted(faces)) or 'none, as it has no physical surfaces'}"
            )
    named = {*scene.support.named, *(set(faces) - set(OWN_FACES))}
    held = [name for name in sorted(named) if scene.support.kind(name) == "clamped"]
    if not held:
        raise SceneError(
            "support: no face of the solid is held; name a physical surface and let it be clamped"
        )
    return held


def borne(scene: Scene) -> tuple[float, float, float]:
    """Stress along x, y and z that the scene's tension is, by the modulus."""
    unit = scene.material.youngs_modulus * scene.plate.thickness
    return scene.tension.x / unit, scene.tension.y / unit, 0.0


def stretched(scene: Scene) -> list[int]:
    """Axes along which both ends are held, so that a tension can be borne."""
    if isinstance(scene.geometry, MeshFile):
        return []
    held = scene.supports
    if "edge" in held:
        return [0, 1] if held["edge"] != "free" else []
    return [i for i, axis in enumerate(AXES) if all(held[end] != "free" for end in OPPOSITE[axis])]
