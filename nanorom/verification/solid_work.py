"""What simple forces do to every degree of freedom of a solid.

What is made of them on modes (`fem.output.solid`) is done here on all that is free.
"""

from __future__ import annotations

from typing import Any

import attrs
import basix
import numpy as np
import scipy.sparse.linalg as spl

from nanorom.errors import SceneError
from nanorom.fem.fields.faces import Faces
from nanorom.fem.mesh.tetrahedra import LOWER, UPPER
from nanorom.fem.models.solid import Solid
from nanorom.fem.models.solid_system import sparse
from nanorom.fem.output.solid import FINEST, UP
from nanorom.fem.solvers import algebra
from nanorom.scene.patterns.pattern import Absent, Areal, VirtualWork
from nanorom.types import Array

CORNERS = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
BESIDE = 1e-9  # barycentric coordinate of a point that is still in a triangle


@attrs.frozen(eq=False)
class SolidLoads(VirtualWork[Array, Any]):
    """Virtual work on the n free degrees of freedom of a solid, on one rank, per length in m of
    each: a force is (n,) in N, an operator (n, n) in N/m.

    momenta (n, N): M times named modes of unit mass, reached at coordinates of scale (N,).
    thickness in m: of a film made thick; along: axes along which a tension can be borne.
    """

    solid: Solid
    length: float
    density: float
    thickness: float
    along: list[int]
    momenta: Array
    shapes: Array
    scale: Array

    def uniform(self, pressure: float = 1.0) -> Array:
        faces, weights = self._faces(LOWER, 2 * self.solid.degree)
        return self._on(faces, -pressure * self.length**2 * faces.areas * weights[:, None])

    def areal(self, pattern: Areal) -> Array:
        faces, weights = self._faces(UPPER, FINEST)
        places = self.length * faces.places[..., :2]
        density = pattern.density(places.reshape(-1, 2)).reshape(places.shape[:2])
        return self._lifted(faces, self.length**2 * density * faces.areas[..., UP] * weights)

    def points(self, places: Array, weights: Array, key: str) -> Array:
        corners = Faces.of(self.solid.space, self._facets(UPPER), CORNERS).places[..., :2]
        sides = (corners[:, 1:] - corners[:, :1]).swapaxes(1, 2)
        found = np.zeros(self.solid.free.size)
        for place, weight in zip(places / self.length, weights.tolist()):
            inside = np.linalg.solve(sides, (place - corners[:, 0])[..., None])[..., 0]
            depth = np.minimum(inside.min(axis=1), 1 - inside.sum(axis=1))
            own = int(depth.argmax())
            if depth[own] < -BESIDE:
                raise SceneError(f"{key}: it is not on the film")
            faces = Faces.of(self.solid.space, self._facets(UPPER)[[own]], inside[[own]])
            found += self._lifted(faces, np.full((1, 1), weight))
        return found

    def inertia(self, acceleration: float = 1.0) -> Array:
        return -acceleration * self.density * self.length**3 * self.solid.weights(UP)

    def stretch(self, tension: float = 1.0) -> Any:
        """As `fem.output.solid.SolidWork.stretch`: what the supports do not bear relaxes."""
        added = sparse(self.solid.stretched(self.along or range(3)))
        factor = -tension / self.thickness * self.length
        if self.along:
            return factor * added
        pull = self.solid.pull((1.0, 1.0, 1.0))[:, None]
        factors = algebra.Factorization(self.solid.stiffness, "nanorom_solid_", "solid's stiffness")
        relaxed = -factors.solve(pull)
        factors.reset()

        def apply(columns: Array) -> Array:
            u = columns.reshape(len(columns), -1)
            turned = self.solid.quadratic(np.repeat(relaxed, u.shape[1], axis=1), u)
            return np.asarray((factor * (added @ u + 2 * turned)).reshape(columns.shape))

        return spl.LinearOperator(added.shape, matvec=apply, matmat=apply)

    def proportional(self, force: Array) -> Any:
        # J_r of a mode that reaches 1 m, at coordinates of unit mass
        factor = (self.shapes.T @ force) * self.length / self.scale
        factor *= (self.scale / self.length) ** 2

        def apply(columns: Array) -> Array:
            u = columns.reshape(len(columns), -1)
            pulled = self.momenta @ (factor[:, None] * (self.momenta.T @ u))
            return np.asarray(pulled.reshape(columns.shape))

        return spl.LinearOperator((len(force),) * 2, matvec=apply, matmat=apply)

    def _facets(self, name: str) -> np.ndarray:
        if name not in self.solid.domain.facets:
            raise Absent(f'drive: the solid has no face named "{name}"')
        return np.asarray(self.solid.domain.facets[name])

    def _faces(self, name: str, degree: int) -> tuple[Faces, Array]:
        points, weights = basix.make_quadrature(basix.CellType.triangle, degree)
        faces = Faces.of(self.solid.space, self._facets(name), np.asarray(points))
        return faces, np.asarray(weights)

    def _lifted(self, faces: Faces, upwards: Array) -> Array:
        forces = np.zeros((*upwards.shape, 3))
        forces[..., UP] = upwards
        return self._on(faces, forces)

    def _on(self, faces: Faces, forces: Array) -> Array:
        """Forces (f, q, 3) at points of faces on what is free (n,)."""
        nodes = len(self.solid.free.extended(np.zeros((self.solid.free.size, 1)))) // 3
        whole = faces.work(forces, nodes, self.solid.degree)
        return np.asarray(self.solid.free.summed(whole.reshape(-1, 1))[:, 0])
