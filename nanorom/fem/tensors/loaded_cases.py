"""Static load cases of a film about a loaded or curved state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from nanorom.fem.models.plate import Plate
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, compat, groups
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors import inplane, lateral
from nanorom.fem.tensors.cases import Cases
from nanorom.fem.tensors.equilibrium import Equilibrium
from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.inplane import InPlane


def static_cases(modes: Modes, in_plane: str = "free") -> Cases:
    """The way to solve load cases that a film allows: a flat one takes all of them at once."""
    plate = modes.plate
    if plate.state.odd:
        return FlatCases(modes, in_plane)
    return StaticCases(modes, in_plane)


class StaticCases:
    """Nonlinear static equilibrium of any film under prescribed deflections, one by one.

    The plate has no mirrors: a load case may mix modes of any parity.
    """

    odd = False
    polynomial = True  # but for what a gate adds, which is small where the expansion holds
    most_columns = 8

    def __init__(self, modes: Modes, in_plane: str = "free") -> None:
        plate = modes.plate
        self.modes = modes
        self.plate = plate
        self._stiffness = modes.stiffness[()]
        self._linear = self._stiffness.createVecLeft()
        self._deflection = self._stiffness.createVecRight()

        def energy(u: Any, w: Any) -> Any:
            stretching = plate.stretching_energy(u, w)
            if plate.state.attraction is None:
                return stretching
            return stretching + plate.attraction_energy(w)

        self._case = _Reaction(plate, energy, in_plane)
        self._tangent: np.ndarray | None = None
        if plate.state.shape is not None:
            # stretching has a linear part, which belongs to K X_c
            tangent = _Reaction(plate, plate.tangent_energy, in_plane)
            self._tangent = np.column_stack([tangent.solve(w) for w in modes.shapes.T])

    @property
    def parities(self) -> list[Parity]:
        """Classes of symmetry of the modes."""
        return self.modes.parities

    @property
    def key(self) -> str:
        """Tells modes and mesh from those of other cases."""
        return self.modes.key

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
            displacements.append(self._case.u.x.array.copy())
        columns = np.column_stack(displacements)
        own = self._case.equilibrium if lateral.is_slender(self.plate) else None
        found = inplane.known(self.plate, columns, (), own)
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
    """Reaction to a prescribed deflection, the in-plane displacement in equilibrium or fixed.

    energy : of displacement and deflection; u : the displacement of the last case (Function).
    """

    def __init__(self, plate: Plate, energy: Callable[[Any, Any], Any], in_plane: str) -> None:
        self.u, self._w = fem.Function(plate.in_plane), fem.Function(plate.deflections)
        written = energy(self.u, self._w)
        self._reaction = compat.form(ufl.derivative(written, self._w))
        self.equilibrium: Equilibrium | None = None
        if in_plane == "free":
            stiffness = algebra.assemble(plate.compiled(plate.in_plane_form))
            self.equilibrium = Equilibrium(plate, stiffness)
            self._residual = compat.form(ufl.derivative(written, self.u))

    def solve(self, w: np.ndarray) -> np.ndarray:
        """Consistent nodal forces (owned dofs,) at a deflection (local dofs,). Collective."""
        self._w.x.array[:] = w
        self.u.x.array[:] = 0.0
        if self.equilibrium is not None:
            self.u.x.array[:] = self.equilibrium.solve(self._in_plane_force)[:, 0]
        return algebra.assemble_vector(self._reaction)

    def _in_plane_force(self, u: np.ndarray | None) -> np.ndarray:
        """Force (owned free dofs, 1) at a displacement, the same; at none for None. Collective."""
        assert self.equilibrium is not None
        free = self.equilibrium.free
        self.u.x.array[:] = 0.0 if u is None else free.extended(u)[:, 0]
        return free.taken(algebra.assemble_vector(self._residual))[:, None]
