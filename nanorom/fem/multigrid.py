"""Solvers of what a mesh gives: its factors, or two grids where these are too large.

The two grids are of one mesh: on the film's elements errors are smoothed, and a problem of
degree 2 is factorised.

The coarse space holds all straight lines and parabolas, of the deflection and of the displacement
in the plane, and with them the rigid motions that a smoother cannot see.  Its factors are the only
ones: a fraction of those of the whole matrix (p-multigrid: Ronquist and Patera 1987,
doi:10.1007/BF01061297; Chebyshev smoothing: Adams et al. 2003, doi:10.1016/S0021-9991(03)00194-3).
`Solvers` alone decides between the two; nothing else knows which it is.
"""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem import algebra, compat

COARSE_DEGREE = 2
SMOOTHINGS = 2  # steps of Chebyshev's iteration before and after the coarse problem
SMOOTHED = 0.05  # of the largest eigenvalue: slower ones are left to the coarse problem
POWER_STEPS = 30  # to find the largest eigenvalue
MARGIN = 1.1  # beyond what was found
CONVERGED = 1e-12  # residual relative to the right-hand side
MOST_ITERATIONS = 300
STALLED = 1e-300
LARGEST_FACTORS = 3_000_000  # unknowns of a problem that is still factorised unless asked


@attrs.define(eq=False)
class Solvers:
    """What makes a solver for a matrix, and remembers how well iterations went.

    kind : "factors", "multigrid", or "auto": by the number of unknowns.
    """

    kind: str = "auto"
    iterations: int = 0
    residual: float = 0.0

    def make(
        self, free: algebra.FreeDofs, matrix: PETSc.Mat, prefix: str, meaning: str
    ) -> algebra.Factorization | Multigrid:
        """Solver for a matrix on the free degrees of freedom. Collective."""
        if self.iterates(free):
            return Multigrid(matrix, prolongation(free), prefix, meaning, self)
        return algebra.Factorization(matrix, prefix, meaning)

    def iterates(self, free: algebra.FreeDofs) -> bool:
        """Whether solutions are found by iterations."""
        wanted = self.kind == "multigrid" or self.kind == "auto" and free.size > LARGEST_FACTORS
        return wanted and has_coarse(free)

    def note(self, iterations: int, residual: float) -> None:
        """Remember the worst of what iterations came to."""
        self.iterations = max(self.iterations, iterations)
        self.residual = max(self.residual, residual)

    def told(self, across: MPI.Comm) -> dict[str, int | float]:
        """The worst of all groups of ranks, for a model's diagnostics. Collective."""
        worst = np.array([self.iterations, self.residual])
        across.Allreduce(MPI.IN_PLACE, worst, op=MPI.MAX)
        if not worst[1]:
            return {}
        return {"solver_iterations": int(worst[0]), "solver_residual": float(worst[1])}


def has_coarse(free: algebra.FreeDofs) -> bool:
    """Whether the degree of a space is above that of the coarse one."""
    return compat.cell_dofs(free.space).shape[1] > (COARSE_DEGREE + 1) * (COARSE_DEGREE + 2) // 2


