"""The shell of a scene on its surface in space."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.discretisation import Discretisation, surface
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.models import initial_shape
from nanorom.fem.models.shell import Shell, ShellStiffness, is_flat
from nanorom.fem.scales import Scales
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit


def build_surface(comm: MPI.Comm, scene: Scene, scales: Scales, chosen: Discretisation) -> Domain:
    """The scene's mid-surface in units of its length. Collective."""
    if isinstance(scene.geometry, MeshFile) and scene.plate.initial_shape is None:
        return mesh.build(comm, surface(chosen).source, chosen.degree)
    height = None
    if scene.plate.initial_shape is not None:
        height = initial_shape.read(scene.plate.initial_shape)

    def place(points: np.ndarray) -> np.ndarray:
        z = np.zeros(len(points))
        if height is not None:
            z = height(points * scales.length) / scales.length
        return np.column_stack([points, z])

    order = min(chosen.order, chosen.degree) if height is None else chosen.degree
    return mesh.build(comm, chosen.source, order, chosen.mirrors, place=place)


def build_shell(scene: Scene, scales: Scales, domain: Domain, degree: int) -> Shell:
    """The shell of a scene with the scaled parameters. Collective."""
    material, thickness = scene.material, scene.plate.thickness
    change = 0.0
    if scene.load is not None and scene.load.stress is not None:
        change = scene.load.stress * thickness
    tension = np.array([scene.tension.x, scene.tension.y, 0.0]) + change
    if not is_flat(domain):
        if scene.tension.x != scene.tension.y:
            x, y = (with_unit(pull, "N/m", 6) for pull in (scene.tension.x, scene.tension.y))
            raise SceneError(
                f"tension: found x = {x}, y = {y} for a curved surface; allowed: value, the same "
                "in every direction"
            )
        tension[2] = tension[0]
    along_x, along_y, along_z = tension / scales.tension
    stiffness = ShellStiffness(
        material.youngs_modulus * scales.length / scales.tension,
        material.poisson_ratio,
        thickness / scales.length,
        (along_x, along_y, along_z),
    )
    return Shell.on(domain, degree, stiffness)
