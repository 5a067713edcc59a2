"""Solids in three dimensions as bodies of which manifolds are made."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.mesh import thick
from nanorom.fem.models import build_solid
from nanorom.fem.models.solid_system import SolidSystem
from nanorom.fem.modes import solid as solids
from nanorom.fem.modes.solid import SolidModes
from nanorom.fem.output import losses
from nanorom.fem.output.solid import SolidWork, drawn
from nanorom.fem.plan import Plan
from nanorom.fem.routes import solid_check
from nanorom.fem.routes.solid import motion_of
from nanorom.fem.solvers.groups import alone
from nanorom.rom.patterns import ModalWork
from nanorom.rom.shapes import Shapes
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.body import Body, places_of
from nanorom.verification.driven import check as check_drive
from nanorom.verification.solid_work import SolidLoads


@attrs.frozen(eq=False)
class SolidBody(Body):
    """A solid; length in m: its unit."""

    modes: SolidModes
    system: SolidSystem
    length: float

    @classmethod
    def of(
        cls, scene: Scene, masters: Sequence[int | str], more: int, mesh: float | None
    ) -> SolidBody:
        """Of a scene with `more` named modes than it has; raises SceneError and SolverError."""
        if scene.drive is not None:
            check_drive(scene.drive)
        aim = scene.accuracy.tolerance and (mesh or scene.accuracy.tolerance)
        highest = scene.modes.highest + more
        wide = scene.with_(modes=highest, tolerance=aim)
        length, material = Plan.of(wide).scales.length, scene.material
        chosen = thick.choose(wide, length, aim)
        domain = build_solid.build_domain(alone().within, chosen)
        solid = build_solid.build_solid(wide, domain, chosen.degree)
        named = solids.solve(solid, highest)
        first = places_of(named.names[:highest], masters)
        others = [place for place in range(highest) if place not in first]
        modes = named.take(np.array([*first, *others]))
        masses = modes.masses()
        time = length * float(np.sqrt(material.density / material.youngs_modulus))
        frequency = np.sqrt(modes.eigenvalues) / (2 * np.pi * time)
        stiffness = np.diag(modes.eigenvalues * masses)
        motion = motion_of(modes, stiffness, frequency, material, length)
        return cls(
            scene=scene,
            system=SolidSystem.of(solid),
            names=list(modes.names),
            numbers=np.array([*first, *others]) + 1,
            shapes=modes.shapes / np.sqrt(masses),
            squares=modes.eigenvalues,
            scale=length / np.sqrt(masses),
            losses=losses.losses(wide, motion),
            time=time,
            energy=material.youngs_modulus * length**3,
            modes=modes,
            length=length,
        )

    def work(self, vectors: Array, scale: Array) -> ModalWork:
        modes = self._with(vectors, scale)
        density, size = self.scene.material.density, self.scene.plate.thickness
        along = build_solid.stretched(self.scene)
        return SolidWork(modes, drawn(modes, self.length), self.length, density, size, along)

    def drawn(self, vectors: Array, scale: Array) -> Shapes:
        return drawn(self._with(vectors, scale), self.length)

    def driven(self, masters: Array) -> tuple[Array, Array]:
        drive, none = self.scene.drive, np.zeros((self.system.size, 0))
        if drive is None:
            return none, none
        loads = SolidLoads(
            solid=self.modes.solid,
            length=self.length,
            density=self.scene.material.density,
            thickness=self.scene.plate.thickness,
            along=build_solid.stretched(self.scene),
            momenta=self.system.mass @ self.shapes,
            shapes=self.shapes,
            scale=self.scale,
        )
        pushed = drive.pattern.force(loads)
        return pushed[:, None], drive.modulation.stiffness(loads, pushed) @ masters

    def _with(self, vectors: Array, scale: Array) -> SolidModes:
        """Vectors as if they were modes that reach 1."""
        return attrs.evolve(self.modes, shapes=vectors * (self.length / scale))


def check(scene: Scene) -> None:
    """Raise SceneError for what no manifold of a solid knows."""
    solid_check.check(scene)
    if scene.damping is None:
        raise SceneError("damping: missing section [damping], which a manifold needs")
