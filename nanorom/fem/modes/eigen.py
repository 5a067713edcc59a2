"""Linear eigenmodes of the pre-stressed film (step II of the paper), by SLEPc."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

import attrs
import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from slepc4py import SLEPc

from nanorom.errors import SolverError
from nanorom.fem.models import operators
from nanorom.fem.models.operators import (
    ClassStiffness,
    Columns,
    LinearForce,
    Stiffness,
    free_deflections,
)
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes import rigid
from nanorom.fem.modes.deflections import Deflections
from nanorom.fem.modes.refine import polished
from nanorom.fem.solvers import (
    algebra,
    compat,
    groups,
    multigrid,
)
from nanorom.fem.symmetry import Parity

EIGEN_TOLERANCE = 1e-12  # of the eigensolver, relative to the eigenvalue
EIGEN_ACCEPTED = 1e-8  # relative residual beyond which a mode is refused
SETTLED = 1e-11  # relative change of a shape at which iterations end; of an eigenvalue its square
PATIENCE = 3, 15  # steps that have to halve the change, or rounding is all they see: matrix, force
MOST_STEPS, MOST_ROUNDS = 120, 6  # of iterations from the modes of degree 2, of new forces
ROUNDED = 0.3  # relative rounding of an eigenvalue from which corrections do not lead back
DEGENERATE = 1e-6  # eigenvalues closer than this (relative) are equal
NEAR = 1e-3  # neighbours closer than this are computed together, so that they can be told apart
COUPLED = 1e-3  # of the stiffness of two modes; near ones that are told apart have up to 5e-4
EXTRA = 2  # modes beyond those asked for, so that a pair is not cut in two


class UnstableError(SolverError):
    """The stiffness of the film's state is not positive definite."""


@attrs.frozen(eq=False, kw_only=True)
class Modes(Deflections):
    """The lowest modes of a plate, of unit modal mass on the meshed part when solved for.

    stiffness: assembled on all degrees of freedom, by class; force: what the stiffness does, to
    more digits.
    """

    film: Plate
    stiffness: Stiffness
    force: LinearForce

    @property
    def plate(self) -> Plate:
        """The film whose modes they are."""
        return self.film

    def modal_stiffness(self) -> np.ndarray:
        """Phi^T K Phi (L, L) over the whole film of tension and bending. Collective."""
        return self._products(self.force)

    def squares(self) -> np.ndarray:
        """int phi^2 (L,) over the whole film. Collective."""
        even = attrs.evolve(self.film, patchwork=None) if self.film.patchwork else self.film
        mass = algebra.assemble(even.compiled(even.mass_form))
        return np.diag(self.modal(dict.fromkeys(self.parities, mass))).copy()


def check_uncoupled(stiffness: np.ndarray, names: Sequence[str]) -> None:
    """Raise SolverError if modes are coupled by their stiffness (L, L): they are no eigenmodes."""
    size = np.sqrt(np.abs(stiffness.diagonal()))
    coupling = np.abs(stiffness) / np.outer(size, size)
    np.fill_diagonal(coupling, 0.0)
    first, second = np.unravel_index(coupling.argmax(), coupling.shape)
    if not coupling[first, second] <= COUPLED:
        raise SolverError(
            f"modes {first + 1} ({names[first]}) and {second + 1} ({names[second]}) are coupled by "
            f"{coupling[first, second]:.1e} of their stiffness, more than {COUPLED:g}: they are no "
            "eigenmodes; refine the mesh or ask for a smaller tolerance"
        )


def clusters(eigenvalues: np.ndarray, tolerance: float = DEGENERATE) -> list[np.ndarray]:
    """Split sorted eigenvalues where neighbours differ by more than a relative tolerance."""
    gaps = np.diff(eigenvalues) > tolerance * np.abs(eigenvalues[1:])
    return np.split(np.arange(len(eigenvalues)), np.flatnonzero(gaps) + 1)


