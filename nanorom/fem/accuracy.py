"""How far a solution is from that of the stated model, read off its own spectral decay.

In every cell the fields are expanded in orthonormal polynomials.  The energy beyond degree p is,
to a constant of order one, the error of a discretisation of degree p, because a Galerkin solution
is the best approximation in energy (Babuska and Osborn 1991 for eigenvalues).  Known for degrees
below the one computed with, it is extrapolated to that degree.  The constants were set against the
exact solutions of discs, squares and strings (``nanorom bench --accuracy``).
"""

from __future__ import annotations

from functools import lru_cache

import attrs
import basix
import numpy as np
from mpi4py import MPI

from nanorom.fem import compat, membrane, quadrature
from nanorom.fem.modes import Modes
from nanorom.fem.plate import Plate

ROUNDING = 0.1 * np.finfo(float).eps  # per root of sum K_ii phi_i^2 / lambda: measured
POINTWISE = 12.0  # from a shape's extrapolated tail in the cells at its peak to its error there
AT_PEAK = 0.9  # of the largest value: what a cell at the peak has somewhere
AVERAGES = 3.0  # from the energy of the tail of a shape to the error of integrals over it
IN_PLANE = 6.0  # from the extrapolated tail of the in-plane displacement to its error
BACK = 2  # degrees between the two tails that are compared


@attrs.frozen(eq=False)
class ModeErrors:
    """Estimated relative errors (n,) of modes: frequency, its part from rounding, averages, scale.

    average: of integrals over the shape; scale: of the value at its peak, to which it is scaled.
    """

    frequency: np.ndarray
    rounding: np.ndarray
    average: np.ndarray
    scale: np.ndarray


def of_modes(modes: Modes, stiffening: float = 0.0) -> ModeErrors:
    """Estimate the errors of frequencies and shapes. Collective.

    stiffening : isotropic tension that acts beyond the plate's own, see `stiffening_of`.
    """
    plate, n_modes = modes.plate, modes.shapes.shape[1]
    local = modes.shapes[compat.cell_dofs(plate.deflections)[: quadrature.owned_cells(plate)]]
    totals, square = np.zeros((2, n_modes)), np.zeros(n_modes)  # energy of the two tails
    heights, tails_of_cells = [np.empty((0, n_modes))], [np.empty((2, 0, n_modes))]
    projections = [_tail_projection(plate.degree, p) for p in _tail_degrees(plate.degree)]
    for field in quadrature.fields(plate, columns=2 * n_modes):
        cells = local[field.cells]
        values = np.matmul(field.values, cells)
        square += _integral(field, values**2)
        heights.append(np.abs(values).max(axis=1))
        tails = [np.matmul(projection, cells) for projection in projections]
        totals += [_linear_energy(plate, field, tail, stiffening) for tail in tails]
        tails_of_cells.append(np.array([_mean_square(field, tail) for tail in tails]))
    comm = plate.domain.comm
    totals, square = comm.allreduce(totals), comm.allreduce(square)
    total_energy = modes.eigenvalues * square
    diagonal = np.zeros(n_modes)
    for parity in sorted(set(modes.parities)):
        own = [i for i, p in enumerate(modes.parities) if p == parity]
        entries = modes.stiffness[parity].getDiagonal().array
        diagonal[own] = np.abs(entries) @ modes.shapes[: modes.n_owned, own] ** 2
    # of the curvature at a point, not of the matrix's entries, which are its squares
    rounding = ROUNDING * np.sqrt(comm.allreduce(diagonal) / total_energy)
    discretisation = 0.5 * extrapolated(totals[1], totals[0]) / total_energy
    # what an integral weighs a shape with varies faster than the shape, and its tail is larger
    average = AVERAGES * 0.5 * totals[1] / total_energy
    height, squares = np.concatenate(heights), np.concatenate(tails_of_cells, axis=1)
    highest = height.max(axis=0, initial=0.0)
    comm.Allreduce(MPI.IN_PLACE, highest, op=MPI.MAX)
    at_peak = np.where(height > AT_PEAK * highest, squares, 0.0).max(axis=1, initial=0.0)
    comm.Allreduce(MPI.IN_PLACE, at_peak, op=MPI.MAX)
    scale = POINTWISE * np.sqrt(extrapolated(at_peak[1], at_peak[0])) / highest
    return ModeErrors(discretisation + rounding, rounding, average, scale)


def stiffening_of(plate: Plate, tension: float | None) -> float:
    """Tension beyond the plate's own that bounds the stiffness about a state of a mean tension.

    Where load made that tension by a deflection w, a mode also stretches the film along grad w,
    by no more than twice of it.
    """
    own = 0.5 * (float(plate.tension_x.value) + float(plate.tension_y.value))
    return 0.0 if tension is None else 3 * max(tension - own, 0.0)


