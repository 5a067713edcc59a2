"""Modes and tensors of a film about a static state, or of one that is not flat.

There the deflection and the in-plane displacement are coupled already in the linear problem, and
the potential has cubic terms.  The in-plane displacement has no mass: it is condensed, in the
modes by a mass matrix without it, in the tensors as `condensation` does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import ufl
from petsc4py import PETSc

from nanorom.fem.models import operators
from nanorom.fem.models.coupled import Film
from nanorom.fem.models.operators import LinearForce
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes import eigen
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity


def solve(plate: Plate, count: int) -> Modes:
    """At least the ``count`` lowest modes of a film about an equilibrium. Collective.

    ``plate.state`` is the equilibrium.  The stiffness of the modes is that of tension, bending and
    attraction alone; stretching adds the linear part of `tensors`.  Raises SolverError when the
    state is not stable.
    """
    if plate.state.shape is None:
        return eigen.solve(plate, count)
    film = Film(plate)
    energy = plate.tangent_energy(film.u, film.w)
    stiffness = operators.ClassStiffness(plate)
    force = LinearForce.of_energy(plate, film.state, film.w, energy + plate.linear_energy(film.w))
    mass = operators.mass(plate)
    film_mass = film.embed(mass)
    totals = stiffnesses(film, list(stiffness))
    solvers = {p: CoupledSolver(film, p, totals, film_mass, force) for p in totals}
    own_force = LinearForce.of(plate)
    return eigen.lowest_of_classes(plate, solvers, stiffness, mass, own_force, count)


def stiffnesses(film: Film, classes: Sequence[Parity]) -> dict[Parity, PETSc.Mat]:
    """Stiffness of deflection and in-plane displacement together, by class. Collective."""
    energy = film.plate.tangent_energy(film.u, film.w)
    second = ufl.derivative(ufl.derivative(energy, film.state), film.state)
    stretching = algebra.assemble(compat.form(second))
    linear = operators.ClassStiffness(film.plate)
    totals = {}
    for parity in classes:
        totals[parity] = film.embed(linear[parity])
        totals[parity].axpy(1.0, stretching, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    return totals


class CoupledSolver(eigen.ClassSolver):
    """Lowest modes of one class of symmetry, the in-plane displacement without mass."""

    def __init__(
        self,
        film: Film,
        parity: Parity,
        stiffness: Mapping[Parity, PETSc.Mat],
        mass: PETSc.Mat,
        force: LinearForce,
    ) -> None:
        self.parity = parity
        self.film = film
        self.plate = film.plate
        self.free = film.free_dofs(parity)
        self._stiffness, self._mass = stiffness, mass
        self._linear_force = force
        self._shift = None
        self.eigenvalues = np.empty(0)
        self.vectors = np.empty((0, 0))

    def _rigid_motions(self, mass: PETSc.Mat) -> np.ndarray:
        """None: a film that is not flat is held."""
        return np.empty(0)

    def deflection(self, i: int) -> np.ndarray:
        """Deflection (local dofs,) of a mode, numbered as the plate does. Collective."""
        return self.film.deflections(self.free.extended(self.vectors[:, [i]]))[:, 0]
