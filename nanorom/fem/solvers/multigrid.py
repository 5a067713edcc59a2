"""Solvers of what a mesh gives: its factors, or two grids where these are too large.

The two grids are of one mesh: errors are smoothed by the patches around its vertices, and what
they cannot see is solved in a low degree (p-multigrid: Ronquist and Patera 1987,
doi:10.1007/BF01061297).  For the displacement in the plane that is degree 1, a sixteenth of the
unknowns of degree 4, left to smoothed aggregation that keeps the rigid motions (PETSc's GAMG;
Vanek, Mandel, Brezina 1996, doi:10.1007/BF02238511).  Bending needs parabolas: there degree 2, a
quarter of the unknowns, is factorised, and its inertia tells of a film that buckles.
`Solvers` alone decides between factors and grids; nothing else knows which it is.
"""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.solvers.patches import VertexPatches

DAMPING = 1.5  # of the patches' sum, over its largest eigenvalue; the iteration stands up to 2
POWER_STEPS = 15  # to find the largest eigenvalue
MOST_ITERATIONS = 300
UNSEEN = 30.0  # times the error asked for: what the residual over the diagonal may come to
STALLED = 1e-300
# unknowns of a problem that is still factorised unless asked: in the plane those of a film with
# 500 000 of w, whose factors bring a run to 5 GB
LARGEST_FACTORS = 1_000_000
GAMG = {"mg_levels_pc_type": "jacobi", "mg_levels_ksp_max_it": 4}  # symmetric


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
            return Multigrid(free, matrix, prefix, meaning, self)
        return algebra.Factorization(matrix, prefix, meaning)

    def iterates(self, free: algebra.FreeDofs) -> bool:
        """Whether solutions are found by iterations."""
        wanted = self.kind == "multigrid" or self.kind == "auto" and free.size > LARGEST_FACTORS
        return wanted and has_coarse(free) and not free.turned

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


def coarse_degree(free: algebra.FreeDofs) -> int:
    """Lowest degree that has what a smoother cannot see: parabolas of w, straight lines of u.

    Only a displacement in the plane has two components.
    """
    return 1 if free.space.dofmap.index_map_bs == 2 else 2


def has_coarse(free: algebra.FreeDofs) -> bool:
    """Whether the degree of a space is above that of the coarse one."""
    return compat.degree_of(compat.cell_dofs(free.space).shape[1]) > coarse_degree(free)


