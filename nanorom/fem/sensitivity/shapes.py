"""Derivatives of modes by what the stiffness of a flat film is affine in.

K = T_x K_x + T_y K_y + D K_D(nu), so that a mode (K - lambda M) phi = 0 changes by

    (K - lambda M) phi' = -(K' - lambda' M) phi,   lambda' = phi.K'phi / phi.M phi

(Fox and Kapoor 1968, doi:10.2514/3.5008; Nelson 1976, doi:10.2514/3.7211).  The singular equation
is solved by factors of K - sigma M with sigma close to lambda, on the complement of the known
modes of the class, in which their parts are exact.  phi' = 0 at the peak keeps max |phi| = 1.
Pairs that a symmetry of the film makes equal are of different classes where mirrors cut it; of
equal modes of one class the shape has no derivative.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.fields import places
from nanorom.fem.models import operators
from nanorom.fem.models.operators import free_deflections
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State
from nanorom.fem.modes.eigen import DEGENERATE, Modes
from nanorom.fem.modes.normal import peak_places
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity

APART = 1e-3  # of sigma from lambda, relative: factors of a matrix that is not singular
SETTLED = 1e-10  # relative change of a derivative at which corrections end
MOST_STEPS = 60  # a mode that is 0.3 % away leaves a third of the error at each
ACCEPTED = 1e-8  # relative change beyond which a derivative is refused
HALF = 0.25  # step of Poisson's ratio, in which bending is linear
TENSION_X, TENSION_Y, BENDING, POISSON = "tension_x", "tension_y", "bending", "poisson_ratio"

Matrices = dict[Parity, PETSc.Mat]


@attrs.frozen(eq=False)
class ShapeSlopes:
    """By parameter, per its logarithm; per Poisson's ratio itself.

    eigenvalues: (L,) derivatives of lambda; shapes: (local dofs, L) of the shapes; stiffness:
    (L, L) of Phi^T K Phi at fixed shapes.
    """

    eigenvalues: dict[str, np.ndarray]
    shapes: dict[str, np.ndarray]
    stiffness: dict[str, np.ndarray]

    def moved_products(self, modes: Modes, name: str) -> np.ndarray:
        """int phi_r' phi_s (L, L) over the whole film. Collective."""
        own = modes.shapes[: modes.n_owned]
        weighted = algebra.multiply(modes.mass, own)
        found = self.shapes[name][: modes.n_owned].T @ weighted
        found = modes.plate.mirrors.copies * modes.plate.domain.comm.allreduce(found)
        alike = np.array([[a == b for b in modes.parities] for a in modes.parities])
        return np.asarray(np.where(alike, found, 0.0))


def parameters(plate: Plate) -> dict[str, float]:
    """What the stiffness of a plate is affine in, in its units; Poisson's ratio with bending."""
    tension_x, tension_y = plate.state.tension
    found = {TENSION_X: tension_x, TENSION_Y: tension_y}
    if plate.bending:
        found |= {BENDING: plate.stiffness.bending, POISSON: 1.0}
    return {name: value for name, value in found.items() if value}


def slopes(modes: Modes) -> ShapeSlopes:
    """Derivatives of modes of max |phi| = 1 by all parameters of their plate. Collective.

    Raises SolverError where two modes of one class are equal.
    """
    plate = modes.plate
    parts = {name: _part(plate, name) for name in parameters(plate)}
    _check_apart(modes)
    mass = np.diag(modes.modal(dict.fromkeys(modes.parities, modes.mass)))
    stiffness = {name: modes.modal(part) for name, part in parts.items()}
    eigenvalues = {name: np.diag(own) / mass for name, own in stiffness.items()}
    found = {name: np.zeros_like(modes.shapes) for name in parts}
    values = _peak_values(modes)
    for parity in sorted(set(modes.parities)):
        own = [i for i, other in enumerate(modes.parities) if other == parity]
        for i in own:
            columns = _solved(modes, parts, eigenvalues, parity, i, own)
            for name, column in zip(parts, columns.T):
                found[name][:, i] = column - values(i, column) * modes.shapes[:, i]
    compat.free_memory(plate.domain.comm)
    return ShapeSlopes(eigenvalues, found, stiffness)


def _check_apart(modes: Modes) -> None:
    for i, value in enumerate(modes.eigenvalues):
        for j in range(i):
            close = abs(modes.eigenvalues[j] / value - 1) < DEGENERATE
            if close and modes.parities[i] == modes.parities[j]:
                raise SolverError(
                    f"modes {j + 1} and {i + 1} have the same frequency and symmetry: their shapes "
                    "have no derivative; make the film's sides or its tensions different"
                )


