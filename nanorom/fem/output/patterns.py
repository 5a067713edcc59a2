"""Modal forces of the drive that a scene has, over the modes' own polynomials.

J_r = int p phi_r dA per unit of the level.  A spot may be much smaller than a cell: the cells near
it are cut in four until their parts are no larger than it is.
"""

from __future__ import annotations

import attrs
import basix
import numpy as np

from nanorom.errors import SceneError
from nanorom.fem.fields import quadrature
from nanorom.fem.fields.places import locate
from nanorom.fem.fields.surface import Surface
from nanorom.fem.modes import gate as gates
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.output.model import ModalProducts
from nanorom.fem.solvers import compat
from nanorom.rom.patterns import ModalWork
from nanorom.scene.load import VACUUM_PERMITTIVITY
from nanorom.scene.patterns.pattern import Areal

QUADRATURE = 20  # degree, on parts of a cell that are smaller than the length of variation
HALVES = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]])
HALVES = HALVES / HALVES.sum(axis=1, keepdims=True)  # corners and midpoints of a triangle
QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


@attrs.frozen(eq=False)
class PolynomialWork(ModalWork):
    """Virtual work on L modes by their polynomials.

    length, deflection, mass: of the plate's units in m and kg.  A point beside the film raises
    SceneError.  Collective.
    """

    modes: Modes
    products: ModalProducts
    length: float
    deflection: float
    mass: float

    def uniform(self, pressure: float = 1.0) -> np.ndarray:
        return pressure * self.length**2 * self.products.area

    def areal(self, pattern: Areal) -> np.ndarray:
        modes, plate = self.modes, self.modes.plate
        total, whole = np.zeros(modes.shapes.shape[1]), 0.0
        for flip, sign in _mirrored(modes):
            cells, reference, measure = areal_rule(pattern, plate, flip, self.length)
            total += sign * (measure @ _values(modes, cells, reference))
            whole += float(measure.sum())
        comm, area = plate.domain.comm, self.length**2
        pattern.check_meets(area * comm.allreduce(whole))
        return area * comm.allreduce(total)

    def weighed(self, pattern: Areal, others: Modes) -> tuple[np.ndarray, np.ndarray]:
        """int p psi_s phi_j (S, L) and int p psi_s phi_j phi_k (S, L, L), psi another film's modes.

        Collective.
        """
        modes, plate = self.modes, self.modes.plate
        n, m = modes.shapes.shape[1], others.shapes.shape[1]
        once, twice = np.zeros((m, n)), np.zeros((m, n, n))
        for (flip, sign), (_, turn) in zip(_mirrored(modes), _mirrored(others)):
            cells, reference, measure = areal_rule(pattern, plate, flip, self.length)
            phi = sign * _values(modes, cells, reference)
            psi = (turn * _values(others, cells, reference)).T * measure
            once += psi @ phi
            twice += np.einsum("sp,pj,pk->sjk", psi, phi, phi, optimize=True)
        comm, area = plate.domain.comm, self.length**2
        return area * comm.allreduce(once), area * comm.allreduce(twice)

    def points(self, places: np.ndarray, weights: np.ndarray, key: str) -> np.ndarray:
        plate, comm = self.modes.plate, self.modes.plate.domain.comm
        total = np.zeros(self.modes.shapes.shape[1])
        left = np.ones(len(places), dtype=bool)  # nobody has taken them yet
        for flip, sign in _mirrored(self.modes):
            cells, reference = locate(plate, flip * places / self.length)
            holders = np.array(comm.allgather((cells >= 0) & left))
            mine = holders[comm.rank] & (holders.argmax(axis=0) == comm.rank)
            total += sign * (weights[mine] @ _values(self.modes, cells[mine], reference[mine]))
            left &= ~holders.any(axis=0)
        if left.any():
            raise SceneError(f"{key}: it is not on the film")
        return comm.allreduce(total)

    def inertia(self, acceleration: float = 1.0) -> np.ndarray:
        return -acceleration * self.mass * self.products.momentum

    def stretch(self, tension: float = 1.0) -> np.ndarray:
        return -tension * self.products.slope

    def _has(self, gate: int) -> bool:
        known = self.modes.plate.state.attraction
        return known is not None and gate <= len(known.gates)

    def attraction(self, gate: int = 1) -> np.ndarray:
        if not self._has(gate):
            return super().attraction()
        unit = VACUUM_PERMITTIVITY * (self.length / self.deflection) ** 2
        return unit * gates.products(self.modes, gate - 1, 1)

    def softening(self, gate: int = 1) -> np.ndarray:
        if not self._has(gate):
            return super().softening()
        unit = VACUUM_PERMITTIVITY * self.length**2 / self.deflection**3
        return unit * gates.products(self.modes, gate - 1, 2)


def areal_rule(
    pattern: Areal, plate: Surface, flip: np.ndarray, length: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points that integrate against a pattern's density over own cells of one copy of the part.

    Cells (m,), reference points (m, 2) in them and weights (m,) in the plate's unit of area;
    flip (2,): coordinates of the copy by those of the part.
    """
    centre, size, reach = (
        np.array(value) / length for value in (pattern.centre, pattern.size, pattern.reach)
    )
    rule = basix.make_quadrature(basix.CellType.triangle, plate.degree + QUADRATURE)
    points, weights = np.asarray(rule[0]), np.asarray(rule[1])
    inside = np.column_stack([1 - points.sum(axis=1), points])
    cells, corners = _parts(plate, flip * centre, float(size), float(reach))
    reference = (inside @ corners).reshape(-1, 2)
    sides = corners[:, 1:] - corners[:, :1]
    share = np.abs(np.linalg.det(sides))[:, None] * weights
    cells = np.repeat(cells, len(weights))
    x, jacobian = quadrature.map_points(plate, cells, reference)
    density = pattern.density(length * flip * x)
    return cells, reference, density * np.abs(np.linalg.det(jacobian)) * share.ravel()


def _mirrored(modes: Modes) -> list[tuple[np.ndarray, np.ndarray]]:
    """Each copy of the meshed part: coordinates (2,) by those of the part, signs (L,) of shapes."""
    ones = np.ones((modes.shapes.shape[1], 1))
    flips, signs = modes.plate.mirrors.unfold(np.ones((1, 2)), ones, modes.parities)
    return list(zip(flips, signs.T))


def _parts(
    plate: Surface, centre: np.ndarray, size: float, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Parts no larger than a size of own cells in reach: cell (m,) and corners there (m, 3, 2)."""
    cells = np.arange(quadrature.owned_cells(plate))
    corners = np.broadcast_to([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (len(cells), 3, 2))
    done: list[tuple[np.ndarray, np.ndarray]] = []
    while len(cells):
        places = (HALVES @ corners).reshape(-1, 2)
        x, _ = quadrature.map_points(plate, np.repeat(cells, len(HALVES)), places)
        x = x.reshape(len(cells), -1, 2)
        width = np.linalg.norm(np.ptp(x, axis=1), axis=1)
        away = np.linalg.norm(x - centre, axis=2).min(axis=1)
        near, small = away < reach + width, width <= size
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
