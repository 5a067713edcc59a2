"""What a drive does to every degree of freedom of the film, by class of symmetry."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse.linalg as spl

from nanorom.errors import SceneError
from nanorom.fem.fields.places import locate
from nanorom.fem.output import patterns
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Parity
from nanorom.scene.drive import Drive
from nanorom.types import Array
from nanorom.verification.assemble import Film
from nanorom.verification.linear import geometric

UNSEEN = 1e-12  # of the largest force: a class that is driven less is not driven


def direct_forces(film: Film, drive: Drive) -> dict[Parity, Array]:
    """Forces (free,) of the direct pattern at level 1 on the classes that it drives."""
    whole = {
        "pressure": _pressure,
        "spot": _spot,
        "point": _point,
    }[drive.direct_pattern](film, drive)
    forces = {p: force[film.discrete.free[p]] for p, force in whole.items()}
    largest = max(float(np.abs(f).max()) for f in forces.values())
    return {p: f for p, f in forces.items() if np.abs(f).max() > UNSEEN * largest}


def _pressure(film: Film, drive: Drive) -> dict[Parity, Array]:
    tables = film.discrete.tables
    force = tables.push(tables.weights[..., None])[:, 0]
    return {film.discrete.even: force / film.units.pressure}


def _spot(film: Film, drive: Drive) -> dict[Parity, Array]:
    assert drive.position is not None and drive.radius is not None
    length, copies = film.scales.length, film.plate.mirrors.copies
    radius = drive.radius / length
    found = {p: np.zeros(film.discrete.tables.nodes) for p in film.plate.mirrors.classes}
    for image, signs in _images(film, drive):
        cells, reference, measure = patterns.spot_rule(film.plate, image, radius)
        force = _at(film, cells, reference, measure)
        for parity, sign in signs.items():
            found[parity] += sign * force / (copies * film.units.pressure)
    return found


def _point(film: Film, drive: Drive) -> dict[Parity, Array]:
    copies = film.plate.mirrors.copies
    for image, signs in _images(film, drive):
        cells, reference = locate(film.plate, image[None])
        if cells[0] >= 0:
            force = _at(film, cells, reference, np.ones(1)) / (copies * film.units.force)
            return {parity: sign * force for parity, sign in signs.items()}
    raise SceneError("drive.position: it is not on the film")


def _images(film: Film, drive: Drive) -> list[tuple[Array, dict[Parity, float]]]:
    """The drive's position (2,) mirrored onto the meshed part, and the sign of each class there."""
    assert drive.position is not None
    mirrors = film.plate.mirrors
    classes = mirrors.classes
    place = np.array(drive.position)[None] / film.scales.length
    places, signs = mirrors.unfold(place, np.ones((len(classes), 1)), classes)
    return [(x, dict(zip(classes, own))) for x, own in zip(places, signs.T)]


def _at(film: Film, cells: np.ndarray, reference: Array, weights: Array) -> Array:
    """sum of weights (m,) times basis functions (nodes,) at reference points (m, 2) of cells."""
    dofs = compat.cell_dofs(film.plate.deflections)[cells]
    basis = compat.reference_element(film.plate.degree).tabulate(0, reference)
    basis = np.asarray(basis).reshape(dofs.shape)
    found = np.zeros(film.discrete.tables.nodes)
    np.add.at(found, dofs, weights[:, None] * basis)
    return found


def modulation(film: Film, drive: Drive, parity: Parity) -> Any:
    """Operator (free, free) that level 1 of the parametric pattern multiplies by cos(omega t)."""
    if drive.parametric_pattern == "tension":
        ones = np.ones(film.discrete.tables.weights.shape)
        isotropic = np.stack([ones, ones, np.zeros_like(ones)])
        free = film.discrete.free[parity]
        return geometric(film.discrete.tables, isotropic, free) / film.scales.tension
    return _paper(film, drive, parity)


def _paper(film: Film, drive: Drive, parity: Parity) -> spl.LinearOperator:
    """The force F_r = J_r q_r of the named modes, with J_r (m^2, or 1) of the direct pattern."""
    own = [i for i, p in enumerate(film.parities) if p == parity]
    shapes = film.solution.modes.shapes[film.discrete.free[parity]][:, own]
    momenta = film.pieces.mass[film.discrete.free[parity]][:, film.discrete.free[parity]] @ shapes
    masses = np.einsum("nr,nr->r", shapes, momenta)
    direct = direct_forces(film, drive).get(parity)
    work = np.zeros(len(own)) if direct is None else shapes.T @ direct
    # J_r of the whole film: of its copies, in SI
    unit = film.units.pressure * film.units.length**2
    if drive.direct_pattern == "point":
        unit = film.units.force
    factor = -work * unit / film.scales.tension / masses**2
    n = len(shapes)

    def apply(columns: Array) -> Array:
        force = momenta @ (factor[:, None] * (momenta.T @ columns.reshape(n, -1)))
        return np.asarray(force.reshape(columns.shape))

    return spl.LinearOperator((n, n), matvec=apply, matmat=apply)