def _part(plate: Plate, name: str) -> Matrices:
    """Derivative of the stiffness by the logarithm of a parameter, by class. Collective."""
    if name != POISSON:
        kept = parameters(plate)[name]
        tension = tuple(kept if name == other else 0.0 for other in (TENSION_X, TENSION_Y))
        stiffness = attrs.evolve(plate.stiffness, bending=kept if name == BENDING else 0.0)
        alone = plate.about(State((tension[0], tension[1]))).resisting(stiffness)
        return _copied(operators.ClassStiffness(alone))
    nu = plate.stiffness.poisson_ratio
    ends = []
    for sign in (1, -1):
        stiffness = attrs.evolve(plate.stiffness, poisson_ratio=nu + sign * HALF)
        plain = plate.about(State((0.0, 0.0))).resisting(stiffness)
        ends.append(_copied(operators.ClassStiffness(plain)))
    for parity, matrix in ends[0].items():
        matrix.axpy(-1.0, ends[1][parity], PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        matrix.scale(0.5 / HALF)
    return ends[0]


def _copied(stiffness: operators.ClassStiffness) -> Matrices:
    return {parity: matrix.copy() for parity, matrix in stiffness.items()}


def _solved(
    modes: Modes,
    parts: dict[str, Matrices],
    eigenvalues: dict[str, np.ndarray],
    parity: Parity,
    i: int,
    known: list[int],
) -> np.ndarray:
    """Derivatives (local dofs, p) of a mode by all parameters, without its own part. Collective."""
    free = free_deflections(modes.plate, parity)
    comm, n = free.comm, modes.n_owned
    value, shape = modes.eigenvalues[i], modes.shapes[:n, i : i + 1]
    k, m = free.restrict(modes.stiffness[parity]), free.restrict(modes.mass)
    right = np.column_stack(
        [
            eigenvalues[name][i] * algebra.multiply(modes.mass, shape)[:, 0]
            - algebra.multiply(part[parity], shape)[:, 0]
            for name, part in parts.items()
        ]
    )
    right = free.taken(right)
    basis = free.taken(modes.shapes[:n, known])
    moved = algebra.multiply(m, basis)
    sizes = comm.allreduce(np.sum(basis * moved, axis=0))
    apart = modes.eigenvalues[known] - value
    own = known.index(i)
    apart[own] = np.inf  # its own part is left out
    known_part = comm.allreduce(basis.T @ right) / sizes[:, None] / apart[:, None]
    right = right - moved @ (comm.allreduce(basis.T @ right) / sizes[:, None])

    def rest(columns: np.ndarray) -> np.ndarray:
        """Without parts of the known modes."""
        return columns - basis @ (comm.allreduce(moved.T @ columns) / sizes[:, None])

    shifted = k.copy()
    shifted.axpy(-value * (1 + APART), m, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
    k.axpy(-value, m, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
    solver = _Indefinite(shifted)
    found, change = np.zeros_like(right), np.inf
    for _ in range(MOST_STEPS):
        step = rest(solver.solve_once(right - algebra.multiply(k, found)))
        found = found + step
        size = np.sqrt(comm.allreduce(np.array([np.sum(step**2), np.sum(found**2)])))
        change = size[0] / max(size[1], 1e-300)
        if change < SETTLED or size[1] == 0:
            break
    solver.reset()
    for matrix in (k, m, shifted):
        matrix.destroy()
    if not change < ACCEPTED and size[1] > 0:
        raise SolverError(
            f"the derivative of mode {i + 1} still changes by {change:.1e} of itself; another mode "
            "is too close to it"
        )
    return free.extended(found + basis @ known_part)


class _Indefinite(algebra.Factors):
    """Factors of a symmetric matrix with eigenvalues of both signs."""

    def __init__(self, matrix: PETSc.Mat) -> None:
        solver = PETSc.KSP().create(matrix.comm)
        solver.setOptionsPrefix("nanorom_slopes_")
        solver.setOperators(matrix)
        algebra.use_cholesky(solver)
        solver.setUp()
        super().__init__(matrix, solver)


def _peak_values(modes: Modes) -> Callable[[int, np.ndarray], float]:
    """Value of a deflection (local dofs,) where a mode's |phi| is 1, by that of phi. Collective."""
    plate = modes.plate
    mode, place = peak_places(modes)
    cells, reference = places.locate(plate, place)

    def value(i: int, column: np.ndarray) -> float:
        first = int(np.flatnonzero(mode == i)[0])
        own = np.zeros(2)
        if cells[first] >= 0:
            basis = compat.reference_element(plate.degree).tabulate(0, reference[[first]])
            dofs = compat.cell_dofs(plate.deflections)[cells[first]]
            columns = np.column_stack([column[dofs], modes.shapes[dofs, i]])
            own = np.asarray(basis).ravel() @ columns
        found = next(each for each in plate.domain.comm.allgather(own) if each.any())
        return float(found[0] / found[1])

    return value
