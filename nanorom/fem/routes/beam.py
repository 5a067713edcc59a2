"""From the scene of a string to its reduced model in one dimension."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nanorom.errors import SceneError
from nanorom.fem import plan_text
from nanorom.fem.models import inertia
from nanorom.fem.models.beam import Beam, BeamModes, modes
from nanorom.fem.output import losses
from nanorom.fem.output.model import Parts
from nanorom.fem.output.strip import StripWork
from nanorom.fem.plan import Plan
from nanorom.fem.plan_text import Item
from nanorom.fem.routes.route import Route
from nanorom.fem.solvers.groups import Team
from nanorom.fem.stopwatch import Stopwatch
from nanorom.files.partial import Journal
from nanorom.rom.patterns import reduced
from nanorom.rom.shapes import Shapes
from nanorom.scene.geometry import String
from nanorom.scene.scene import Scene
from nanorom.scene.support import Kind, Spring


class BeamRoute(Route):
    """Strings and narrow beams in one dimension.

    The film is free to contract across, so E (not E/(1 - nu^2)) counts.
    """

    def check(self, scene: Scene) -> None:
        """Raise SceneError unless one dimension is enough for the scene."""
        if not isinstance(scene.geometry, String):
            raise SceneError(
                f"plate.model: found beam for a {scene.geometry.shape}; allowed: for a string only"
            )
        held = scene.supports
        for side, free in (("left", False), ("right", False), ("bottom", True), ("top", True)):
            if (held[side] == "free") != free:
                raise SceneError(
                    f"support.{side}: found {held[side]}; allowed for a beam: its ends held, its "
                    "long sides free"
                )
        if scene.load is not None:
            raise SceneError("load: found beside plate.model = beam; allowed: plate or membrane")

    def method(self, scene: Scene) -> str:
        """The axial force is uniform: it is condensed exactly."""
        return "direct"

    def load_cases(self, plan: Plan) -> tuple[int, int]:
        """None: a uniform axial force is an integral."""
        return 0, 0

    def items(self, plan: Plan) -> list[Item]:
        """Modes and tensors."""
        ends = Item("pre-stress", False, "the ends keep the tension as it is")
        return [
            ends,
            plan_text.bending_item(plan),
            plan_text.modes_item(plan),
            *plan_text.tensor_items(plan, "direct", (0, 0), flat=True),
        ]

    def cost(self, plan: Plan) -> str:
        """Next to nothing."""
        return "polynomials in one dimension: no mesh, less than a second"

    def parts(self, plan: Plan, team: Team, watch: Stopwatch, journal: Journal) -> Parts:
        """Modes in one dimension, converged in the degree of their polynomials."""
        scene = plan.scene
        beam, width = beam_of(scene)
        found = modes(beam, scene.modes.highest)
        index = np.array(scene.modes.numbers) - 1
        axial = beam.axial_frequency
        inertia.check(axial, found.frequency[index[-1]], dict.fromkeys(scene.modes.numbers, ()))
        pick, motion = np.ix_(index, index), motion_of(found, index, width)
        names = [f"({n + 1},0)" for n in index]
        return Parts(
            frequency=found.frequency[index],
            mass=found.mass[index],
            label=names,
            stiffness=found.stiffness[pick],
            quadratic=np.zeros((len(index),) * 3),
            cubic=found.cubic[np.ix_(index, index, index, index)],
            losses=losses.losses(scene, motion),
            patterns=reduced(StripWork(found, index, width), scene.drive),
            shapes=_strip(found, index, width),
            viscous=viscous_of(scene, found, index),
            method=self.method(scene),
            diagnostics={
                "asymmetry": 0.0,
                "error_frequency": found.error[0],
                "error_tensor": found.error[1],
                "in_plane_frequency": axial,
            }
            | losses.told(scene, motion, np.full(len(index), found.error[0]), names),
        )


def motion_of(found: BeamModes, index: NDArray[np.int64], width: float) -> losses.Motion:
    """What losses of some modes of a beam follow from."""
    bent = found.bending[np.ix_(index, index)]
    return losses.Motion(
        frequency=found.frequency[index],
        stiffness=np.diag(found.stiffness)[index],
        strained=bent,
        dilated=np.diag(bent),
        mass=found.mass[index],
        square=width * found.square[index],
        pulling=np.sum(found.reaction[index] ** 2, axis=1) / width,
    )


def viscous_of(
    scene: Scene, found: BeamModes, index: NDArray[np.int64]
) -> dict[str, NDArray[np.float64]]:
    """Parts of the force that a viscoelastic material damps, as `routes.methods.viscous` has them.

    Raises SceneError for elastic ends, whose springs are not of the material.
    """
    if scene.damping is None or scene.damping.material_time == 0:
        return {}
    if any(isinstance(kind, Spring) for kind in found.beam.ends):
        raise SceneError("damping.material_time: only for rigid supports; found springs")
    pick = np.ix_(index, index)
    slope, beam = found.slope[pick], found.beam
    stretching = np.einsum("rl,jk->rjkl", slope, slope)
    return {
        "bending": found.bending[pick],
        "stretching": beam.axial_stiffness / (2 * beam.length) * stretching,
    }


def beam_of(scene: Scene) -> tuple[Beam, float]:
    """The beam of a string's scene in SI units, and its width."""
    geometry, material, h = scene.geometry, scene.material, scene.plate.thickness
    assert isinstance(geometry, String)
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
    return beam, width


def _end(kind: Kind, width: float) -> Kind:
    """A support per length of the edge as one of the whole end."""
    if not isinstance(kind, Spring):
        return kind
    return Spring(None if kind.spring is None else kind.spring * width, kind.rotational * width)


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