class Multigrid:
    """Solutions with a symmetric positive definite matrix by conjugate gradients on two grids.

    Raises IndefiniteError, which calls the matrix by its ``meaning``, if the coarse problem is not
    positive definite.
    """

    columns = 4  # solved at once: a dozen arrays of them are held

    def __init__(
        self,
        free: algebra.FreeDofs,
        matrix: PETSc.Mat,
        prefix: str,
        meaning: str,
        solvers: Solvers,
    ) -> None:
        self.matrix, self.meaning = matrix, meaning
        self._solvers = solvers
        diagonal = matrix.getDiagonal()
        if not diagonal.min()[1] > 0:
            raise algebra.IndefiniteError(f"the {meaning} is not positive definite")
        self._inverse = 1 / diagonal.array
        coarse_free, self._prolongation = coarse_space(free)
        self._coarse_matrix = matrix.ptap(self._prolongation)
        self._coarse: algebra.Factorization | Aggregation
        if coarse_degree(free) > 1:
            self._coarse = algebra.Factorization(self._coarse_matrix, prefix, meaning)
        else:
            self._coarse = Aggregation(coarse_free, self._coarse_matrix, prefix)
        self._sum = matrix.comm.tompi4py().allreduce
        self._patches = VertexPatches(free, matrix)
        self._damping = DAMPING / self._largest_eigenvalue()

    def reset(self) -> None:
        """Free what the coarse problem's solver holds now. Collective."""
        self._coarse.reset()
        self._coarse_matrix.destroy()
        self._prolongation.destroy()

    def _largest_eigenvalue(self) -> float:
        """Of the patches' sum times A, by the power method from a rough start."""
        first, last = self.matrix.getOwnershipRange()
        x = np.cos(1.0 + np.arange(first, last) ** 2 % 997)[:, None]
        size = 1.0
        for _ in range(POWER_STEPS):
            x = self._patches(algebra.multiply(self.matrix, x))
            size = float(np.sqrt(self._sum(np.sum(x**2))))
            x /= size
        return size

    def solve_once(self, right_hand_sides: np.ndarray) -> np.ndarray:
        """One cycle: about the solutions (owned rows, m). Symmetric, so it preconditions.

        Collective.
        """
        x = self._damping * self._patches(right_hand_sides)
        residual = right_hand_sides - algebra.multiply(self.matrix, x)
        coarse = algebra.transposed(self._prolongation, residual)
        x += algebra.multiply(self._prolongation, self._coarse.solve_once(coarse))
        residual = right_hand_sides - algebra.multiply(self.matrix, x)
        x += self._damping * self._patches(residual)
        return x

    def solve(self, right_hand_sides: np.ndarray, error: float = algebra.SOLVED) -> np.ndarray:
        """Solutions (owned rows, m) for right-hand sides (owned rows, m). Collective.

        error : relative to the solution, in the norm of its energy, at which iterations end; it
        is known to the factor by which a cycle is not yet a solution.  What a cycle does not
        see at all shows in the residual over the diagonal.  Raises SolverError if either stays
        too large.
        """
        x = np.empty_like(right_hand_sides)
        for first in range(0, x.shape[1], self.columns):
            some = slice(first, first + self.columns)
            x[:, some] = self._solved(right_hand_sides[:, some], error)
        return x

    def _solved(self, right_hand_sides: np.ndarray, error: float) -> np.ndarray:
        residual = np.array(right_hand_sides, order="F")
        x, step = np.zeros_like(residual), np.zeros_like(residual)
        corrected = self.solve_once(residual)
        square = whole = self._dot(residual, corrected)
        old = np.ones_like(square)
        relative, iterations = np.inf, 0
        while relative > error and iterations < MOST_ITERATIONS:
            iterations += 1
            step *= square / np.maximum(old, STALLED)
            step += corrected
            image = algebra.multiply(self.matrix, step)
            length = square / np.maximum(self._dot(step, image), STALLED)
            x += length * step
            residual -= length * image
            corrected = self.solve_once(residual)
            old, square = square, self._dot(residual, corrected)
            rough = np.einsum("ij,i,ij->j", residual, self._inverse, residual)
            largest = np.maximum(square, self._sum(rough) / UNSEEN**2)
            relative = float(np.sqrt((largest / np.maximum(whole, STALLED)).max(initial=0.0)))
        self._solvers.note(iterations, relative)
        if not relative <= error:
            raise SolverError(
                f"the {self.meaning} was solved to a relative error of {relative:.1e} only in "
                f"{iterations} iterations of multigrid; check the mesh for degenerate cells, or "
                'set reduction.solver = "factors"'
            )
        return x

    def _dot(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.asarray(self._sum(np.einsum("ij,ij->j", first, second)))


class Aggregation:
    """One cycle of algebraic multigrid for an elastic film in its plane, rigid motions kept."""

    def __init__(self, free: algebra.FreeDofs, matrix: PETSc.Mat, prefix: str) -> None:
        motions = rigid_motions(free, matrix)
        matrix.setNearNullSpace(PETSc.NullSpace().create(vectors=motions, comm=matrix.comm))
        self.solver = PETSc.KSP().create(matrix.comm)
        self.solver.setOptionsPrefix(f"{prefix}coarse_")
        options = PETSc.Options(self.solver.getOptionsPrefix())
        for name, value in GAMG.items():
            if not options.hasName(name):
                options[name] = value
        self.solver.setOperators(matrix)
        self.solver.setType("preonly")
        self.solver.getPC().setType("gamg")
        self.solver.setFromOptions()
        self.solver.setUp()
        self._b, self._x = matrix.createVecs()

    def reset(self) -> None:
        """Free the grids. Collective."""
        self.solver.reset()

    def solve_once(self, right_hand_sides: np.ndarray) -> np.ndarray:
        """About the solutions (owned rows, m) for right-hand sides (owned rows, m). Collective."""
        found = np.empty_like(right_hand_sides)
        for i, column in enumerate(right_hand_sides.T):
            self._b.array[:] = column
            self.solver.solve(self._b, self._x)
            found[:, i] = self._x.array
        return found


def rigid_motions(free: algebra.FreeDofs, matrix: PETSc.Mat) -> list[PETSc.Vec]:
    """Two translations and a rotation in the plane, orthonormal on the free degrees of freedom."""
    places = free.space.tabulate_dof_coordinates()[: free.n_owned // 2, :2]
    one, (x, y) = np.ones(len(places)), places.T
    found: list[PETSc.Vec] = []
    for motion in ((one, 0 * one), (0 * one, one), (-y, x)):
        vector = matrix.createVecRight()
        vector.array[:] = np.stack(motion, axis=1).ravel()[free.local]
        for other in found:
            vector.axpy(-vector.dot(other), other)
        vector.normalize()
        found.append(vector)
    return found


def coarse_space(free: algebra.FreeDofs) -> tuple[algebra.FreeDofs, PETSc.Mat]:
    """Free degrees of freedom of the coarse degree on the same mesh, and prolongation from them.

    Collective.
    """
    fine = free.space
    coarse = compat.lagrange_space(fine.mesh, coarse_degree(free), fine.dofmap.index_map_bs)
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
    return coarse_free, found
