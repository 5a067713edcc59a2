"""Eigenpairs to the last digits, by Rayleigh's quotient of the energy.

The entries of a bending matrix are of the order D k^4/h^2 and cancel on a smooth shape: what is
left of phi.K phi carries their rounding, 1e-10 of it on a drum with an edge layer and 1e-6 on fine
meshes, other digits for every order in which cells are summed.  The force of a deflection,
assembled from the energy's first derivative, has no such loss: the curvature is taken first, cell
by cell, and the rounding of the matrix enters only as that of a preconditioner.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.fem import algebra, compat
from nanorom.fem.plate import Plate
from nanorom.fem.symmetry import Parity

POLISHED = 1e-10  # relative change of a shape below which it is not corrected again
MOST_CORRECTIONS = 8
Columns = Callable[[np.ndarray], np.ndarray]  # (owned rows, m) -> (owned rows, m)


class EnergyForce:
    """Gradient of an energy that is quadratic in a function, without an assembled matrix."""

    def __init__(self, function: Any, energy: Any) -> None:
        self._function = function
        self._sum = fem.Function(function.function_space)
        dofmap = function.function_space.dofmap
        self._n_owned = dofmap.index_map.size_local * dofmap.index_map_bs
        self._gradient = compat.form(ufl.derivative(energy, function))

    def __call__(self, columns: np.ndarray) -> np.ndarray:
        """Force (owned dofs, m) of displacements (local dofs, m). Collective."""
        values, total = self._function.x.array, self._sum.x.array
        kept = values.copy()
        forces = []
        for column in columns.T:
            values[:] = column
            total[:] = 0.0
            fem.assemble_vector(total, self._gradient)
            compat.scatter_reverse_add(self._sum)
            forces.append(total[: self._n_owned].copy())
        values[:] = kept
        return np.column_stack(forces)


class LinearForce:
    """Force of a film's quadratic energy on displacements of any class of symmetry.

    energy : quadratic in the function; deflection : that of the function (UFL).
    """

    def __init__(self, plate: Plate, function: Any, deflection: Any, energy: Any) -> None:
        if plate.bending:
            energy = energy + plate.mirror_energy(deflection)
        self._plate = plate
        self._force = EnergyForce(function, energy)

    @classmethod
    def of(cls, plate: Plate) -> LinearForce:
        """That of tension, bending and attraction on the plate's deflections."""
        return cls(plate, plate.w, plate.w, plate.linear_energy(plate.w))

    def __call__(self, parity: Parity, columns: np.ndarray) -> np.ndarray:
        """Force (owned dofs, m) of displacements (local dofs, m) of one parity. Collective."""
        self._plate.set_parity(parity)
        return self._force(columns)


def polished(
    force: Columns, mass: PETSc.Mat, solve: Columns, vectors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (m,), sorted, and vectors (owned rows, m) of unit mass. Collective.

    ``vectors`` are close; ``solve`` undoes ``force`` up to the rounding of its factors.  Inverse
    iteration on the residual, with Ritz values (Knyazev 2001, doi:10.1137/S1064827500366124,
    without the search directions that only far starts need).
    """
    comm = mass.comm.tompi4py()
    for _ in range(MOST_CORRECTIONS):
        forces, masses = force(vectors), algebra.multiply(mass, vectors)
        values, rotation = ritz(comm, vectors, forces, masses)
        vectors, forces, masses = vectors @ rotation, forces @ rotation, masses @ rotation
        correction = solve(forces - masses * values)
        vectors = vectors - correction
        change, size = comm.allreduce(
            np.stack([np.sum(a**2, axis=0) for a in (correction, vectors)])
        )
        if np.all(change <= POLISHED**2 * size):
            break
    return values, vectors


def ritz(
    comm: MPI.Comm, vectors: np.ndarray, forces: np.ndarray, masses: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ritz values (m,) and the rotation (m, m) of the vectors, the same on every rank."""
    products = comm.allreduce(np.stack([vectors.T @ forces, vectors.T @ masses]))
    energy, square = 0.5 * (products + products.transpose(0, 2, 1))
    found: tuple[np.ndarray, np.ndarray] = scipy.linalg.eigh(energy, square)
    return found
