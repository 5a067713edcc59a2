"""Plates and membranes as bodies of which manifolds are made."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.fem.output import drawing
from nanorom.rom.manifold.projection import near
from nanorom.rom.patterns import ModalWork
from nanorom.rom.shapes import Shapes
from nanorom.scene.drive import Drive
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assembled import Forces, Operators, on_free
from nanorom.verification.body import Body, VectorsWork, places_of
from nanorom.verification.plate import PlateFilm
from nanorom.verification.plate import assemble as assemble_plate
from nanorom.verification.system import FilmSystem

MOST_NAMED = 30  # of the scene's modes, the lowest: room is left for fields, which the others join


@attrs.frozen(eq=False)
class FilmBody(Body):
    """A plate or membrane; forces of classes that its masters do not lead to are left out."""

    film: PlateFilm
    system: FilmSystem

    @classmethod
    def of(
        cls, scene: Scene, masters: Sequence[int | str], more: int, mesh: float | None
    ) -> FilmBody:
        """Of a scene with `more` named modes than it has; raises SceneError and SolverError."""
        film = assemble_plate(scene, more, mesh)
        first = places_of(film.names, masters)
        system = FilmSystem.of(film, first)
        inside = {i for i in film.inside if film.parities[i] in system.classes.deflections}
        places = np.array(sorted({*sorted(inside)[:MOST_NAMED], *first}))
        shapes, squares = _modes(film, system, places)
        order = np.concatenate(
            [[places.tolist().index(p) for p in first], np.flatnonzero(~np.isin(places, first))]
        ).astype(int)
        places = places[order]
        return cls(
            scene=scene,
            system=system,
            names=[film.names[place] for place in places],
            numbers=places + 1,
            shapes=shapes[:, order],
            squares=squares[order],
            scale=film.scale[places],
            losses={name: values[places] for name, values in film.losses.items()},
            time=film.units.time,
            energy=film.units.energy * film.copies,
            film=film,
        )

    def work(self, vectors: Array, scale: Array) -> ModalWork:
        return FieldsWork(self.film, self.system, vectors, scale)

    def drawn(self, vectors: Array, scale: Array) -> Shapes:
        drawn = []
        modes = self.film.solution.modes
        for parity, free, part in self.system.parts(vectors):
            shapes = np.zeros((len(modes.shapes), vectors.shape[1]))
            shapes[free] = part * (self.film.units.deflection / scale)
            parities = [parity] * vectors.shape[1]
            copied = attrs.evolve(modes, shapes=shapes, parities=parities, diameters=None)
            points, cells, values = drawing.triangulation(copied)
            drawn.append(values)
        return Shapes(self.film.scales.length * points, cells, sum(drawn))

    def driven(self, masters: Array) -> tuple[Array, Array]:
        drive: Drive | None = self.scene.drive
        size = self.system.size
        if drive is None:
            return np.zeros((size, 0)), np.zeros((size, 0))
        work = self.film.work
        whole = drive.pattern.force(work)
        forces = on_free(self.film, whole)
        pushed, pulled = np.zeros(size), np.zeros_like(masters)
        operator = drive.modulation.stiffness(work, whole)
        for parity, rows in self.system.rows.items():
            if parity in forces:
                pushed[rows] = forces[parity]
            pulled[rows] = operator(parity) @ masters[rows]
        return pushed[:, None], pulled


@attrs.frozen(eq=False)
class FieldsWork(VectorsWork):
    """Virtual work on fields of the film, in the coordinates of which they are `scale` (r,)."""

    film: PlateFilm
    system: FilmSystem
    vectors: Array
    scale: Array

    def _on(self, forces: Forces) -> Array:
        found = np.zeros(len(self.scale))
        for parity, free, part in self.system.parts(self.vectors):
            if parity in forces:
                found += forces[parity][free] @ part
        return self.film.copies * self.film.units.deflection / self.scale * found

    def _between(self, operators: Operators) -> Array:
        found = np.zeros((len(self.scale), len(self.scale)))
        for parity, _, part in self.system.parts(self.vectors):
            found -= part.T @ (operators(parity) @ part)
        found = (found + found.T) / 2
        return (
            self.film.copies
            * found
            * self.film.units.deflection**2
            / np.outer(self.scale, self.scale)
        )


def _modes(film: PlateFilm, system: FilmSystem, places: np.ndarray) -> tuple[Array, Array]:
    """Modes (n, m) of unit mass on the meshed part, in-plane motion and inertia included, from the
    named ones in rising order; and their squared frequencies (m,).
    """
    start = np.concatenate([_deflection(film, system, place) for place in places], axis=1)
    values = film.values[places]
    if film.discrete.shape is None:
        return start, values
    return near(system, start, values)


def _deflection(film: PlateFilm, system: FilmSystem, place: int) -> Array:
    """Deflection (n, 1) of a named mode, of unit mass."""
    parity = film.parities[place]
    column = film.of_class(parity).tolist().index(place)
    number = system.classes.deflections.index(parity)
    return system.embed(number, film.shapes(parity)[:, [column]])