def solve(plate: Plate, count: int) -> Modes:
    """At least the ``count`` lowest modes, no cluster of near ones cut in two. Collective.

    Raises SolverError when the mesh has too few degrees of freedom, when the film's state is not
    stable (the stiffness is not positive definite), or when a mode did not converge.
    """
    mass = operators.mass(plate)
    spared = plate.solvers.iterates(free_deflections(plate, plate.mirrors.even))
    stiffness, force = ClassStiffness(plate, spared), LinearForce.of(plate)
    solvers = {p: ClassSolver(plate, p, stiffness, mass, force) for p in stiffness}
    return lowest_of_classes(plate, solvers, stiffness, mass, force, count)


def lowest_of_classes(
    plate: Plate,
    solvers: Mapping[Parity, ClassSolver],
    stiffness: Stiffness,
    mass: PETSc.Mat,
    force: LinearForce,
    count: int,
) -> Modes:
    """The lowest modes of all classes of symmetry together. Collective."""
    size = sum(solver.free.size for solver in solvers.values())
    if count > size // 2:
        raise SolverError(
            f"{count} modes asked for, but the mesh has only {size} free degrees of freedom "
            f"({size // 2} modes at most): refine the mesh or ask for fewer"
        )
    each = -(-count // len(solvers)) + EXTRA
    _compute(plate, solvers, list(solvers), each)
    while True:
        found = np.sort(np.concatenate([s.eigenvalues for s in solvers.values()]))
        # beyond the last mode asked for by more than a cluster may be wide
        enough = found[count - 1] * (1 + NEAR) ** EXTRA
        short = [p for p, s in solvers.items() if not s.exhausted and s.eigenvalues[-1] <= enough]
        if not short:
            break
        _compute(plate, solvers, short, 2 * max(len(solvers[p].eigenvalues) for p in short))
    values, shapes, parities = _merged(solvers, count)
    return Modes(
        film=plate,
        eigenvalues=values,
        shapes=shapes,
        parities=parities,
        mass=mass,
        stiffness=stiffness,
        force=force,
    )


def _compute(
    plate: Plate, solvers: Mapping[Parity, ClassSolver], classes: list[Parity], count: int
) -> None:
    """The ``count`` lowest modes of some classes, dealt out to the groups of ranks. Collective."""

    def work(own: Sequence[Parity]) -> dict[Parity, tuple[np.ndarray, np.ndarray]]:
        return {parity: solvers[parity].compute(count) for parity in own}

    for parity, found in groups.shared(plate.domain.across, classes, work).items():
        solvers[parity].eigenvalues, solvers[parity].vectors = found


class ClassSolver:
    """Lowest modes of one class of symmetry."""

    def __init__(
        self,
        plate: Plate,
        parity: Parity,
        stiffness: Mapping[Parity, PETSc.Mat],
        mass: PETSc.Mat,
        force: LinearForce,
    ) -> None:
        self.parity = parity
        self.free = free_deflections(plate, parity)
        self._stiffness, self._mass = stiffness, mass
        self._linear_force = force
        self.plate = plate
        self._shift: tuple[float, PETSc.Mat] | None = None
        self.eigenvalues = np.empty(0)
        self.vectors = np.empty((0, 0))

    @property
    def exhausted(self) -> bool:
        """True when every mode that the mesh gives has been computed."""
        return self._shift is None and len(self.eigenvalues) == self.free.size

    def compute(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The ``count`` lowest eigenvalues, or all there are, and their vectors. Collective."""
        k = self.free.restrict(self._stiffness[self.parity])
        m = self.free.restrict(self._mass)
        compat.free_memory(self.free.comm)  # of the class's stiffness on all degrees of freedom
        resisted, shift = self._rigid_motions(m), 0.0
        scale, bent = rigid.scale(self.plate), rigid.bent(self.plate)
        n_rigid = int((resisted < rigid.FREE * scale).sum())
        if n_rigid or resisted.min(initial=np.inf) < rigid.SOFT * bent:
            shift = scale if n_rigid else bent
            k.axpy(shift, m, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self._shift = (shift, m) if n_rigid else None
        asked = min(count + n_rigid, self.free.size)
        if self.plate.solvers.iterates(self.free):
            values, vectors = self._iterated(k, m, asked)
        else:
            values, vectors = lowest(k, m, asked, self._force, 0.0 if n_rigid else shift)
        k.destroy()
        m.destroy()
        compat.free_memory(self.free.comm)
        return values[n_rigid:] - (shift if n_rigid else 0.0), vectors[:, n_rigid:]

    def _iterated(self, k: PETSc.Mat, m: PETSc.Mat, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The lowest modes, by iterations from those of the same mesh in degree 2. Collective."""
        _, coarse = multigrid.coarse_space(self.free)
        pair = k.ptap(coarse), m.ptap(coarse)
        start = algebra.multiply(coarse, lowest(*pair, count + EXTRA)[1])
        for matrix in (*pair, coarse):
            matrix.destroy()
        try:
            solver = self.plate.solvers.make(self.free, k, "nanorom_modes_", "film's stiffness")
            product: Columns = functools.partial(algebra.multiply, k)  # at first: it costs less
            guards, patience = EXTRA, PATIENCE[0]
            for _ in range(MOST_ROUNDS):  # each with new forces: those of rougher shapes are rough
                values, start, change = polished(
                    product, m, solver.solve_once, start, MOST_STEPS, guards, SETTLED, patience
                )
                if change <= SETTLED and product == self._force:
                    break
                product, guards, patience = self._force, 0, PATIENCE[1]
        except algebra.IndefiniteError as error:
            raise UnstableError(
                f"the film's state is not stable: {error}; the compression exceeds the buckling "
                "load, so raise the tension"
            ) from error
        solver.reset()
        self.plate.solvers.note(0, change)
        if not change < EIGEN_ACCEPTED:
            raise SolverError(
                f"modes still changed by {change:.1e} of themselves after {MOST_ROUNDS} rounds of "
                'multigrid; refine the mesh, or set reduction.solver = "factors"'
            )
        return values, start

    def _force(self, vectors: np.ndarray) -> np.ndarray:
        """What the stiffness does to vectors (owned free rows, m), the shift's too. Collective."""
        force = self.free.taken(self._linear_force(self.parity, self.free.extended(vectors)))
        if self._shift is None:
            return force
        shift, mass = self._shift
        return force + shift * algebra.multiply(mass, vectors)

    def _rigid_motions(self, mass: PETSc.Mat) -> np.ndarray:
        """What resists the class's rigid motions, see `rigid.resisted`. Collective."""
        return rigid.resisted(self.plate, self.parity, self.free, mass, self._linear_force)

    def deflection(self, i: int) -> np.ndarray:
        """Deflection (local dofs,) of a mode. Collective."""
        function = fem.Function(self.plate.deflections)
        function.x.array[self.free.local] = self.vectors[:, i]
        function.x.scatter_forward()
        return function.x.array


def _merged(
    solvers: Mapping[Parity, ClassSolver], count: int
) -> tuple[np.ndarray, np.ndarray, list[Parity]]:
    """The lowest modes of all classes together, up to the end of the last cluster."""
    found = sorted(
        (value, parity, i)
        for parity, solver in solvers.items()
        for i, value in enumerate(solver.eigenvalues)
    )
    values = np.array([value for value, _, _ in found])
    last = [group for group in clusters(values, NEAR) if group[0] < count][-1][-1] + 1
    shapes = np.column_stack([solvers[p].deflection(n) for _, p, n in found[:last]])
    parities = [parity for _, parity, _ in found[:last]]
    return values[:last], shapes, parities


def lowest(
    k: PETSc.Mat, m: PETSc.Mat, count: int, force: Columns | None = None, shift: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """The ``count`` lowest eigenvalues and the owned rows of their vectors. Collective.

    ``force``: what k does, to more digits than its entries have, but for ``shift`` times the mass.
    """
    solver = _shift_and_invert(k, m, count)
    transform = solver.getST()
    try:
        solver.setUp()
        negative = algebra.negative_pivots(transform.getKSP())
        if negative:
            raise UnstableError(
                f"the film's state is not stable: its stiffness has {negative} negative "
                "eigenvalues; the compression exceeds the buckling load, so raise the tension"
            )
        solver.solve()
    except PETSc.Error as error:
        raise SolverError(f"the eigensolver failed: {error}") from error
    if solver.getConverged() < count:
        raise SolverError(
            f"only {solver.getConverged()} of {count} modes converged in "
            f"{solver.getIterationNumber()} iterations; refine the mesh or ask for fewer modes"
        )
    vector = m.createVecRight()
    values, vectors = np.empty(count), np.empty((vector.getLocalSize(), count))
    for i in range(count):
        values[i] = solver.getEigenpair(i, vector).real
        vectors[:, i] = vector.array
    factors = algebra.Factors(k, transform.getKSP())
    vectors = _confirmed(factors, m, values, vectors)
    order = np.argsort(values)
    values, vectors = values[order], vectors[:, order]
    if force is not None:
        rounded = values
        values, vectors, _ = polished(force, m, factors.solve_once, vectors)
        change = np.abs(rounded / (values + shift) - 1).max()
        if not change < ROUNDED:
            raise SolverError(
                f"rounding changes the stiffness of modes by {change:.1e}, more than {ROUNDED:g}: "
                "the smallest cells are too stiff beside the film; ask for a larger tolerance or "
                "give the mesh no smaller cells than it needs"
            )
    solver.reset()  # large: not left to what frees objects at its own time
    return values, vectors


def _shift_and_invert(k: PETSc.Mat, m: PETSc.Mat, count: int) -> SLEPc.EPS:
    """Solver for the lowest eigenvalues, the same on any number of ranks and in every run."""
    solver = SLEPc.EPS().create(k.comm)
    solver.setOptionsPrefix("nanorom_modes_")
    solver.setOperators(k, m)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    # vectors enough that most problems converge without a restart
    solver.setDimensions(count, min(2 * count + 14, k.getSize()[0]))
    solver.setTarget(0.0)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTolerances(EIGEN_TOLERANCE)
    transform = solver.getST()
    transform.setType("sinvert")
    transform.setShift(0.0)
    algebra.use_cholesky(transform.getKSP())
    start = m.createVecRight()
    start.set(1.0)
    solver.setInitialSpace([start])
    solver.setPurify(False)  # done below, for all vectors at once
    solver.setFromOptions()
    return solver


def _confirmed(
    factors: algebra.Factors, m: PETSc.Mat, values: np.ndarray, vectors: np.ndarray
) -> np.ndarray:
    """Vectors (owned rows, n) after a step of inverse iteration, and their residuals checked.

    Raises SolverError if one is no eigenvector.  Collective.
    """
    # one step of inverse iteration for all: it clears what a singular mass leaves in the vectors
    vectors = values * factors.solve_once(algebra.multiply(m, vectors))
    # in the norm in which the problem is well scaled: |lambda K^-1 M x - x| / |x|; a trace of
    # the first mode, soft near buckling, counts lambda / lambda_1 times in it
    images = factors.solve_once(algebra.multiply(m, vectors))
    squares = [np.sum(a**2, axis=0) for a in (values * images - vectors, vectors)]
    residual, size = np.sqrt(m.comm.tompi4py().allreduce(np.array(squares)))
    residual *= np.minimum(values.min() / values, 1.0) / size
    worst = int(np.argmax(residual))
    if not residual[worst] < EIGEN_ACCEPTED:
        raise SolverError(
            f"mode {worst + 1} has a relative residual of {residual[worst]:.1e}, more than "
            f"{EIGEN_ACCEPTED:.0e}: rounding of the stiffness moves it, as where cells are small "
            "beside the film or a compression nearly buckles it; ask for a larger tolerance, or "
            "give the mesh no smaller cells than it needs"
        )
    return vectors
