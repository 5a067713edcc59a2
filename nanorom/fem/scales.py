"""Units in which a scene is computed: SI outside, numbers of order one inside."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.symmetry import AXES, OPPOSITE
from nanorom.scene.film import Tension
from nanorom.scene.geometry import Disc, MeshFile
from nanorom.scene.scene import Scene
from nanorom.scene.support import in_plane_of


@attrs.frozen
class Scales:
    """Units in which a scene is computed: SI value = unit x non-dimensional value.

    length in m, tension in N/m, mass in kg, cubic in N/m^3; bending is D/(tension length^2).
    """

    length: float
    tension: float
    mass: float
    cubic: float
    bending: float

    @classmethod
    def of(cls, scene: Scene, bending: bool = True) -> Scales:
        """Scales of a scene; a film without tension is measured by its bending stiffness.

        bending : whether bending stiffness is taken into account; never for a membrane.
        """
        geometry, material, h = scene.geometry, scene.material, scene.plate.thickness
        if isinstance(geometry, Disc):
            length = geometry.radius
        else:
            length = geometry.scale if isinstance(geometry, MeshFile) else geometry.length
        stretch = material.youngs_modulus * h
        stiffness = 0.0
        if bending and scene.plate.bends is not False:
            stiffness = material.bending_stiffness(h) / length**2
        tension = max(*(abs(t) for t in scene.tension.principal), stiffness)
        mass = material.density * h * length**2
        return cls(length, tension, mass, stretch / length**2, stiffness / tension)

    @property
    def strain(self) -> float:
        """The unit of tension by the membrane stiffness E h."""
        return self.tension / (self.cubic * self.length**2)

    def in_plane_frequency(self, eigenvalue: float) -> float:
        """Frequency in Hz of a scaled in-plane eigenvalue per unit of membrane stiffness."""
        stiffness = self.cubic * self.length**2
        return float(np.sqrt(eigenvalue * stiffness / self.mass) / (2 * np.pi))

    def frequency(self, eigenvalues: np.ndarray) -> np.ndarray:
        """Frequencies in Hz of eigenvalues of the scaled problem."""
        return np.sqrt(eigenvalues * self.tension / self.mass) / (2 * np.pi)


def acting_tension(scene: Scene) -> Tension | None:
    """Tension in the state that modes are about; None where only that state itself can tell.

    A load's stress adds to it; other loads bend and stretch the film, and an initial shape turns
    tension into curvature; where it pulls at a free edge, it relaxes.
    """
    load, change = scene.load, 0.0
    if load is not None:
        if load.deflects:
            return None
        change = (load.stress or 0.0) * scene.plate.thickness
    if scene.plate.initial_shape is not None or isinstance(scene.geometry, MeshFile):
        return None
    if scene.regions or scene.tension.variation is not None:
        return None
    t, kinds = scene.tension, scene.supports
    tension = Tension(t.x + change, t.y + change, t.xy)
    for axis, pull in zip(AXES, (tension.x, tension.y)):
        held = all(in_plane_of(kinds.get(end, "fixed")) == "fixed" for end in OPPOSITE[axis])
        if (pull or tension.xy) and not held:
            return None
    if isinstance(scene.geometry, Disc) and in_plane_of(scene.support.kind("edge")) != "fixed":
        return None
    return tension
