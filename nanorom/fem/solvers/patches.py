"""Small problems around the vertices of a mesh, solved exactly: what smooths errors of high degree.

A patch holds the degrees of freedom of the cells around a vertex that do not vanish there, those
on the outer rim left out.  The sum of the patches' solutions is a smoother whose quality does not
depend on the degree (Pavarino 1994, Numer. Math. 66, 493), and which sees whole what a form of
fourth order couples.  A patch reaches as far as the cells that a rank knows, into those of others.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from nanorom.fem.solvers import algebra, compat

INSIDE = 1e-8  # barycentric coordinate of a vertex beyond which a node is inside its patch
AT_ONCE = 512  # patches inverted together


class VertexPatches:
    """Sum over the patches of the inverses of a matrix' blocks, each component by itself.

    In single precision: it only ever corrects.
    """

    def __init__(self, free: algebra.FreeDofs, matrix: PETSc.Mat) -> None:
        first = matrix.getOwnershipRange()[0]
        row = first + np.arange(len(free.local))
        numbers = free.extended(row[:, None] + 1.0)[:, 0].astype(PETSc.IntType) - 1
        local = np.flatnonzero(numbers >= 0)
        self._free, self._local = free, local[np.argsort(numbers[local])]
        if free.comm.size > 1:
            known = PETSc.IS().createGeneral(numbers[self._local], comm=PETSc.COMM_SELF)
            (matrix,) = matrix.createSubMatrices([known], [known])
        self._dofs: list[np.ndarray] = []  # (p, s) of all patches of a size
        self._inverses: list[np.ndarray] = []  # (p, s, s)
        for dofs in patches(free, self._local):
            inverse = np.empty((*dofs.shape, dofs.shape[1]), dtype=np.float32)
            rows = dofs.astype(PETSc.IntType)
            for start in range(0, len(dofs), AT_ONCE):
                some = slice(start, start + AT_ONCE)
                inverse[some] = np.linalg.inv([matrix.getValues(r, r) for r in rows[some]])
            self._dofs.append(dofs)
            self._inverses.append(inverse)
        every = np.concatenate([np.empty(0, np.int32), *(dofs.ravel() for dofs in self._dofs)])
        ones = np.ones(len(every), dtype=np.float32)
        shape = len(self._local), len(every)
        self._spread = csr_matrix((ones, (every, np.arange(len(every)))), shape)

    def __call__(self, residuals: np.ndarray) -> np.ndarray:
        """Corrections (owned rows, m) of residuals (owned rows, m). Collective."""
        whole = self._free.extended(residuals)
        residuals = whole[self._local]
        size = np.maximum(np.abs(residuals).max(axis=0, initial=0.0), np.finfo(float).tiny)
        scaled = np.ascontiguousarray(residuals / size, dtype=np.float32)
        m = residuals.shape[1]
        found = np.empty((self._spread.shape[1], m), dtype=np.float32)
        first = 0
        for dofs, inverse in zip(self._dofs, self._inverses):
            part = found[first : first + dofs.size].reshape(*dofs.shape, m)
            np.matmul(inverse, scaled[dofs], out=part)
            first += dofs.size
        whole[self._local] = (self._spread @ found) * size
        return self._free.summed(whole)


def patches(free: algebra.FreeDofs, local: np.ndarray) -> list[np.ndarray]:
    """Places (p, s) among some local degrees of freedom of all patches of each size s."""
    space, block = free.space, free.space.dofmap.index_map_bs
    nodes = compat.cell_dofs(space)
    vertices = compat.cell_nodes(space.mesh)[:, :3].astype(np.int64)  # for keys beyond 2^31
    places = np.asarray(compat.reference_element(compat.degree_of(nodes.shape[1])).points)
    weights = np.column_stack([1 - places.sum(axis=1), places])  # barycentric, (n, 3)
    number = np.full(free.n_local, -1, dtype=np.int32)
    number[local] = np.arange(len(local))
    found = []
    for component in range(block):
        keys = []  # of a vertex and one of its degrees of freedom
        for corner in range(3):
            own = number[block * nodes[:, weights[:, corner] > INSIDE] + component]
            keys.append((vertices[:, corner, None] * free.n_local + own)[own >= 0])
        vertex, dof = np.divmod(np.unique(np.concatenate(keys)), free.n_local)
        _, starts, counts = np.unique(vertex, return_index=True, return_counts=True)
        for size in np.unique(counts):
            found.append(dof[starts[counts == size][:, None] + np.arange(size)].astype(np.int32))
    return found