def of_state(plate: Plate, deflection: np.ndarray, stiffening: float) -> float:
    """Estimated error, relative, that a static deflection (local dofs,) brings to frequencies.

    Both are smooth functionals of the solution, so they err as its energy does. Collective.
    """
    dofs = compat.cell_dofs(plate.deflections)[: quadrature.owned_cells(plate)]
    local = deflection[dofs][..., None]
    projections = [_tail_projection(plate.degree, p) for p in _tail_degrees(plate.degree)]
    energies = np.zeros((3, 1))
    for field in quadrature.fields(plate, columns=2):
        cells = local[field.cells]
        parts = [cells, *(np.matmul(projection, cells) for projection in projections)]
        energies += [_linear_energy(plate, field, part, stiffening) for part in parts]
    total, longer, tail = plate.domain.comm.allreduce(energies)
    return float((extrapolated(tail, longer) / total)[0]) if total[0] > 0 else 0.0


def of_tensor(cubic: np.ndarray, modes: ModeErrors, in_plane: float) -> float:
    """Estimated error of a cubic tensor relative to its largest entry.

    in_plane : estimated error of the condensed in-plane energy, relative to its largest entry.
    """
    own = np.abs(np.einsum("iiii->i", cubic))
    scale = 4 * np.max(modes.scale * own) / np.abs(cubic).max()
    shape = np.max(modes.average)
    return float(scale + shape + IN_PLANE * in_plane + modes.rounding.max())


def in_plane_tails(plate: Plate, displacements: np.ndarray) -> np.ndarray:
    """Membrane energy (2, m) of the tails of in-plane displacements (local dofs, m). Collective."""
    dofs = compat.cell_dofs(plate.in_plane)[: quadrature.owned_cells(plate)]
    energy = np.zeros((2, displacements.shape[1]))
    projections = [_tail_projection(plate.degree, p) for p in _tail_degrees(plate.degree)]
    for field in quadrature.fields(plate, columns=9 * displacements.shape[1]):
        own = 2 * dofs[field.cells]
        for i, projection in enumerate(projections):
            tails = (np.matmul(projection, displacements[own + axis]) for axis in (0, 1))
            strain = membrane.strain_of_cells(field, *tails)
            xx, yy, xy = strain * membrane.force(plate, strain)
            energy[i] += _integral(field, xx + yy + 2 * xy)
    return plate.domain.comm.allreduce(energy)


def extrapolated(tail: np.ndarray, longer: np.ndarray) -> np.ndarray:
    """What is beyond degree k, from what is beyond k - 1 and beyond k - 1 - `BACK`.

    Each degree is taken to shrink the tail by the same factor.
    """
    decay = np.divide(tail, longer, out=np.ones_like(tail), where=longer > 0)
    return tail * decay ** (1 / BACK)


def _tail_degrees(degree: int) -> tuple[int, int]:
    return max(degree - 1 - BACK, 0), degree - 1


@lru_cache(maxsize=16)
def _tail_projection(degree: int, kept: int) -> np.ndarray:
    """Matrix (n, n) from nodal values to those of the part beyond degree ``kept``."""
    nodes = np.asarray(compat.reference_element(degree).points)
    basis = compat.orthonormal_polynomials(degree, nodes)
    beyond = np.arange(len(basis)) >= (kept + 1) * (kept + 2) // 2
    return (basis.T * beyond) @ np.linalg.inv(basis.T)


def _integral(field: quadrature.CellFields, density: np.ndarray) -> np.ndarray:
    """Integral (L,) of a density (c, q, L)."""
    return field.weights.ravel() @ density.reshape(field.weights.size, -1)


def _mean_square(field: quadrature.CellFields, local: np.ndarray) -> np.ndarray:
    """Mean (c, L) over each cell of the square of fields with coefficients (c, n, L) in it."""
    square = np.matmul(field.values, local) ** 2
    return np.einsum("cq,cql->cl", field.weights, square) / field.weights.sum(axis=1)[:, None]


def _linear_energy(
    plate: Plate, field: quadrature.CellFields, local: np.ndarray, stiffening: float
) -> np.ndarray:
    """Energy (L,) of tension and bending inside the cells, without the terms on facets."""
    slope = field.cell_gradient(local)
    tension = np.abs([float(plate.tension_x.value), float(plate.tension_y.value)]) + stiffening
    energy = _integral(field, np.einsum("d,cqdl->cql", tension, slope**2))
    if plate.bending:
        energy += float(plate.bending_stiffness.value) * _integral(
            field, _curvature_square(plate, field, local)
        )
    return energy


def _curvature_square(
    plate: Plate, field: quadrature.CellFields, local: np.ndarray
) -> np.ndarray:
    """|grad grad|^2 (c, q, L), the curvature of the cells' maps left out."""
    points = np.asarray(
        basix.make_quadrature(basix.CellType.triangle, plate.stretching_degree)[0]
    )
    second = np.asarray(compat.reference_element(plate.degree).tabulate(2, points))
    second = second.reshape(6, len(points), -1)[[3, 4, 5]]
    inverse = np.linalg.inv(quadrature.map_cells(plate, field.cells, points)[1])
    xx, xy, yy = (np.matmul(part, local) for part in second)
    reference = np.stack([np.stack([xx, xy], axis=2), np.stack([xy, yy], axis=2)], axis=2)
    curvature = np.einsum("cqijl,cqid,cqje->cqdel", reference, inverse, inverse, optimize=True)
    return np.sum(curvature**2, axis=(2, 3))
