"""Modal forces of a drive that is aimed: a Gaussian spot of light, or a point.

J_r = int p phi_r dA per unit of the level, over the modes' own polynomials.  A spot may be much
smaller than a cell: the cells near it are cut in four until their parts are no larger than it is.
"""

from __future__ import annotations

import basix
import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.fields import quadrature
from nanorom.fem.fields.places import locate
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import compat
from nanorom.scene.drive import Drive

REACH = 3.5  # radii from the centre of a spot at which its intensity is e^-24
QUADRATURE = 20  # degree, on parts of a cell that are smaller than the spot
HALVES = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]])
HALVES = HALVES / HALVES.sum(axis=1, keepdims=True)  # corners and midpoints of a triangle
QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


def aimed(modes: Modes, drive: Drive | None, length: float) -> dict[str, np.ndarray]:
    """The drive's pattern (L,) under its name, in SI units; none where it needs no aim.

    length: of the plate's unit in m.  Raises SceneError if a point is not on the film.
    Collective.
    """
    if drive is None or drive.position is None:
        return {}
    position = np.array(drive.position) / length
    if drive.radius is None:
        return {drive.direct_pattern: point(modes, position)}
    return {drive.direct_pattern: length**2 * spot(modes, position, drive.radius / length)}


def spot(modes: Modes, centre: np.ndarray, radius: float) -> np.ndarray:
    """int phi_r exp(-2 d^2/radius^2) dA (L,) with d the distance from the centre. Collective."""
    plate = modes.plate
    force = np.zeros(modes.shapes.shape[1])
    for image, sign in _images(modes, centre):
        cells, corners = _parts(plate, image, radius)
        rule = basix.make_quadrature(basix.CellType.triangle, plate.degree + QUADRATURE)
        points, weights = np.asarray(rule[0]), np.asarray(rule[1])
        inside = np.column_stack([1 - points.sum(axis=1), points])
        reference = (inside @ corners).reshape(-1, 2)
        sides = corners[:, 1:] - corners[:, :1]
        share = np.abs(np.linalg.det(sides))[:, None] * weights
        cells = np.repeat(cells, len(weights))
        x, jacobian = quadrature.map_points(plate, cells, reference)
        intensity = np.exp(-2 * np.sum((x - image) ** 2, axis=1) / radius**2)
        measure = intensity * np.abs(np.linalg.det(jacobian)) * share.ravel()
        force += sign * (measure @ _values(modes, cells, reference))
    return plate.domain.comm.allreduce(force)


def point(modes: Modes, position: np.ndarray) -> np.ndarray:
    """phi_r (L,) at a position; raises SceneError if it is not on the film. Collective."""
    places, signs = (np.array(part) for part in zip(*_images(modes, position)))
    cells, reference = locate(modes.plate, places)
    here = cells >= 0
    values = signs[here] * _values(modes, cells[here], reference[here])
    found = np.concatenate(modes.plate.domain.comm.allgather(values))
    if len(found) == 0:
        raise SceneError("drive.position: it is not on the film")
    return found[0]


def _images(modes: Modes, place: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """A place (2,) mirrored onto the meshed part, with the shapes' signs (L,) there."""
    ones = np.ones((modes.shapes.shape[1], 1))
    places, signs = modes.plate.mirrors.unfold(place[None], ones, modes.parities)
    return list(zip(places, signs.T))


def _parts(plate: Plate, centre: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Parts of own cells near a spot: cell (m,) and reference corners (m, 3, 2)."""
    cells = np.arange(quadrature.owned_cells(plate))
    corners = np.broadcast_to([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (len(cells), 3, 2))
    done: list[tuple[np.ndarray, np.ndarray]] = []
    while len(cells):
        places = (HALVES @ corners).reshape(-1, 2)
        x, _ = quadrature.map_points(plate, np.repeat(cells, len(HALVES)), places)
        x = x.reshape(len(cells), -1, 2)
        size = np.linalg.norm(np.ptp(x, axis=1), axis=1)
        away = np.linalg.norm(x - centre, axis=2).min(axis=1)
        near, small = away < REACH * radius + size, size <= radius
        done.append((cells[near & small], corners[near & small]))
        cells, corners = cells[near & ~small], corners[near & ~small]
        corners = (HALVES @ corners)[:, QUARTERS].reshape(-1, 3, 2)
        cells = np.repeat(cells, len(QUARTERS))
    parts = [np.concatenate(own) for own in zip(*done)] or [cells, corners]
    return parts[0], parts[1]


def _values(modes: Modes, cells: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Shapes (m, L) at a reference point (m, 2) in each of the cells."""
    basis = compat.reference_element(modes.plate.degree).tabulate(0, reference)
    dofs = compat.cell_dofs(modes.plate.deflections)[cells]
    basis = np.asarray(basis).reshape(dofs.shape)
    return np.einsum("mn,mnr->mr", basis, modes.shapes[dofs])
