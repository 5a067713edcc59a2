"""From the scene of a string to its reduced model in one dimension."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nanorom.errors import SceneError
from nanorom.fem.models import inertia
from nanorom.fem.models.beam import Beam, BeamModes, modes
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import unaimed
from nanorom.rom.shapes import Shapes
from nanorom.scene.geometry import String
from nanorom.scene.scene import Scene
from nanorom.scene.support import Kind, Spring


def reduce_beam(scene: Scene) -> ReducedModel:
    """Reduced model of a string's scene in one dimension; raises SceneError where that is too few.

    The film is narrow: it is free to contract across, so E (not E/(1 - nu^2)) counts.
    """
    geometry = _string(scene)
    material, h = scene.material, scene.plate.thickness
    length, width = geometry.length, geometry.width
    area = width * h
    held = scene.supports
    beam = Beam(
        length,
        material.youngs_modulus * area,
        material.youngs_modulus * area * h**2 / 12,
        scene.tension.x * width,
        material.density * area,
        (_end(held["left"], width), _end(held["right"], width)),
    )
    found = modes(beam, scene.modes.highest)
    index = np.array(scene.modes.numbers) - 1
    axial = beam.axial_frequency
    inertia.check(axial, found.frequency[index[-1]])
    pick = np.ix_(index, index)
    frequency, mass = found.frequency[index], found.mass[index]
    damping = np.zeros((len(index),) * 2)
    if scene.damping is not None:
        quality = np.array(scene.damping.per_mode(len(index)))
        damping = np.diag(2 * np.pi * frequency * mass / quality)
    direct, parametric = unaimed(width * found.area[index], width * found.slope[pick])
    return ReducedModel(
        frequency=frequency,
        mass=mass,
        label=tuple(f"({n + 1},0)" for n in index),
        number=index + 1,
        stiffness=found.stiffness[pick],
        damping=damping,
        quadratic=np.zeros((len(index),) * 3),
        cubic=found.cubic[np.ix_(index, index, index, index)],
        drive=direct,
        parametric=parametric,
        shapes=_strip(found, index, width),
        diagnostics={
            "asymmetry": 0.0,
            "error_frequency": found.error[0],
            "error_tensor": found.error[1],
            "in_plane_frequency": axial,
        },
        scene=scene.to_toml(),
        method="direct",
        in_plane="free",
    )


def _end(kind: Kind, width: float) -> Kind:
    """A support per length of the edge as one of the whole end."""
    if not isinstance(kind, Spring):
        return kind
    return Spring(None if kind.spring is None else kind.spring * width, kind.rotational * width)


def _string(scene: Scene) -> String:
    """The scene's string; raises SceneError unless one dimension is enough for it."""
    if not isinstance(scene.geometry, String):
        raise SceneError(
            f"plate.model: found beam for a {scene.geometry.shape}; allowed: for a string only"
        )
    held = scene.supports
    for side, free in (("left", False), ("right", False), ("bottom", True), ("top", True)):
        if (held[side] == "free") != free:
            raise SceneError(
                f"support.{side}: found {held[side]}; allowed for a beam: its ends held, its long "
                "sides free"
            )
    if scene.load is not None:
        raise SceneError("load: found beside plate.model = beam; allowed: plate or membrane")
    return scene.geometry


def _strip(found: BeamModes, index: NDArray[np.int64], width: float) -> Shapes:
    """Shapes on a strip of triangles."""
    x = np.linspace(0, found.beam.length, 40 * (int(index.max()) + 1) + 1)
    n = len(x)
    points = np.zeros((2 * n, 3))
    points[:, 0] = np.tile(x - found.beam.length / 2, 2)
    points[:, 1] = np.repeat([-width / 2, width / 2], n)
    left = np.arange(n - 1)
    cells = np.concatenate(
        [
            np.column_stack([left, left + 1, n + left]),
            np.column_stack([left + 1, n + left + 1, n + left]),
        ]
    )
    return Shapes(points, cells, np.tile(found.shapes(x)[index], 2))
