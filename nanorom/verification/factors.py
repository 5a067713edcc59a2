"""Sparse factors of symmetric positive definite matrices, for many columns at once."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from nanorom.errors import SolverError
from nanorom.types import Array


class Factors:
    """LU factors without pivoting of a symmetric matrix; ``meaning`` is for the error message."""

    def __init__(self, matrix: sp.spmatrix, meaning: str) -> None:
        try:
            self._factors = spl.splu(
                sp.csc_matrix(matrix),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SolverError(f"the {meaning} cannot be factorised: {error}") from error
        self.positive = bool((self._factors.U.diagonal() > 0).all())

    def solve(self, columns: Array) -> Array:
        """Solutions (n, m) of right-hand sides (n, m)."""
        return np.asarray(self._factors.solve(np.ascontiguousarray(columns)))