class Multigrid:
    """Solutions with a symmetric positive definite matrix by conjugate gradients on two grids.

    prolongation : (fine rows, coarse columns).  Raises IndefiniteError, which calls the matrix by
    its ``meaning``, if the coarse problem is not positive definite.
    """

    def __init__(
        self,
        matrix: PETSc.Mat,
        prolongation: PETSc.Mat,
        prefix: str,
        meaning: str,
        solvers: Solvers,
    ) -> None:
        self.matrix, self.prolongation, self.meaning = matrix, prolongation, meaning
        self._solvers = solvers
        diagonal = matrix.getDiagonal()
        if not diagonal.min()[1] > 0:
            raise algebra.IndefiniteError(f"the {meaning} is not positive definite")
        self._inverse = 1 / diagonal.array[:, None]
        self._coarse_matrix = matrix.ptap(prolongation)
        self._coarse = algebra.Factorization(self._coarse_matrix, prefix, meaning)
        self._sum = matrix.comm.tompi4py().allreduce
        self._largest = MARGIN * self._largest_eigenvalue()

    def reset(self) -> None:
        """Free the coarse problem's factors now. Collective."""
        self._coarse.reset()
        self._coarse_matrix.destroy()

    def _largest_eigenvalue(self) -> float:
        """Of D^-1 A, by the power method from a rough start that any ranks make alike."""
        first, last = self.matrix.getOwnershipRange()
        x = np.cos(1.0 + np.arange(first, last) ** 2 % 997)[:, None]
        size = 1.0
        for _ in range(POWER_STEPS):
            x = self._inverse * algebra.multiply(self.matrix, x)
            size = float(np.sqrt(self._sum(np.sum(x**2))))
            x /= size
        return size

    def solve_once(self, right_hand_sides: np.ndarray) -> np.ndarray:
        """One cycle: about the solutions (owned rows, m). Symmetric, so it preconditions.

        Collective.
        """
        x = self._smoothed(right_hand_sides)
        residual = right_hand_sides - algebra.multiply(self.matrix, x)
        coarse = algebra.transposed(self.prolongation, residual)
        x += algebra.multiply(self.prolongation, self._coarse.solve_once(coarse))
        return x + self._smoothed(right_hand_sides - algebra.multiply(self.matrix, x))

    def _smoothed(self, residual: np.ndarray) -> np.ndarray:
        """Chebyshev's polynomial in D^-1 A of a residual."""
        middle, half = 0.5 * (1 + SMOOTHED) * self._largest, 0.5 * (1 - SMOOTHED) * self._largest
        ratio = half / middle
        step = self._inverse * residual / middle
        x = step.copy()
        for _ in range(SMOOTHINGS - 1):
            residual = residual - algebra.multiply(self.matrix, step)
            previous, ratio = ratio, 1 / (2 * middle / half - ratio)
            step = ratio * (previous * step + 2 / half * self._inverse * residual)
            x += step
        return x

    def solve(self, right_hand_sides: np.ndarray) -> np.ndarray:
        """Solutions (owned rows, m) for right-hand sides (owned rows, m), all at once. Collective.

        Raises SolverError if a relative residual stays above `algebra.RESIDUAL_TOLERANCE`.
        """
        residual = right_hand_sides.copy()
        x = np.zeros_like(residual)
        size = np.sqrt(self._dot(residual, residual))
        step, old = np.zeros_like(residual), np.ones(residual.shape[1])
        left = size
        iterations = 0
        while (left > CONVERGED * size).any() and iterations < MOST_ITERATIONS:
            iterations += 1
            corrected = self.solve_once(residual)
            new = self._dot(residual, corrected)
            step = corrected + step * (new / np.maximum(old, STALLED))
            image = algebra.multiply(self.matrix, step)
            length = new / np.maximum(self._dot(step, image), STALLED)
            x += length * step
            residual -= length * image
            old = new
            left = np.sqrt(self._dot(residual, residual))
        relative = float((left / np.maximum(size, STALLED)).max(initial=0.0))
        self._solvers.note(iterations, relative)
        if not relative <= algebra.RESIDUAL_TOLERANCE:
            raise SolverError(
                f"the {self.meaning} was solved to a relative residual of {relative:.1e} only in "
                f"{iterations} iterations of multigrid; check the mesh for degenerate cells, or "
                'set reduction.solver = "factors"'
            )
        return x

    def _dot(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.asarray(self._sum(np.einsum("ij,ij->j", first, second)))


def prolongation(free: algebra.FreeDofs, degree: int = COARSE_DEGREE) -> PETSc.Mat:
    """From the free degrees of freedom of a lower degree on the same mesh. Collective."""
    fine = free.space
    coarse = compat.lagrange_space(fine.mesh, degree, fine.dofmap.index_map_bs)
    whole = compat.interpolation_matrix(coarse, fine)
    # what does not vanish at a held node is held itself
    held = np.ones(free.n_owned, dtype=bool)
    held[free.local] = False
    row, column, value = whole.getValuesCSR()
    rows = np.repeat(np.arange(len(row) - 1), np.diff(row))
    touching = np.unique(column[held[rows] & (np.abs(value) > 1e-8)])
    mark = whole.createVecRight()
    mark.setValues(touching, np.ones(len(touching)), addv=PETSc.InsertMode.ADD_VALUES)
    mark.assemble()
    coarse_free = algebra.FreeDofs(coarse, np.flatnonzero(mark.array > 0))
    found = whole.createSubMatrix(free.set, coarse_free.set)
    whole.destroy()
    return found
