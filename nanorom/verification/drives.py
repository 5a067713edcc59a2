"""What a drive does to every degree of freedom of the film, by class of symmetry.

The patterns are those of `nanorom.scene.patterns`; what the finite elements make of them on modes
(`fem.output.patterns`) is done here on all basis functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import scipy.sparse.linalg as spl

from nanorom.errors import SceneError
from nanorom.fem.fields.places import locate
from nanorom.fem.output import patterns
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Parity
from nanorom.scene.drive import Drive
from nanorom.scene.patterns.pattern import Areal, VirtualWork
from nanorom.types import Array
from nanorom.verification.assemble import Film
from nanorom.verification.linear import geometric

UNSEEN = 1e-12  # of the largest force: a class that is driven less is not driven


Forces = dict[Parity, Array]  # (nodes,) in N by class
Operators = Callable[[Parity], Any]  # (free, free) in N/m on a class, what it adds to the stiffness


def direct_forces(film: Film, drive: Drive) -> Forces:
    """Forces (free,) in N of the direct pattern at level 1 on the classes that it drives.

    Of the meshed part alone.  Raises SceneError for a point that is not on the film.
    """
    return _driven(film, drive.pattern.force(FilmWork(film)))


def modulation(film: Film, drive: Drive, parity: Parity) -> Any:
    """Operator (free, free) in N/m that level 1 of the parametric pattern times cos adds to K."""
    work = FilmWork(film)
    return drive.modulation.stiffness(work, drive.pattern.force(work))(parity)


def _driven(film: Film, whole: Forces) -> Forces:
    """The same on free degrees of freedom (free,), of the classes that are driven."""
    forces = {p: f[film.discrete.free[p]] for p, f in whole.items()}
    largest = max(float(np.abs(f).max()) for f in forces.values())
    return {p: f for p, f in forces.items() if np.abs(f).max() > UNSEEN * largest}


@attrs.frozen(eq=False)
class FilmWork(VirtualWork[Forces, Operators]):
    """Virtual work on all basis functions of the meshed part, by class."""

    film: Film

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

    def proportional(self, force: Forces) -> Operators:
        driven = _driven(self.film, force)
        return lambda parity: _proportional(self.film, driven, parity)


def _proportional(film: Film, driven: Forces, parity: Parity) -> Any:
    """F_r = J_r q_r of the named modes, with the J_r of a direct force on the whole film."""
    own = film.of_class(parity)
    free = film.discrete.free[parity]
    shapes = film.solution.modes.shapes[free][:, own]
    momenta = film.pieces.mass[free][:, free] @ shapes
    direct = driven.get(parity, np.zeros(len(free)))
    masses = np.einsum("nr,nr->r", shapes, momenta)
    # J_r of all copies, its force on one of them
    factor = -(shapes.T @ direct) / masses**2

    def apply(columns: Array) -> Array:
        pulled = momenta @ (factor[:, None] * (momenta.T @ columns.reshape(len(free), -1)))
        return np.asarray(pulled.reshape(columns.shape))

    return spl.LinearOperator((len(free),) * 2, matvec=apply, matmat=apply)


def _copies(film: Film) -> list[tuple[Array, dict[Parity, float]]]:
    """Each copy of the meshed part: coordinates (2,) by those of the part, sign of each class."""
    classes = film.plate.mirrors.classes
    ones = np.ones((len(classes), 1))
    flips, signs = film.plate.mirrors.unfold(np.ones((1, 2)), ones, classes)
    return [(flip, dict(zip(classes, own))) for flip, own in zip(flips, signs.T)]


def _at(film: Film, cells: np.ndarray, reference: Array, weights: Array) -> Array:
    """sum of weights (m,) times basis functions (nodes,) at reference points (m, 2) of cells."""
    dofs = compat.cell_dofs(film.plate.deflections)[cells]
    basis = compat.reference_element(film.plate.degree).tabulate(0, reference)
    found = np.zeros(film.discrete.tables.nodes)
    np.add.at(found, dofs, weights[:, None] * np.asarray(basis).reshape(dofs.shape))
    return found
