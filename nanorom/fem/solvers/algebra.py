"""Sparse algebra on the free degrees of freedom: restriction, one factorisation, many solves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp
from dolfinx import fem
from dolfinx.fem import petsc as _assembly
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.solvers import compat

SOLVED = 1e-12  # relative error at which iterations end unless less is asked for
REFINED = 1e-13  # relative residual above which a direct solution is refined
ROUNDED = 2 * np.finfo(float).eps  # of matrix times solution: rounding it leaves as much
MOST_REFINEMENTS = 2
TURNED = "nanorom_turned"  # what a restricted matrix keeps for others of its entries
RESIDUAL_TOLERANCE = 1e-9  # of a direct solve; beyond it the factorisation is not to be trusted
# null pivots are found; no ScaLAPACK root, which hides inertia; room, in percent of what the
# analysis expects, for pivots that several ranks have to delay
MUMPS = {"mat_mumps_icntl_24": 1, "mat_mumps_icntl_13": 1, "mat_mumps_icntl_14": 100}


class IndefiniteError(SolverError):
    """A matrix that should be positive definite is not."""


def assemble(form: Any) -> PETSc.Mat:
    """Assembled matrix of a compiled bilinear form, no boundary conditions. Collective."""
    matrix = _assembly.assemble_matrix(form)
    matrix.assemble()
    return matrix


class FreeDofs:
    """The degrees of freedom of a space that no support holds.

    fixed : local numbers (unrolled, ghosts included) of the supported degrees of freedom.
    turned : local nodes (k,) whose first two components are held along directions (k, 2) alone;
        the free degree of freedom there is the displacement across.
    """

    def __init__(
        self, space: Any, fixed: np.ndarray, turned: tuple[np.ndarray, np.ndarray] | None = None
    ) -> None:
        index_map, block = space.dofmap.index_map, space.dofmap.index_map_bs
        self.n_owned = index_map.size_local * block
        self.n_local = self.n_owned + index_map.num_ghosts * block
        self.space = space
        self.comm = space.mesh.comm
        start = index_map.local_range[0] * block
        free = np.ones(self.n_owned, dtype=bool)
        free[fixed[fixed < self.n_owned]] = False
        self.turned = turned is not None and bool(self.comm.allreduce(len(turned[0])))
        self._first, self._along = np.empty(0, dtype=np.int64), np.empty((0, 2))
        if turned is not None:
            self._first, self._along = block * turned[0], turned[1]
            free[self._first[self._first < self.n_owned]] = False
        self.local = np.flatnonzero(free)
        self.set = PETSc.IS().createGeneral(
            (start + self.local).astype(PETSc.IntType), comm=self.comm
        )
        self.size = self.set.getSize()

    def extended(self, values: np.ndarray) -> np.ndarray:
        """Local values (local dofs, m), ghosts too, of owned free ones (rows, m). Collective."""
        found = np.zeros((self.n_local, values.shape[1]))
        if self.comm.size == 1:
            found[self.local] = values
            return self._turned_back(found)
        function = fem.Function(self.space)
        for i in range(values.shape[1]):
            function.x.array[:] = 0.0
            function.x.array[self.local] = values[:, i]
            function.x.scatter_forward()
            found[:, i] = function.x.array
        return self._turned_back(found)

    def taken(self, values: np.ndarray) -> np.ndarray:
        """Owned free rows (rows, ...) of owned or local values (dofs, ...)."""
        if not self.turned:
            return values[self.local]
        own = self._first < self.n_owned
        at, (x, y) = self._first[own], self._along[own].T
        turned = values[: self.n_owned].copy().T
        along, across = turned[..., at], turned[..., at + 1]
        turned[..., at], turned[..., at + 1] = x * along + y * across, x * across - y * along
        return turned.T[self.local]

    def _turned_back(self, values: np.ndarray) -> np.ndarray:
        """Components along x and y, in place, of values (local dofs, m) along held directions."""
        at, (x, y) = self._first, self._along.T[..., None]
        along, across = values[at].copy(), values[at + 1].copy()
        values[at], values[at + 1] = x * along - y * across, y * along + x * across
        return values

    def summed(self, values: np.ndarray) -> np.ndarray:
        """Owned free rows (rows, m) of local values (local dofs, m), ghosts' added. Collective."""
        if self.comm.size == 1:
            return self.taken(values)
        function = fem.Function(self.space)
        found = np.empty((len(self.local), values.shape[1]))
        for i in range(values.shape[1]):
            function.x.array[:] = values[:, i]
            compat.scatter_reverse_add(function)
            found[:, i] = self.taken(function.x.array)
        return found

    def restrict(self, matrix: PETSc.Mat, into: PETSc.Mat | None = None) -> PETSc.Mat:
        """Rows and columns of the free degrees of freedom. Collective."""
        if not self.turned:
            return matrix.createSubMatrix(self.set, self.set, into)
        if into is None:
            turning = self._turning(matrix)
            whole = matrix.ptap(turning)
        else:
            turning, whole = into.getAttr(TURNED)
            matrix.ptap(turning, whole)
        found = whole.createSubMatrix(self.set, self.set, into)
        found.setAttr(TURNED, (turning, whole))  # of the same entries the next time
        return found

    def _turning(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """Matrix from values along held directions and across them to those along x and y."""
        found = PETSc.Mat().createAIJ(matrix.getSizes(), nnz=(2, 2), comm=self.comm)
        start = matrix.getOwnershipRange()[0]
        own = self._first < self.n_owned
        straight = np.ones(self.n_owned, dtype=bool)
        for at, (x, y) in zip(self._first[own], self._along[own]):
            straight[at : at + 2] = False
            pair = np.array([start + at, start + at + 1], dtype=PETSc.IntType)
            found.setValues(pair, pair, [x, -y, y, x])
        for row in start + np.flatnonzero(straight):
            found.setValue(int(row), int(row), 1.0)
        found.assemble()
        return found


def use_cholesky(solver: PETSc.KSP) -> None:
    """Make a Krylov solver a direct one: Cholesky factors of MUMPS that know their inertia."""
    options = PETSc.Options(solver.getOptionsPrefix())
    for control, value in MUMPS.items():
        if not options.hasName(control):
            options[control] = value
    solver.setType("preonly")
    factor = solver.getPC()
    factor.setType("cholesky")
    factor.setFactorSolverType("mumps")
    solver.setFromOptions()


def negative_pivots(solver: PETSc.KSP) -> int:
    """Number of negative eigenvalues of a factorised symmetric matrix (Sylvester's inertia)."""
    return int(solver.getPC().getFactorMatrix().getInertia()[0])


class Factors:
    """A matrix and the direct solver that has its factors."""

    def __init__(self, matrix: PETSc.Mat, solver: PETSc.KSP) -> None:
        self.matrix = matrix
        self.solver = solver

    def reset(self) -> None:
        """Free the factors, which are large, now. Collective."""
        self.solver.reset()

    def solve_once(self, right_hand_sides: np.ndarray) -> np.ndarray:
        """Solutions (owned rows, m) for right-hand sides (owned rows, m), to the factors' digits.

        Collective.
        """
        b = dense(self.matrix, right_hand_sides)
        x = dense(self.matrix, np.zeros_like(right_hand_sides))
        self.solver.getPC().getFactorMatrix().matSolve(b, x)
        solution = np.array(x.getDenseArray())
        b.destroy()
        x.destroy()
        return solution


class Factorization(Factors):
    """Cholesky factors of a symmetric positive definite matrix, for many right-hand sides.

    Raises IndefiniteError, which calls the matrix by its ``meaning``, if it is not positive
    definite.
    """

    columns = 64  # solved at once

    def __init__(self, matrix: PETSc.Mat, prefix: str, meaning: str) -> None:
        super().__init__(matrix, PETSc.KSP().create(matrix.comm))
        self.meaning = meaning
        self._scale = matrix.getDiagonal().max()[1]
        self.solver.setOptionsPrefix(prefix)
        self.solver.setOperators(matrix)
        use_cholesky(self.solver)
        try:
            self.solver.setUp()
        except PETSc.Error as error:
            raise SolverError(f"the {meaning} cannot be factorised: {error}") from error
        negative = negative_pivots(self.solver)
        if negative:
            raise IndefiniteError(
                f"the {meaning} is not positive definite: {negative} negative pivots"
            )

    def solve(self, right_hand_sides: np.ndarray, error: float = SOLVED) -> np.ndarray:
        """Solutions (owned rows, m) for right-hand sides (owned rows, m), all at once. Collective.

        Factors are as good as they are, whatever ``error`` would do.  Raises SolverError if a
        relative residual exceeds `RESIDUAL_TOLERANCE`.
        """
        solution = self.solve_once(right_hand_sides)
        for _ in range(MOST_REFINEMENTS):
            residual = right_hand_sides - multiply(self.matrix, solution)
            scaled = self._scale * solution
            squares = [np.sum(a**2) for a in (residual, right_hand_sides, scaled)]
            size = np.sqrt(self.matrix.comm.tompi4py().allreduce(np.array(squares)))
            if not size[0] > max(REFINED * size[1], ROUNDED * size[2]):
                return solution
            solution = solution + self.solve_once(residual)
        if not size[0] <= RESIDUAL_TOLERANCE * (size[1] + size[2]):
            raise SolverError(
                f"the {self.meaning} was solved to a relative residual of "
                f"{size[0] / (size[1] + size[2]):.1e} only; check the mesh for degenerate cells"
            )
        return solution


def multiply(matrix: PETSc.Mat, columns: np.ndarray) -> np.ndarray:
    """Product (owned rows, m) of a matrix with many columns (owned rows, m). Collective."""
    if not np.diff(matrix.getOwnershipRangesColumn()).all():  # of which PETSc 3.25 dies at once
        return _one_by_one(matrix.mult, matrix.createVecRight(), matrix.createVecLeft(), columns)
    x = dense(matrix, columns)
    y = matrix.matMult(x)
    product = np.array(y.getDenseArray())
    x.destroy()
    y.destroy()
    return product


def transposed(matrix: PETSc.Mat, columns: np.ndarray) -> np.ndarray:
    """Product (owned columns, m) of a matrix' transpose with columns. Collective."""
    x, y = matrix.createVecLeft(), matrix.createVecRight()
    return _one_by_one(matrix.multTranspose, x, y, columns)


def _one_by_one(
    apply: Callable[[PETSc.Vec, PETSc.Vec], None], x: PETSc.Vec, y: PETSc.Vec, columns: np.ndarray
) -> np.ndarray:
    """What ``apply`` makes of every column in turn, by two vectors that it frees. Collective."""
    product = np.empty((y.getLocalSize(), columns.shape[1]))
    for i, column in enumerate(columns.T):
        x.array[:] = column
        apply(x, y)
        product[:, i] = y.array
    x.destroy()
    y.destroy()
    return product


def dense(matrix: PETSc.Mat, columns: np.ndarray) -> PETSc.Mat:
    """Columns (owned rows, m) as a dense matrix that a sparse one can multiply. Collective."""
    sizes = ((len(columns), matrix.getSize()[1]), (PETSc.DECIDE, columns.shape[1]))
    values = np.array(columns.T, dtype=PETSc.ScalarType).ravel()  # column after column
    block = PETSc.Mat().createDense(sizes, array=values, comm=matrix.comm)
    block.assemble()
    return block


def as_csr(matrix: PETSc.Mat) -> sp.csr_matrix:
    """A matrix of one process as one of SciPy's."""
    rows, columns, values = matrix.getValuesCSR()
    return sp.csr_matrix((values, columns, rows), matrix.getSize())


def assemble_vector(form: Any) -> np.ndarray:
    """Owned entries of an assembled linear form, summed over the ranks. Collective."""
    vector = _assembly.assemble_vector(form)
    vector.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
    values = vector.array.copy()
    vector.destroy()
    return values
