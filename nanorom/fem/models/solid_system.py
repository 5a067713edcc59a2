"""A solid's equations of motion on one rank, in the form that manifolds and orbits are made from.

M u'' + K u + Q(u, u) + T(u, u, u) = 0
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse import csr_matrix

from nanorom.errors import SolverError
from nanorom.fem.models.solid import Solid
from nanorom.fem.solvers import algebra


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
            raise SolverError("all of a solid's motion is solved for on one rank")
        return cls(solid, algebra.as_csr(solid.mass), algebra.as_csr(solid.stiffness))

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

    def linear(self, u: np.ndarray) -> np.ndarray:
        """K u (n, p)."""
        return self.solid.linear(u)

    def force(self, u: np.ndarray) -> np.ndarray:
        """Q(u, u) + T(u, u, u) (n, p)."""
        return self.solid.beyond(u)

    def along(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """2 Q(u, v) + 3 T(u, u, v) (n, p)."""
        return self.solid.along(u, v)

    def pair_products(self, shapes: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """int S_jk:C:S_lm (p, p) of pairs (p, 2) of shapes (n, k)."""
        return self.solid.pair_products(shapes, pairs)
