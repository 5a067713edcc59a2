"""What a scene needs, what is left out, and why: decided once, before anything is computed.

A wrong skip is a wrong answer: whatever is not certain to make no difference is computed.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.mesh import discretisation
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.scales import Scales, acting_tension
from nanorom.fem.symmetry import Mirrors, is_symmetric
from nanorom.scene.geometry import Disc, MeshFile
from nanorom.scene.scene import Scene
from nanorom.scene.support import deflection_of

BENDING_FACTOR = 4.0  # from wavenumber x layer to a bound on the effect of bending: 30 times safe
SKIPPED = 0.5  # of the tolerance: what is left out may take; the mesh has the rest


@attrs.frozen
class Plan:
    """Decisions about a scene.

    bending: with bending stiffness; bending_effect: a bound on its relative effect, None where it
    is not in question; scales: units of the computation.
    """

    scene: Scene
    bending: bool
    bending_effect: float | None
    scales: Scales

    @classmethod
    def of(cls, scene: Scene) -> Plan:
        """Plan of a scene."""
        effect = bending_effect(scene)
        tolerance = scene.accuracy.tolerance
        bending = scene.plate.bends
        if bending is None:  # unless it certainly makes no difference
            certain = effect is not None and tolerance is not None and not scene.bends_with_loss
            bending = not certain or (effect or 0.0) > SKIPPED * (tolerance or 0.0)
        return cls(scene, bending, effect, Scales.of(scene, bending))

    @property
    def left_out(self) -> float:
        """Bound on the relative effect of what is skipped without the scene saying so."""
        skipped = self.scene.plate.bends is None and not self.bending
        return self.bending_effect or 0.0 if skipped else 0.0

    @property
    def layer(self) -> float:
        """Width sqrt(D/T) of the edge layer in units of the scene's length; 0 without bending."""
        acting = acting_tension(self.scene) or self.scene.tension
        tension = max(acting.largest, 1e-300)
        return float(np.sqrt(self.scales.bending * self.scales.tension / tension))

    def discretisation(self, aim: float | None) -> Discretisation:
        """Mesh and degree for an aimed error."""
        return discretisation.choose(self.scene, self.scales.length, self.layer, aim)

    @property
    def cut(self) -> Mirrors:
        """Mirrors at which the meshed part ends; none where states mix modes of every parity."""
        scene = self.scene
        alike = scene.flat or is_symmetric(scene) and scene.reduction.method == "direct"
        return self.discretisation(scene.accuracy.tolerance).mirrors if alike else Mirrors()

    @property
    def degree(self) -> int:
        """Degree of the deflection."""
        return self.discretisation(self.scene.accuracy.tolerance).degree

    @property
    def dofs(self) -> int | None:
        """About how many degrees of freedom w has; None for a mesh file, not yet read."""
        chosen = self.discretisation(self.scene.accuracy.tolerance)
        cells = discretisation.cells_of(chosen)
        return None if cells is None else discretisation.dofs_of(cells, chosen.degree)


def bending_effect(scene: Scene) -> float | None:
    """Bound on the relative effect of bending on frequencies and tensors.

    At a clamped edge the film is stiff over a layer sqrt(D/T), as if it were shorter by that; None
    where a direction is without tension or the tension is not known beforehand, nor are the
    wavelengths on a mesh file.
    """
    tension = acting_tension(scene)
    if tension is None or tension.smallest <= 0 or scene.plate.bends is False:
        return None
    scales = Scales.of(scene)
    supports = map(deflection_of, scene.supports.values())
    assert not isinstance(scene.geometry, MeshFile)  # its tension is not known beforehand
    wavenumber = discretisation.shortest_wave(scene.geometry, scene.modes.highest) * scales.length
    size = 1.0 if isinstance(scene.geometry, Disc) else scene.geometry.width / scales.length
    layer = float(np.sqrt(scales.bending * scales.tension / tension.smallest))
    scaled = BENDING_FACTOR * max(wavenumber, 1 / size) * layer
    return scaled if "clamped" in supports or scene.support.springs else scaled**2
