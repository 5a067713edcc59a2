"""What simple forces do to every basis function of a plate's mesh, by class of symmetry.

What the finite elements make of them on modes (`fem.output.patterns`) is done here on all basis
functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.fields.places import locate
from nanorom.fem.output import patterns
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Parity
from nanorom.scene.patterns.pattern import Areal
from nanorom.types import Array
from nanorom.verification.assembled import FilmWork, Forces, Operators
from nanorom.verification.tables import geometric

if TYPE_CHECKING:
    from nanorom.verification.plate import PlateFilm


@attrs.frozen(eq=False)
class PlateWork(FilmWork):
    """Virtual work on all basis functions of the meshed part, by class."""

    film: PlateFilm

    def uniform(self, pressure: float = 1.0) -> Forces:
        tables = self.film.discrete.tables
        pushed = tables.push(tables.weights[..., None])[:, 0]
        return {self.film.discrete.even: pressure * self.film.scales.length**2 * pushed}

    def areal(self, pattern: Areal) -> Forces:
        film, length = self.film, self.film.scales.length
        found = {p: np.zeros(film.discrete.tables.nodes) for p in film.plate.mirrors.classes}
        for flip, signs in _copies(film):
            rule = patterns.areal_rule(pattern, film.plate, flip, length)
            pushed = length**2 / film.plate.mirrors.copies * _at(film, *rule)
            for parity, sign in signs.items():
                found[parity] += sign * pushed
        return found

    def points(self, places: Array, weights: Array, key: str) -> Forces:
        film = self.film
        found = {p: np.zeros(film.discrete.tables.nodes) for p in film.plate.mirrors.classes}
        left = np.ones(len(places), dtype=bool)  # no copy has taken them yet
        for flip, signs in _copies(film):
            cells, reference = locate(film.plate, flip * places / film.scales.length)
            here = (cells >= 0) & left
            pushed = _at(film, cells[here], reference[here], weights[here])
            for parity, sign in signs.items():
                found[parity] += sign / film.plate.mirrors.copies * pushed
            left &= ~here
        if left.any():
            raise SceneError(f"{key}: it is not on the film")
        return found

    def inertia(self, acceleration: float = 1.0) -> Forces:
        mass = self.film.scales.mass * self.film.pieces.mass
        return {self.film.discrete.even: -acceleration * mass @ np.ones(mass.shape[1])}

    def stretch(self, tension: float = 1.0) -> Operators:
        discrete = self.film.discrete
        ones = np.full(discrete.tables.weights.shape, tension)
        isotropic = np.stack([ones, ones, np.zeros_like(ones)])
        return lambda parity: geometric(discrete.tables, isotropic, discrete.free[parity])


def _copies(film: PlateFilm) -> list[tuple[Array, dict[Parity, float]]]:
    """Each copy of the meshed part: coordinates (2,) by those of the part, sign of each class."""
    classes = film.plate.mirrors.classes
    ones = np.ones((len(classes), 1))
    flips, signs = film.plate.mirrors.unfold(np.ones((1, 2)), ones, classes)
    return [(flip, dict(zip(classes, own))) for flip, own in zip(flips, signs.T)]


def _at(film: PlateFilm, cells: np.ndarray, reference: Array, weights: Array) -> Array:
    """sum of weights (m,) times basis functions (nodes,) at reference points (m, 2) of cells."""
    dofs = compat.cell_dofs(film.plate.deflections)[cells]
    basis = compat.reference_element(film.plate.degree).tabulate(0, reference)
    found = np.zeros(film.discrete.tables.nodes)
    np.add.at(found, dofs, weights[:, None] * np.asarray(basis).reshape(dofs.shape))
    return found
