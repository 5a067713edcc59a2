"""Linear eigenmodes of the pre-stressed film (step II of the paper), by SLEPc."""

from __future__ import annotations

import attrs
import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from slepc4py import SLEPc

from nanorom.errors import SolverError
from nanorom.fem import algebra, compat
from nanorom.fem.plate import Plate

EIGEN_TOLERANCE = 1e-14  # of the eigensolver, relative to the eigenvalue
EIGEN_ACCEPTED = 1e-8  # relative residual beyond which a mode is refused
DEGENERATE = 1e-6  # eigenvalues closer than this (relative) are equal
NEAR = 1e-3  # neighbours closer than this are computed together, so that they can be told apart
EXTRA = 2  # modes beyond those asked for, so that a pair is not cut in two


@attrs.frozen(eq=False)
class Modes:
    """The lowest modes of a plate, sorted by frequency.

    eigenvalues: (n,) squared frequencies in the plate's units; shapes: (local dofs, n), of unit
    modal mass when solved for; stiffness, mass: assembled on all degrees of freedom; free: those that may move.
    """

    plate: Plate
    eigenvalues: np.ndarray
    shapes: np.ndarray
    stiffness: PETSc.Mat
    mass: PETSc.Mat
    free: algebra.FreeDofs


def clusters(eigenvalues: np.ndarray, tolerance: float = DEGENERATE) -> list[np.ndarray]:
    """Split sorted eigenvalues where neighbours differ by more than a relative tolerance."""
    gaps = np.diff(eigenvalues) > tolerance * np.abs(eigenvalues[1:])
    return np.split(np.arange(len(eigenvalues)), np.flatnonzero(gaps) + 1)


def solve(plate: Plate, count: int) -> Modes:
    """At least the ``count`` lowest modes, no cluster of near ones cut in two. Collective.

    Raises SolverError when the mesh has too few degrees of freedom, when the flat state is not
    stable (the stiffness is not positive definite), or when a mode did not converge.
    """
    stiffness = algebra.assemble(compat.form(plate.stiffness_form()))
    mass = algebra.assemble(compat.form(plate.mass_form()))
    fixed = fem.locate_dofs_topological(plate.deflections, 1, plate.supported)
    free = algebra.FreeDofs(plate.deflections, fixed)
    k, m = free.restrict(stiffness), free.restrict(mass)

    wanted = count + EXTRA
    while True:
        if count > free.size // 2:
            raise SolverError(
                f"{count} modes asked for, but the mesh has only {free.size} free degrees of "
                f"freedom ({free.size // 2} modes at most): refine the mesh or ask for fewer"
            )
        wanted = min(wanted, free.size)
        eigenvalues, vectors = _lowest(k, m, wanted)
        complete = [group for group in clusters(eigenvalues, NEAR) if group[0] < count]
        last = complete[-1][-1] + 1
        if last < wanted or wanted == free.size:
            break
        wanted *= 2

    shapes = np.zeros((free.n_local, last))
    function = fem.Function(plate.deflections)
    for i in range(last):
        function.x.array[:] = 0.0
        function.x.array[free.local] = vectors[:, i]
        function.x.scatter_forward()
        shapes[:, i] = function.x.array
    return Modes(plate, eigenvalues[:last], shapes, stiffness, mass, free)


def _lowest(k: PETSc.Mat, m: PETSc.Mat, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The ``count`` lowest eigenvalues and the owned rows of their vectors."""
    solver = SLEPc.EPS().create(k.comm)
    solver.setOptionsPrefix("nanorom_modes_")
    solver.setOperators(k, m)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(count)
    solver.setTarget(0.0)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTolerances(EIGEN_TOLERANCE)
    transform = solver.getST()
    transform.setType("sinvert")
    transform.setShift(0.0)
    algebra.use_cholesky(transform.getKSP())
    # the same start on any number of ranks and in every run
    start = m.createVecRight()
    start.set(1.0)
    solver.setInitialSpace([start])
    solver.setFromOptions()
    try:
        solver.setUp()
        negative = algebra.negative_pivots(transform.getKSP())
        if negative:
            raise SolverError(
                f"the flat state is not stable: its stiffness has {negative} negative "
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
    vector, image = m.createVecRight(), m.createVecRight()
    values, vectors = np.empty(count), np.empty((vector.getLocalSize(), count))
    for i in range(count):
        values[i] = solver.getEigenpair(i, vector).real
        vectors[:, i] = vector.array
        # in the norm in which the problem is well scaled: |lambda K^-1 M x - x| / |x|
        transform.apply(vector, image)
        image.aypx(-values[i], vector)
        error = image.norm() / vector.norm()
        if not error < EIGEN_ACCEPTED:
            raise SolverError(
                f"mode {i + 1} has a relative residual of {error:.1e}, more than "
                f"{EIGEN_ACCEPTED:.0e}; refine the mesh or check the tension"
            )
    order = np.argsort(values)
    return values[order], vectors[:, order]
