"""A solid on its mesh: all three displacements are unknowns, modes named as for a reduction."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from nanorom.errors import SceneError
from nanorom.fem.fields.faces import Faces
from nanorom.fem.mesh import thick
from nanorom.fem.mesh.tetrahedra import LOWER, UPPER
from nanorom.fem.models import build_solid
from nanorom.fem.models.solid_system import SolidSystem
from nanorom.fem.modes import solid as solids
from nanorom.fem.modes.solid import SolidModes
from nanorom.fem.output import losses
from nanorom.fem.output.solid import FINEST, UP, drawn, drawn_faces
from nanorom.fem.plan import Plan
from nanorom.fem.routes.solid import motion_of
from nanorom.fem.solvers import algebra
from nanorom.fem.solvers.groups import alone
from nanorom.rom.shapes import Shapes
from nanorom.scene.patterns.pattern import Absent, Areal
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assembled import FilmWork, Forces, Operators, Units
from nanorom.verification.factors import Factors
from nanorom.verification.whole import ONLY, Rest, WholeFilm, WholeForce, condensed, outer

CORNERS = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
BESIDE = 1e-9  # barycentric coordinate of a point that is still in a triangle


@attrs.frozen(eq=False)
class SolidFilm(WholeFilm):
    """A solid; modes: the named ones."""

    modes: SolidModes

    @property
    def work(self) -> AllWork:
        """Of simple forces on all unknowns."""
        return AllWork(self)

    def drawn(self, vectors: Array) -> Shapes:
        modes = attrs.evolve(self.modes, shapes=vectors)
        return drawn(modes, self.units.deflection)


@attrs.frozen(eq=False)
class AllWork(FilmWork):
    """Virtual work on all unknowns of a solid, as `fem.output.solid.SolidWork` has it on modes."""

    film: SolidFilm

    def uniform(self, pressure: float = 1.0) -> Forces:
        faces, weights = self._faces(LOWER, 2 * self._degree)
        return self._on(faces, -pressure * self._length**2 * faces.areas * weights[:, None])

    def areal(self, pattern: Areal) -> Forces:
        faces, weights = self._faces(UPPER, FINEST)
        places = self._length * faces.places[..., :2]
        density = pattern.density(places.reshape(-1, 2)).reshape(places.shape[:2])
        pressed = self._length**2 * density * faces.areas[..., UP] * weights
        pattern.check_meets(float(pressed.sum()))
        return self._lifted(faces, pressed)

    def points(self, places: Array, weights: Array, key: str) -> Forces:
        facets = self._facets(UPPER)
        corners = Faces.of(self._space, facets, CORNERS).places[..., :2]
        sides = (corners[:, 1:] - corners[:, :1]).swapaxes(1, 2)
        found = np.zeros(len(self.film.named))
        for place, weight in zip(places / self._length, weights.tolist()):
            inside = np.linalg.solve(sides, (place - corners[:, 0])[..., None])[..., 0]
            depth = np.minimum(inside.min(axis=1), 1 - inside.sum(axis=1))
            own = [int(depth.argmax())]
            if depth[own[0]] < -BESIDE:
                raise SceneError(f"{key}: it is not on the film")
            faces = Faces.of(self._space, facets[own], inside[own])
            found += self._lifted(faces, np.full((1, 1), weight))[ONLY]
        return {ONLY: found}

    def inertia(self, acceleration: float = 1.0) -> Forces:
        mass = self.film.scene.material.density * self._length**3
        return {ONLY: -acceleration * mass * self.film.modes.solid.weights(UP)}

    def stretch(self, tension: float = 1.0) -> Operators:
        solid, scene = self.film.modes.solid, self.film.scene
        along = build_solid.stretched(scene)
        factor = tension / scene.plate.thickness * self._length
        borne = factor * algebra.as_csr(solid.stretched(along or range(3)))
        if along:
            return lambda parity: borne
        # a stress in every direction relaxes where supports do not bear it
        pull = solid.pull((1.0, 1.0, 1.0))[:, None]
        relaxed = -factor * self.film.discrete.rest.response(pull)

        def apply(columns: Array) -> Array:
            u = columns.reshape(len(columns), -1)
            turned = solid.quadratic(np.repeat(relaxed, u.shape[1], axis=1), u)
            return np.asarray((borne @ u + 2 * turned).reshape(columns.shape))

        whole = spl.LinearOperator(borne.shape, matvec=apply, matmat=apply, dtype=float)
        return lambda parity: whole

    # -- parts ----------------------------------------------------------------------------------

    @property
    def _length(self) -> float:
        return self.film.units.deflection

    @property
    def _space(self) -> Any:
        return self.film.modes.solid.space

    @property
    def _degree(self) -> int:
        return self.film.modes.solid.degree

    def _facets(self, name: str) -> np.ndarray:
        facets = self.film.modes.solid.domain.facets
        if name not in facets:
            raise Absent(f'drive: the solid has no face named "{name}"')
        return np.asarray(facets[name])

    def _faces(self, name: str, degree: int) -> tuple[Faces, Array]:
        return Faces.integrated(self._space, self._facets(name), degree)

    def _lifted(self, faces: Faces, upwards: Array) -> Forces:
        forces = np.zeros((*upwards.shape, 3))
        forces[..., UP] = upwards
        return self._on(faces, forces)

    def _on(self, faces: Faces, forces: Array) -> Forces:
        """Forces (f, q, 3) at points of faces on all unknowns."""
        free = self.film.modes.solid.free
        whole = faces.work(forces, free.n_local // 3, self._degree)
        return {ONLY: np.asarray(free.summed(whole.reshape(-1, 1))[:, 0])}


def assemble(scene: Scene, more: int, tolerance: float | None = None) -> SolidFilm:
    """The solid of a scene, on this process alone, with ``more`` named modes than the model has.

    tolerance : of the mesh.  Raises SolverError as `reduce` does.
    """
    fine, material = scene.accuracy.tolerance, scene.material
    if fine is not None:
        fine = tolerance or fine
    assert scene.damping is not None
    highest = scene.modes.highest + more
    wide = scene.with_(
        modes=highest, tolerance=fine, damping=attrs.evolve(scene.damping, quality_factor=1.0)
    )
    length, modulus = Plan.of(wide).scales.length, material.youngs_modulus
    chosen = thick.choose(wide, length, fine)
    domain = build_solid.build_domain(alone().within, chosen)
    solid = build_solid.build_solid(wide, domain, chosen.degree)
    modes = solids.solve(solid, highest).take(np.arange(highest))
    system, mass = SolidSystem.of(solid), modes.masses()
    named, unit = modes.shapes / np.sqrt(mass), np.sqrt(mass)
    rest = Rest.of(system, named, Factors(system.stiffness, "solid's stiffness"))
    quadratic, cubic = condensed(system, rest)
    time = length * float(np.sqrt(material.density / modulus))
    stiffness = np.diag(modes.eigenvalues * mass)
    frequency = np.sqrt(modes.eigenvalues) / (2 * np.pi * time)
    motion = motion_of(modes, stiffness, frequency, material, length)
    return SolidFilm(
        scene=scene,
        units=Units(time=time, deflection=length, stiffness=modulus * length),
        discrete=WholeForce(system, _surface(modes), rest),
        names=list(modes.names),
        parities=[ONLY] * highest,
        values=modes.eigenvalues,
        modal={
            "mass": motion.mass,
            "stiffness": modulus * length * stiffness,
            "quadratic": modulus * quadratic * outer(unit, 3),
            "cubic": modulus / length * cubic * outer(unit, 4),
        },
        losses=losses.losses(wide, motion),
        inside=np.array(scene.modes.numbers) - 1,
        classes=[ONLY],
        copies=1,
        named=named,
        modes=modes,
    )


def _surface(modes: SolidModes) -> sp.csr_matrix:
    """Displacements (p, n) along z at the points that are drawn, of all unknowns."""
    solid = modes.solid
    faces = drawn_faces(solid)[0]
    return faces.values(solid.free.n_local // 3, solid.degree, UP)[:, solid.free.local]
