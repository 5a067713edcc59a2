"""Modes and tensors of a film about a static state, or of one that is not flat.

There the deflection and the in-plane displacement are coupled already in the linear problem, and
the potential has cubic terms.  The in-plane displacement has no mass: it is condensed, in the
modes by a mass matrix without it, in the tensors as `condensation` does.
"""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np
import ufl
from petsc4py import PETSc

from nanorom.fem import algebra, compat, condensation, quadrature
from nanorom.fem import modes as eigen
from nanorom.fem.film import Film
from nanorom.fem.inplane import InPlane
from nanorom.fem.modes import Modes
from nanorom.fem.plate import Plate
from nanorom.fem.ritz import LinearForce
from nanorom.fem.symmetry import Parity


def solve(plate: Plate, count: int) -> Modes:
    """At least the ``count`` lowest modes of a film about an equilibrium. Collective.

    ``plate.shape``, ``plate.prestress`` and ``plate.attraction`` describe the equilibrium.  The
    stiffness of the modes is that of tension, bending and attraction alone; stretching adds the
    linear part of `tensors`.  Raises SolverError when the state is not stable.
    """
    if plate.shape is None:
        return eigen.solve(plate, count)
    film = Film(plate)
    energy = plate.tangent_energy(film.u, film.w)
    second = ufl.derivative(ufl.derivative(energy, film.state), film.state)
    stretching = algebra.assemble(compat.form(second))
    stiffness = eigen.ClassStiffness(plate)
    force = LinearForce.of_energy(plate, film.state, film.w, energy + plate.linear_energy(film.w))
    mass = algebra.assemble(plate.compiled(plate.mass_form))
    film_mass = film.embed(mass)
    totals = {}
    for parity, linear in stiffness.items():
        totals[parity] = film.embed(linear)
        totals[parity].axpy(1.0, stretching, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    solvers = {p: CoupledSolver(film, p, totals, film_mass, force) for p in totals}
    own_force = LinearForce.of(plate)
    return eigen.lowest_of_classes(plate, solvers, stiffness, mass, own_force, count)


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
        self.free = algebra.FreeDofs(film.space, film.fixed(parity))
        self._stiffness, self._mass = stiffness, mass
        self._linear_force = force
        self.eigenvalues = np.empty(0)
        self.vectors = np.empty((0, 0))

    def deflection(self, i: int) -> np.ndarray:
        """Deflection (local dofs,) of a mode, numbered as the plate does. Collective."""
        state = self.film.state.x
        state.array[:] = 0.0
        state.array[self.free.local] = self.vectors[:, i]
        state.scatter_forward()
        return self.film.deflection()


@attrs.frozen(eq=False)
class Tensors:
    """Modal force of a film: stretching (L, L), quadratic (L, L, L), cubic (L, L, L, L).

    ``stretching`` is the linear force that the modes' stiffness does not contain;
    ``in_plane`` is what is known of the in-plane displacements.
    """

    stretching: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray
    in_plane: InPlane


def tensors(modes: Modes, in_plane: str = "free") -> Tensors:
    """Coefficients by direct condensation, those of the attraction included. Collective."""
    n = len(modes.parities)
    if modes.plate.shape is None:
        cubic, known = condensation.cubic_tensor(modes, in_plane)
        found = Tensors(np.zeros((n, n)), np.zeros((n, n, n)), cubic, known)
    else:
        found = Tensors(*condensation.stretching_tensors(modes, in_plane))
    attraction = modes.plate.attraction
    if attraction is None:
        return found
    third, fourth = _attraction_tensors(modes)
    return attrs.evolve(
        found, quadratic=found.quadratic - third / 2, cubic=found.cubic - fourth / 6
    )


def _attraction_tensors(modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """int W''' phi^3 and int W'''' phi^4 of all modes, W the potential of the attraction."""
    plate, n = modes.plate, len(modes.parities)
    gate = plate.attraction
    assert gate is not None
    j, k = np.triu_indices(n)
    pair = np.empty((n, n), dtype=int)
    pair[j, k] = pair[k, j] = np.arange(len(j))
    by_pair, by_two = np.zeros((len(j), n)), np.zeros((len(j), len(j)))
    shape = np.zeros((len(plate.w.x.array), 1))
    if plate.shape is not None:
        shape[:, 0] = plate.shape.x.array
    for field in quadrature.fields(plate, columns=2 * len(j)):
        height = gate.gap - field.value(shape)[..., 0]
        value = field.value(modes.shapes).reshape(-1, n)
        weight = (gate.strength * field.weights).ravel()
        products = value[:, j] * value[:, k]
        height = height.ravel()[:, None]
        by_pair += (products * weight[:, None] * 3 / height**4).T @ value
        by_two += (products * weight[:, None] * 12 / height**5).T @ products
    comm, copies = plate.domain.comm, plate.mirrors.copies
    third = copies * comm.allreduce(by_pair)[pair]
    fourth = copies * comm.allreduce(by_two)[pair[:, :, None, None], pair[None, None]]
    for tensor in (third, fourth):
        # what is odd about a mirror vanishes on the whole film
        for odd in np.array(modes.parities, dtype=int).reshape(n, -1).T:
            total = sum(odd.reshape([-1] + [1] * axis) for axis in range(tensor.ndim))
            tensor[total % 2 == 1] = 0.0
    return third, fourth
