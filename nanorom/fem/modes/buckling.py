"""Linear buckling: by how much a compressed flat film is beyond its critical tension.

With the bending stiffness K_b and the geometric stiffness K_T of the stated tension, the flat state
loses its stability at the smallest factor f of that tension for which K_b + f K_T is singular:
mu = 1/f is the largest eigenvalue of -K_T x = mu K_b x.
"""

from __future__ import annotations

import attrs
from petsc4py import PETSc
from slepc4py import SLEPc

from nanorom.errors import SolverError
from nanorom.fem.models.operators import ClassStiffness, free_deflections
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State
from nanorom.fem.solvers import algebra
from nanorom.scene.units import with_unit

TOLERANCE = 1e-10  # of the eigenvalue
NOT_FOUND = "its critical tension was not found"


def told(plate: Plate, unit: float, deflected: bool) -> str:
    """One line for the user: the state is not stable, and what is the critical tension.

    unit : of the plate's tension (N/m), in which a change of stress is counted; deflected : a load
    or its first shape took the film out of its plane; else a pre-stress that is not constant has
    relaxed at free edges.
    """
    if not plate.bending:
        return (
            "the flat state is not stable: a membrane has no stiffness under compression; "
            "raise the tension or give the film bending stiffness (plate.model)"
        )
    if plate.state.prestress is not None and not deflected:
        return _relaxed(plate)
    if not plate.state.uniform:
        return "the static state is not stable under its load; lower the load or raise the tension"
    tension, shear = plate.state.tension, plate.state.shear
    if tension == (0.0, 0.0) and not shear:
        return (
            "the film is not stable: its supports leave it a motion that nothing resists; hold "
            "more of its sides, or clamp one"
        )
    factor = critical_factor(plate)
    x, y = (factor * unit * pull for pull in tension)
    values = with_unit(x, "N/m", 8)
    if x != y:
        values += f" along x and {with_unit(y, 'N/m', 8)} along y"
    if shear:
        values += f" with a shear of {with_unit(factor * unit * shear, 'N/m', 8)}"
    return (
        f"the flat state is not stable: the film buckles at {factor:.6g} of the stated tension; "
        f"the critical tension is {values}: raise the tension above it, or give the film a small "
        "load ([load] pressure), under which its buckled state is found"
    )


def _relaxed(plate: Plate) -> str:
    """What a flat film is told whose pre-stress has relaxed: it compresses some of the film."""
    try:
        factor = critical_factor(plate)
    except SolverError:  # bending resists some motion not at all, or the tension compresses nothing
        return (
            "the film is not stable: its supports leave it a motion that neither bending nor its "
            "pre-stress resists; hold more of its sides, or clamp one"
        )
    return (
        "the film is not stable under its pre-stress, which relaxes where it pulls at free edges "
        f"and compresses the film elsewhere: it buckles at {factor:.6g} of what is stated; state "
        "less, hold more of its sides, or give the film a small load ([load] pressure), under "
        "which its buckled state is found"
    )


def critical_factor(plate: Plate) -> float:
    """Factor of a flat plate's tension, relaxed or not, at which it buckles. Collective.

    Raises SolverError if no factor makes it buckle.
    """
    bending = ClassStiffness(plate.about(State(tension=(0.0, 0.0))))
    loose = dict.fromkeys(plate.stiffness.springs, (0.0, 0.0))
    slack = plate.resisting(attrs.evolve(plate.stiffness, bending=0.0, springs=loose))
    geometric = algebra.assemble(slack.compiled(slack.stiffness_form))
    geometric.scale(-1.0)
    largest = 0.0
    for parity, stiffness in bending.items():
        free = free_deflections(plate, parity)
        largest = max(largest, _largest(free.restrict(geometric), free.restrict(stiffness)))
    if largest <= 0:
        raise SolverError("the flat state is not stable, though its tension nowhere compresses")
    return 1 / largest


def _largest(a: PETSc.Mat, b: PETSc.Mat) -> float:
    """Largest mu of A x = mu B x, B positive definite."""
    solver = SLEPc.EPS().create(a.comm)
    solver.setOptionsPrefix("nanorom_buckling_")
    solver.setOperators(a, b)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.LARGEST_REAL)
    solver.setDimensions(2)
    solver.setTolerances(TOLERANCE, 500)
    algebra.use_cholesky(solver.getST().getKSP())
    start = a.createVecRight()
    start.set(1.0)
    solver.setInitialSpace([start])
    solver.setFromOptions()
    try:
        solver.solve()
    except PETSc.Error as error:
        raise SolverError(f"the flat state is not stable; {NOT_FOUND}: {error}") from error
    if solver.getConverged() < 1:
        raise SolverError(f"the flat state is not stable; {NOT_FOUND}")
    return float(solver.getEigenvalue(0).real)
