"""A solid's equations of motion on one rank, in the form that invariant manifolds are made from.

M u'' + K u + Q(u, u) + T(u, u, u) = 0
"""

from __future__ import annotations

import attrs
import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from nanorom.errors import SolverError
from nanorom.fem.models.solid import Solid


@attrs.frozen(eq=False)
class SolidSystem:
    """Matrices (n, n) and multilinear forces of all free degrees of freedom of a solid.

    By its modulus, density and length; forces are of columns (n, p), real or complex.
    """

    solid: Solid
    mass: csr_matrix
    stiffness: csr_matrix

    @classmethod
    def of(cls, solid: Solid) -> SolidSystem:
        """Of a solid on one rank; raises SolverError on several."""
        if solid.domain.comm.size > 1:
            raise SolverError("a manifold of a solid is made on one rank; run it without mpirun")
        return cls(solid, sparse(solid.mass), sparse(solid.stiffness))

    @property
    def size(self) -> int:
        """Number of free degrees of freedom n."""
        return int(self.solid.free.size)

    def quadratic(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Q(u, v) (n, p), symmetric in both."""
        return self.solid.quadratic(u, v)

    def cubic(self, u: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """T(u, v, w) (n, p), symmetric in all three."""
        return self.solid.cubic(u, v, w)


def sparse(matrix: PETSc.Mat) -> csr_matrix:
    """A matrix of one rank."""
    rows, columns, values = matrix.getValuesCSR()
    return csr_matrix((values, columns, rows), matrix.getSize())
