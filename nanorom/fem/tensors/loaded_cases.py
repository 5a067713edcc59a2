"""Static load cases of a film about a loaded or curved state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.fields import membrane
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, compat, groups
from nanorom.fem.tensors import inplane
from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.inplane import InPlane

SNES_TOLERANCE = 1e-10  # in-plane residual relative to the load of the deflection


def static_cases(modes: Modes, in_plane: str) -> FlatCases | StaticCases:
    """The way to solve load cases that a film allows: a flat one takes all of them at once."""
    plate = modes.plate
    if plate.shape is None and plate.attraction is None:
        return FlatCases(modes, in_plane)
    return StaticCases(modes, in_plane)


class StaticCases:
    """Nonlinear static equilibrium of any film under prescribed deflections, one by one.

    The plate has no mirrors: a load case may mix modes of any parity.
    """

    def __init__(self, modes: Modes, in_plane: str = "free") -> None:
        plate = modes.plate
        self.modes = modes
        self.plate = plate
        self._stiffness = modes.stiffness[()]
        self._linear = self._stiffness.createVecLeft()
        self._deflection = self._stiffness.createVecRight()
        energy = plate.stretching_energy(plate.u, plate.w)
        if plate.attraction is not None:
            energy = energy + plate.attraction_energy(plate.w)
        self._case = _Reaction(plate, energy, in_plane)
        self._tangent: np.ndarray | None = None
        if plate.shape is not None:
            # stretching has a linear part, which belongs to K X_c
            tangent = _Reaction(plate, plate.tangent_energy(plate.u, plate.w), in_plane)
            self._tangent = np.column_stack([tangent.solve(w) for w in modes.shapes.T])

    odd = False
    most_columns = 8  # load cases between which a journal is kept

    def nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        """eta (L, m) = Phi^T (F_T - K X_c) at modal amplitudes q (L, m). Collective."""

        def work(own: Sequence[int]) -> dict[int, np.ndarray]:
            return {i: self._force(q[:, i]) for i in own}

        found = groups.shared(self.plate.domain.across, range(q.shape[1]), work)
        return np.column_stack(list(found.values()))

    def in_plane(self, amplitude: float) -> InPlane:
        """What is known of the displacements, errors relative to the largest energy of a mode.

        Collective.
        """
        displacements, energies = [], []
        for j, q in enumerate(amplitude * np.eye(len(self.modes.parities))):
            energies.append(0.5 * amplitude * abs(self._force(q)[j]))
            displacements.append(self.plate.u.x.array.copy())
        found = inplane.known(self.plate, np.column_stack(displacements))
        return InPlane.of_parts([found], max(energies))

    def _force(self, q: np.ndarray) -> np.ndarray:
        """eta (L,) at modal amplitudes q (L,). Collective."""
        shapes = self.modes.shapes[:, : len(q)]
        n_owned = self.modes.n_owned
        w = shapes @ q
        self._deflection.array[:] = w[:n_owned]
        self._stiffness.mult(self._deflection, self._linear)
        linear = self._linear.array_r.copy()
        total = self._case.solve(w) + linear
        if self._tangent is not None:
            linear += self._tangent[:, : len(q)] @ q
        return self.plate.domain.comm.allreduce(shapes[:n_owned].T @ (total - linear))


class _Reaction:
    """Reaction to a prescribed deflection, the in-plane displacement in equilibrium or fixed."""

    def __init__(self, plate: Plate, energy: Any, in_plane: str) -> None:
        self.plate = plate
        self._reaction = compat.form(ufl.derivative(energy, plate.w))
        self._snes = _InPlaneEquilibrium(plate, energy) if in_plane == "free" else None

    def solve(self, w: np.ndarray) -> np.ndarray:
        """Consistent nodal forces (owned dofs,) at a deflection (local dofs,). Collective."""
        self.plate.w.x.array[:] = w
        self.plate.u.x.array[:] = 0.0
        if self._snes is not None:
            self._snes.solve()
        return algebra.assemble_vector(self._reaction)


class _InPlaneEquilibrium:
    """SNES for the in-plane displacement; the tangent does not depend on the state, so that one
    factorisation serves every iteration of every case."""

    def __init__(self, plate: Plate, energy: Any) -> None:
        self.plate = plate
        self.free = membrane.free_dofs(plate)
        self._residual = compat.form(ufl.derivative(energy, plate.u))
        stiffness = self.free.restrict(algebra.assemble(plate.compiled(plate.in_plane_form)))
        self._x = stiffness.createVecRight()
        self._f = stiffness.createVecLeft()
        self._load = 0.0
        snes = PETSc.SNES().create(plate.domain.comm)
        snes.setOptionsPrefix("nanorom_step_")
        snes.setFunction(self._assemble_residual, self._f)
        snes.setJacobian(lambda *_: None, stiffness)
        algebra.use_cholesky(snes.getKSP())
        options = PETSc.Options("nanorom_step_")
        options["snes_lag_jacobian"] = options["snes_lag_preconditioner"] = -2  # once, for ever
        options["snes_lag_jacobian_persists"] = options["snes_lag_preconditioner_persists"] = 1
        snes.setTolerances(rtol=SNES_TOLERANCE, atol=0.0, stol=0.0, max_it=10)
        snes.setFromOptions()
        self.snes = snes

    def solve(self) -> None:
        """Equilibrium for the deflection that the plate holds; raises SolverError."""
        self._x.set(0.0)
        self.snes.solve(None, self._x)
        if self.snes.getConvergedReason() <= 0:
            raise SolverError(
                f"a static load case did not converge: SNES reason "
                f"{self.snes.getConvergedReason()} after {self.snes.getIterationNumber()} "
                f"iterations at residual {self.snes.getFunctionNorm():.1e}; lower the amplitude"
            )
        self._set_state(self._x)

    def _set_state(self, x: PETSc.Vec) -> None:
        self.plate.u.x.array[:] = 0.0
        self.plate.u.x.array[self.free.local] = x.array_r
        self.plate.u.x.scatter_forward()

    def _assemble_residual(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        self._set_state(x)
        f.array[:] = algebra.assemble_vector(self._residual)[self.free.local]
