"""What a manifold of all degrees of freedom needs of a film or a solid: matrices and two forces."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix

from nanorom.types import Array


class FullSystem(Protocol):
    """M u'' + K u + Q(u, u) + T(u, u, u) = 0 of n free degrees of freedom u, conservative.

    K is that about a stable static state.  Q and T derive from a potential: u . Q(v, w) and
    u . T(v, w, x) do not depend on the order of their arguments.  Forces are of columns (n, p).
    """

    @property
    def size(self) -> int:
        """Number of degrees of freedom n."""

    @property
    def mass(self) -> csr_matrix:
        """M (n, n), symmetric and positive."""

    @property
    def stiffness(self) -> csr_matrix:
        """K (n, n), symmetric and positive."""

    def quadratic(self, u: Array, v: Array) -> Array:
        """Q(u, v) (n, p), symmetric in both."""

    def cubic(self, u: Array, v: Array, w: Array) -> Array:
        """T(u, v, w) (n, p), symmetric in all three."""

    def pair_products(self, vectors: Array, pairs: np.ndarray) -> Array:
        """2 v_a . T(v_b, v_c, v_d) (p, p) of pairs (p, 2) of vectors (n, r), but for symmetry: the
        mean over the three ways to pair a, b, c and d is 2 v_a . T(v_b, v_c, v_d).
        """
