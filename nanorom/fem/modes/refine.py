"""Eigenpairs to the last digits, by Rayleigh's quotient of the energy.

The entries of a bending matrix are of the order D k^4/h^2 and cancel on a smooth shape: what is
left of phi.K phi carries their rounding, 1e-10 of it on a drum with an edge layer and 1e-6 on fine
meshes, other digits for every order in which cells are summed.  The force of a deflection,
assembled from the energy's first derivative, has no such loss: the curvature is taken first, cell
by cell, and the rounding of the matrix enters only as that of a preconditioner.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.fem.models.operators import Columns
from nanorom.fem.solvers import algebra

POLISHED = 1e-12  # relative change of a shape below which it is not corrected again
MOST_CORRECTIONS = 6
MOST_KEPT, KEPT = 5, 2  # directions per vector at which a space is cut down, and to how many
DEPENDENT = 1e-12  # of a square: directions that add nothing to the others


def polished(
    force: Columns,
    mass: PETSc.Mat,
    solve: Columns,
    vectors: np.ndarray,
    corrections: int = MOST_CORRECTIONS,
    guards: int = 0,
    tolerance: float = POLISHED,
    patience: int = MOST_CORRECTIONS,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Eigenvalues (m,), sorted, and vectors (owned rows, m) of unit mass, and their last change.

    ``vectors`` are close, the last ``guards`` of them only to lend a hand; ``solve`` undoes
    ``force`` as far as it can; where ``patience`` corrections do not halve the last one, rounding
    is all that they correct.  The space of the vectors grows by what inverse iteration would
    correct them by, until that is nothing (block Davidson: Crouzeix, Philippe, Sadkane 1994,
    doi:10.1137/0915004).  Collective.
    """
    comm, count = mass.comm.tompi4py(), vectors.shape[1] - guards
    space = Subspace(comm, force, mass)
    new, changes = vectors, []
    best = np.empty(0), vectors, np.inf
    for _ in range(corrections):
        space.add(new)
        values, vectors, residual = space.lowest(count)
        correction = solve(residual)
        sizes = [np.sum(a**2, axis=0) for a in (correction, vectors)]
        change, size = comm.allreduce(np.stack(sizes))
        changes.append(float(np.sqrt((change / size).max())))
        if changes[-1] < best[2]:  # beyond it corrections are of rounding errors
            best = values, vectors - correction, changes[-1]
        far = change > tolerance**2 * size
        if not far.any() or changes[-1] > 0.5 * min(changes[:-patience], default=np.inf):
            break
        space.shrink(KEPT * count, MOST_KEPT * count)
        new = correction[:, far]
    return best


class Subspace:
    """Columns of unit energy, orthogonal in it, with the forces and masses that belong to them.

    In the energy, not in the mass: there a trace of what is rough would count for most.
    """

    def __init__(self, comm: MPI.Comm, force: Columns, mass: PETSc.Mat) -> None:
        self._comm, self._force, self._mass = comm, force, mass
        self._parts: list[np.ndarray] = []  # columns, forces, masses

    def add(self, columns: np.ndarray) -> None:
        """Make the space larger by columns (owned rows, m). Collective.

        Those that add nothing to it are left out.  Raises IndefiniteError if the energy of one is
        not positive.
        """
        new: tuple[np.ndarray, ...]
        new = columns, self._force(columns), algebra.multiply(self._mass, columns)
        whole = self._comm.allreduce(np.sum(new[0] * new[1], axis=0))
        if not (whole > 0).all():
            raise algebra.IndefiniteError("a shape was found whose energy is not positive")
        for _ in range(2):  # once loses orthogonality
            if self._parts:
                share = self._comm.allreduce(self._parts[1].T @ new[0])
                new = tuple(part - old @ share for part, old in zip(new, self._parts))
            energy = self._comm.allreduce(new[0].T @ new[1])
            left = np.diag(energy) > DEPENDENT * whole  # what is not is rounding, of any sign
            if not left.any():
                return
            size, energy = np.sqrt(np.diag(energy)[left]), energy[np.ix_(left, left)]
            squares, rotation = np.linalg.eigh(0.5 * (energy + energy.T) / np.outer(size, size))
            kept = squares > DEPENDENT
            rotation = rotation[:, kept] / np.sqrt(squares[kept]) / size[:, None]
            new = tuple(part[:, left] @ rotation for part in new)
            whole = np.ones(kept.sum())
        if not self._parts:
            self._parts = list(new)
            return
        for i, part in enumerate(new):  # one by one: together they are what fills the memory
            self._parts[i] = np.hstack([self._parts[i], part])

    def lowest(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Ritz values (m,), vectors (owned rows, m) of unit mass, and residuals. Collective."""
        columns, forces, masses = self._parts
        mass = self._comm.allreduce(columns.T @ masses)
        inverse, rotation = np.linalg.eigh(-0.5 * (mass + mass.T))
        values = -1 / inverse[:count]
        rotation = rotation[:, :count] * np.sqrt(values)
        return values, columns @ rotation, forces @ rotation - masses @ rotation * values

    def shrink(self, kept: int, most: int) -> None:
        """Keep the lowest Ritz vectors alone of a space that has more than ``most`` columns."""
        columns, _, masses = self._parts
        if columns.shape[1] > most:
            mass = self._comm.allreduce(columns.T @ masses)
            rotation = np.linalg.eigh(-0.5 * (mass + mass.T))[1][:, :kept]
            for i, part in enumerate(self._parts):
                self._parts[i] = part @ rotation
