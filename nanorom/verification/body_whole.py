"""Films of which everything that moves is an unknown, as bodies of which manifolds are made."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from nanorom.rom.patterns import ModalWork
from nanorom.rom.shapes import Shapes
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assembled import Forces, Operators
from nanorom.verification.body import Body, VectorsWork, places_of
from nanorom.verification.driven import check as check_drive
from nanorom.verification.whole import ONLY, WholeFilm

Assemble = Callable[[Scene, int, "float | None"], WholeFilm]


@attrs.frozen(eq=False)
class WholeBody(Body):
    """A shell or a solid."""

    film: WholeFilm

    @classmethod
    def of(
        cls,
        assemble: Assemble,
        scene: Scene,
        masters: Sequence[int | str],
        more: int,
        mesh: float | None,
    ) -> WholeBody:
        """Of a scene with `more` named modes than it has; raises SceneError and SolverError."""
        if scene.drive is not None:
            check_drive(scene.drive)
        film = assemble(scene, more, mesh)
        first = places_of(film.names, masters)
        places = np.array([*first, *(p for p in range(len(film.names)) if p not in first)])
        return cls(
            scene=scene,
            system=film.discrete.system,
            names=[film.names[place] for place in places],
            numbers=places + 1,
            shapes=film.named[:, places],
            squares=film.values[places],
            scale=film.scale[places],
            losses={name: values[places] for name, values in film.losses.items()},
            time=film.units.time,
            energy=film.units.energy,
            film=film,
        )

    def work(self, vectors: Array, scale: Array) -> ModalWork:
        return WholeWork(self.film, vectors * (self.film.units.deflection / scale))

    def drawn(self, vectors: Array, scale: Array) -> Shapes:
        return self.film.drawn(vectors * (self.film.units.deflection / scale))

    def driven(self, masters: Array) -> tuple[Array, Array]:
        drive, none = self.scene.drive, np.zeros((len(masters), 0))
        if drive is None:
            return none, none
        work = self.film.work
        pushed = drive.pattern.force(work)
        return pushed[ONLY][:, None], drive.modulation.stiffness(work, pushed)(ONLY) @ masters


@attrs.frozen(eq=False)
class WholeWork(VectorsWork):
    """Virtual work on vectors (n, r) that are reached at a coordinate of 1 m."""

    film: WholeFilm
    vectors: Array

    def _on(self, forces: Forces) -> Array:
        return np.asarray(forces[ONLY] @ self.vectors)

    def _between(self, operators: Operators) -> Array:
        found = -self.vectors.T @ (operators(ONLY) @ self.vectors)
        return np.asarray(found + found.T) / 2
