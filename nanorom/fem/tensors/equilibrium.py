"""Equilibrium of the in-plane displacement: the one place that solves for it.

Whatever the deflection, the energy of a von Karman film is quadratic in the in-plane displacement,
with the same stiffness: it is made once for every class of symmetry and serves linear solutions as
well as every step of SNES for load cases, many at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.fields import membrane
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity

SNES_TOLERANCE = 1e-10  # residual relative to the load of the deflection
MOST_STEPS = 10  # of Newton's method, which takes one: the problem is linear
TINY = 1e-300

# (owned free dofs, m) of displacements, None for none -> residual, the same
Residual = Callable[[np.ndarray | None], np.ndarray]


class Equilibrium:
    """In-plane displacements of one class of symmetry in equilibrium with their loads.

    Attributes
    ----------
    free : degrees of freedom off the supports; loads are taken and residuals told on them.
    residual : of the last solution by `solve`, relative to its loads.
    """

    def __init__(self, plate: Plate, stiffness: PETSc.Mat, parity: Parity = ()) -> None:
        self.free = membrane.free_dofs(plate, parity)
        self.residual = 0.0
        self._matrix = self.free.restrict(stiffness)
        self._solver = plate.solvers.make(
            self.free, self._matrix, "nanorom_in_plane_", "in-plane stiffness"
        )

    def respond(self, loads: np.ndarray, error: float = algebra.SOLVED) -> None:
        """Turn loads (local dofs, m) into the displacements that undo them. Collective.

        In place: each load gives way to what it does.
        """
        for first in range(0, loads.shape[1], self._solver.columns):
            some = slice(first, first + self._solver.columns)
            loads[:, some] = self.free.extended(
                -self._solver.solve(self.free.taken(loads[:, some]), error)
            )

    def correction(self, loads: np.ndarray) -> np.ndarray:
        """Small displacements (local dofs, m) that undo what loads are left. Collective."""
        return self.free.extended(-self._solver.solve(self.free.taken(loads)))

    def product(self, displacements: np.ndarray) -> np.ndarray:
        """Forces (owned free dofs, m) of displacements, the same. Collective."""
        return algebra.multiply(self._matrix, displacements)

    def solve(self, residual: Residual) -> np.ndarray:
        """Displacements (local dofs, m) whose residual vanishes, by SNES. Collective.

        Raises SolverError if SNES does not converge.
        """
        start = residual(None)
        self._shape = start.shape
        x = PETSc.Vec().createMPI((start.size, None), comm=self.free.comm)
        f = x.duplicate()
        f.array[:] = start.ravel()
        size = f.norm()
        snes = PETSc.SNES().create(self.free.comm)
        snes.setOptionsPrefix("nanorom_step_")
        sizes = ((start.size, None), (start.size, None))
        jacobian = PETSc.Mat().createPython(sizes, comm=self.free.comm)
        jacobian.setPythonContext(self)
        jacobian.setUp()

        def function(_: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
            moved = x.norm() > 0
            found = residual(x.array_r.reshape(self._shape)) if moved else start
            f.array[:] = found.ravel()

        snes.setFunction(function, f)
        snes.setJacobian(lambda *_: None, jacobian)
        solver = snes.getKSP()
        solver.setType("preonly")
        solver.getPC().setType("python")
        solver.getPC().setPythonContext(self)
        snes.setTolerances(rtol=SNES_TOLERANCE, atol=0.0, stol=0.0, max_it=MOST_STEPS)
        options = PETSc.Options("nanorom_step_")
        if not options.hasName("snes_linesearch_type"):
            options["snes_linesearch_type"] = "basic"  # of a linear problem the whole step is right
        snes.setFromOptions()
        snes.solve(None, x)
        if snes.getConvergedReason() <= 0 and snes.getFunctionNorm() > 0:
            raise SolverError(
                f"static load cases did not converge: SNES reason {snes.getConvergedReason()} "
                f"at residual {snes.getFunctionNorm():.1e}; lower the amplitude, or check the mesh "
                "for degenerate cells"
            )
        self.residual = snes.getFunctionNorm() / max(size, TINY)
        return self.free.extended(x.array_r.reshape(self._shape))

    def release(self) -> None:
        """Free the memory of the matrix and of its factors. Collective."""
        self._solver.reset()
        self._matrix.destroy()

    # what PETSc asks of a matrix and of a preconditioner written in Python

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = A x for every load case."""
        y.array[:] = self.product(x.array_r.reshape(self._shape)).ravel()

    def apply(self, _: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = A^-1 x for every load case."""
        y.array[:] = self._solver.solve(x.array_r.reshape(self._shape)).ravel()


def of_classes(plate: Plate, parities: Sequence[Parity]) -> Iterator[Equilibrium]:
    """That of each class in turn: released when the next one is asked for, unless films to come
    on the same mesh, of the same stiffness in their plane, need its factors again.  Collective.
    """
    kept = plate.domain.made if plate.patchwork is None else None
    stretched = plate.stiffness
    numbers = (*np.ravel(stretched.law), stretched.stretching, *stretched.in_plane.items())
    kind = "equilibrium", plate.degree, plate.holding, *numbers
    stiffness = None
    for number, parity in enumerate(parities, 1):
        known = kept.get((*kind, parity)) if kept is not None else None
        if known is None:
            if stiffness is None:
                stiffness = algebra.assemble(plate.compiled(plate.in_plane_form))
            compat.free_memory(plate.domain.comm)
            known = Equilibrium(plate, stiffness, parity)
        if number == len(parities) and stiffness is not None:
            stiffness.destroy()
        yield known
        if kept is None:
            known.release()
        else:
            kept[(*kind, parity)] = known
