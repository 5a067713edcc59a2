"""How well and how fast the film moves in its own plane.

Both are read off the displacements that condensation finds: how far they are resolved, and how
near they are to a resonance of their own.
"""

from __future__ import annotations

from collections.abc import Iterable

import attrs
import numpy as np

from nanorom.fem.fields import membrane, quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes import accuracy
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors import lateral
from nanorom.fem.tensors.equilibrium import Equilibrium

MOST_COLUMNS = 64  # the displacements of the first pairs are the smoothest
DEPENDENT = 1e-4  # squares of unit displacements below this are those of the mesh's asymmetry


@attrs.frozen
class InPlane:
    """What is known of the displacements that deflections cause.

    error: estimated, of their energy relative to the largest of a deflection; eigenvalue: squared
    frequency of the slowest motion in them, per unit of membrane stiffness and mass per area;
    energies: estimated errors of their energies on the meshed part, per unit of membrane stiffness,
    of the pairs of each mode with itself where they are known, else of all displacements.
    """

    error: float = 0.0
    eigenvalue: float = np.inf
    energies: np.ndarray = attrs.field(factory=lambda: np.zeros(1), eq=False)

    @classmethod
    def of_parts(cls, parts: Iterable[InPlane], largest: float) -> InPlane:
        """Of parts with absolute errors of the energy, whose largest is given."""
        parts = list(parts)
        error = max(part.error for part in parts) / largest
        slowest = min(part.eigenvalue for part in parts)
        return cls(error, slowest, np.concatenate([part.energies for part in parts]))


def known(
    plate: Plate,
    displacements: np.ndarray,
    parity: Parity = (),
    equilibrium: Equilibrium | None = None,
) -> InPlane:
    """What displacements (local dofs, m) of a parity tell, errors not yet relative. Collective.

    equilibrium : the one that made them, with its factors, for a slender film; else None.
    """
    errors = accuracy.in_plane_errors(plate, displacements)
    unit = plate.stiffness.stretching
    columns = displacements[:, :MOST_COLUMNS]
    lowest = slowest(plate, columns, parity)
    held = not membrane.constraints(plate, parity).motions.size
    if equilibrium is not None and held:
        lowest = min(lowest, lateral.slowest(plate, equilibrium, columns))
    return InPlane(float(errors.max()), lowest, errors / unit)


def slowest(plate: Plate, displacements: np.ndarray, parity: Parity = ()) -> float:
    """Lowest squared frequency of Ritz in the span of displacements (local dofs, m), stiffness 1.

    It is above the lowest eigenvalue of what the deflections excite, and what they do not excite
    does not count; a film that is free in its plane does not move as a whole.  Collective.
    """
    columns, m = displacements, displacements.shape[1]
    rigid = membrane.constraints(plate, parity).motions.reshape(len(columns), -1)
    moving = np.column_stack([columns, rigid])
    energy, square = np.zeros((m, m)), np.zeros((moving.shape[1],) * 2)
    for field in quadrature.fields(plate, columns=9 * m):
        weights = field.weights[..., None]
        strain = membrane.strain(plate, field, columns)
        energy += membrane.product(membrane.force(plate, field, strain) * weights, strain)
        dofs = compat.cell_dofs(plate.in_plane)[field.cells]
        inertia = weights if plate.patchwork is None else plate.patchwork.weighed(field, weights)
        for component in (0, 1):
            value = np.matmul(field.values, moving[2 * dofs + component])
            value = value.reshape(-1, len(square))
            square += (value * inertia.reshape(-1, 1)).T @ value
    if plate.stiffness.in_plane:
        energy += membrane.spring_work(plate, columns)
    energy, square = map(plate.domain.comm.allreduce, (energy, square))
    mixed, own = square[:m, m:], square[m:, m:]
    square = square[:m, :m] - mixed @ np.linalg.solve(own, mixed.T)
    size = np.sqrt(square.diagonal())
    moved = size > 0
    if not moved.any():
        return np.inf
    energy, square = (
        a[np.ix_(moved, moved)] / np.outer(size, size)[np.ix_(moved, moved)]
        for a in (energy, square)
    )
    squares, directions = np.linalg.eigh(square)
    basis = (directions / np.sqrt(np.maximum(squares, DEPENDENT)))[:, squares > DEPENDENT]
    lowest = np.linalg.eigvalsh(basis.T @ energy @ basis)[0]
    return float(lowest) / plate.stiffness.stretching
