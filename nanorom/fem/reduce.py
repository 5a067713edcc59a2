"""From a scene to its reduced model: steps I to IV of the paper in order."""

from __future__ import annotations

import hashlib
from pathlib import Path

from mpi4py import MPI

from nanorom.fem.output.model import assembled
from nanorom.fem.plan import Plan
from nanorom.fem.routes.registry import route_of
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import memory, split
from nanorom.fem.stopwatch import Stopwatch
from nanorom.files.partial import Journal
from nanorom.rom.model import ReducedModel
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene
from nanorom.types import Progress
from nanorom.version import version


def reduce_scene(
    scene: Scene,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    output: Path | None = None,
    groups: int | None = None,
) -> ReducedModel:
    """Reduced model of a scene. Collective: every rank gets the same model.

    The ranks share the mesh, or split into ``groups`` which each have the whole mesh and share
    classes of symmetry and load cases; None: as many as the scene's route finds best.  Load cases
    of STEP that an interrupted run left beside the ``output`` are not solved again.
    Raises SceneError, MeshError or SolverError with one line that names the cause.
    """
    route = route_of(scene)
    route.check(scene)
    plan, watch = Plan.of(scene), Stopwatch(progress)
    if groups is None:
        groups = route.groups(plan, comm.size, memory(comm)) if comm.size > 1 else 1
    team = split(comm, groups)
    journal = Journal(output, key_of(scene, comm.size) if output else "", comm)
    parts = route.parts(plan, team, watch, journal)
    told = {f"seconds_{stage}": seconds for stage, seconds in watch.seconds.items()}
    return assembled(scene, parts, {"ranks": comm.size, "groups": groups, **told})


def key_of(scene: Scene, ranks: int) -> str:
    """What a static load case depends on beside the mesh and the modes, as a digest."""
    digest = hashlib.sha256(repr((version(), compat.versions(), ranks)).encode())
    digest.update(scene.to_toml().encode())
    if isinstance(scene.geometry, MeshFile):
        digest.update(scene.geometry.file.read_bytes())
    if scene.plate.shape_file is not None:
        digest.update(scene.plate.shape_file.read_bytes())
    return digest.hexdigest()
