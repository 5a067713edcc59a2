"""What acts on a solid's modes, and how they are drawn: by the displacement along z of its faces.

Where a face is named "upper", as that of a film made thick is, it alone is drawn, and forces by
area and at points act on it; else all that is outside is drawn.  A pressure acts on the face that
is named "lower", into the solid: it lifts a film.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from nanorom.fem.fields.faces import Faces
from nanorom.fem.fields.places import lattice
from nanorom.fem.mesh.tetrahedra import LOWER, UPPER
from nanorom.fem.models.solid import Solid
from nanorom.fem.modes.solid import SolidModes
from nanorom.fem.output import drawing
from nanorom.fem.solvers import compat
from nanorom.fem.tensors.solid import stiffening
from nanorom.rom.patterns import DrawnWork, ModalWork
from nanorom.rom.shapes import Shapes
from nanorom.scene.patterns.pattern import Absent, Areal
from nanorom.types import Array

FINEST = 30  # degree of the rule on a face under a force by area
UP = 2


def drawn(modes: SolidModes, length: float) -> Shapes:
    """Displacement along z on the surface that is drawn, in m. Collective."""
    comm = modes.solid.domain.comm
    faces, fineness = drawn_faces(modes.solid)
    values = _displacements(faces, modes)[:, :, UP].reshape(-1, modes.shapes.shape[1])
    points = np.concatenate(comm.allgather(faces.places.reshape(-1, 3)))
    values = np.concatenate(comm.allgather(values))
    points, cells, values = drawing.joined(points, values.T, fineness)
    return Shapes(length * points, cells, values)


def drawn_faces(solid: Solid) -> tuple[Faces, int]:
    """Faces at the points that are drawn, and the parts of their sides. Collective."""
    facets = solid.domain.facets.get(UPPER)
    if facets is None:
        facets = compat.exterior_facets(solid.domain.mesh)
    own = len(Faces.of(solid.space, facets, np.zeros((1, 2))).cells)
    fineness = drawing.fineness_of(solid.domain.comm.allreduce(own), solid.degree)
    return Faces.of(solid.space, facets, lattice(fineness)), fineness


def _displacements(faces: Faces, modes: SolidModes) -> np.ndarray:
    """(f, q, 3, L) of the modes. Collective."""
    whole = modes.solid.free.extended(modes.shapes)
    fields = whole.reshape(len(whole) // 3, 3, -1)
    return faces.displacements(fields, modes.solid.degree)


@attrs.frozen(eq=False)
class SolidWork(ModalWork):
    """Virtual work on the modes of a solid; a force at a point by the drawn shapes.

    length in m; density in kg/m^3; thickness in m: of a film made thick; along: axes along which a
    tension can be borne.
    """

    modes: SolidModes
    shapes: Shapes
    length: float
    density: float
    thickness: float
    along: list[int]

    def uniform(self, pressure: float = 1.0) -> Array:
        """J (L,) in N of a pressure in Pa on the face "lower"; raises Absent without it."""
        faces, weights = self._faces(LOWER, 2 * self.modes.solid.degree)
        inwards = -faces.areas * weights[:, None]
        work = np.einsum("fqi,fqim->m", inwards, _displacements(faces, self.modes))
        return pressure * self.length**2 * self._summed(work)

    def areal(self, pattern: Areal) -> Array:
        """J (L,) in N of a force per area along z on the face "upper"; raises Absent without it."""
        faces, weights = self._faces(UPPER, FINEST)
        places = self.length * faces.places[..., :2]
        density = pattern.density(places.reshape(-1, 2)).reshape(places.shape[:2])
        lifted = _displacements(faces, self.modes)[:, :, UP]
        work = np.einsum("fq,fqm->m", density * faces.areas[..., UP] * weights, lifted)
        return self.length**2 * self._summed(work)

    def points(self, places: Array, weights: Array, key: str) -> Array:
        """J (L,) in N of forces (n,) along z at places (n, 2) in m; raises SceneError off it."""
        return DrawnWork(self.shapes).points(places, weights, key)

    def inertia(self, acceleration: float = 1.0) -> Array:
        """J (L,) in N of the frame's acceleration along z in m/s^2."""
        momentum = self._summed(self.modes.solid.weights(UP) @ self.modes.shapes)
        return -acceleration * self.density * self.length**3 * momentum

    def stretch(self, tension: float = 1.0) -> Array:
        """P (L, L) in N/m of a change of tension in N/m.

        Of what its supports do not bear, and in the volumes of a file of a stress in every
        direction, tension by thickness, that is left which does not relax.
        """
        if self.along:
            added = self.modes.solid.slopes(self.modes.shapes, self.along)
        else:
            added = stiffening(self.modes, (1.0, 1.0, 1.0))
        return -tension / self.thickness * self.length * added

    def _faces(self, name: str, degree: int) -> tuple[Faces, Array]:
        solid = self.modes.solid
        if name not in solid.domain.facets:
            raise Absent(f'drive: the solid has no face named "{name}"')
        return Faces.integrated(solid.space, solid.domain.facets[name], degree)

    def _summed(self, work: Any) -> Array:
        return np.asarray(self.modes.solid.domain.comm.allreduce(work))
