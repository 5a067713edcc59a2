"""Modes and tensors of a film about a static state, or of one that is not flat.

There the deflection and the in-plane displacement are coupled already in the linear problem, and
the potential has cubic terms.  The in-plane displacement has no mass: it is condensed, in the
modes by a mass matrix without it, in the tensors as `condensation` does.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem

from nanorom.fem import algebra, compat, condensation, quadrature
from nanorom.fem import modes as eigen
from nanorom.fem.film import Film
from nanorom.fem.modes import Modes
from nanorom.fem.plate import Plate


def solve(plate: Plate, count: int) -> Modes:
    """At least the ``count`` lowest modes of a film about an equilibrium. Collective.

    ``plate.shape``, ``plate.prestress`` and ``plate.attraction`` describe the equilibrium.  The
    stiffness of the modes is that of tension, bending and attraction alone; stretching adds the
    linear part of `tensors`.  Raises SolverError when the state is not stable.
    """
    if plate.shape is None:
        return eigen.solve(plate, count)
    film = Film(plate)
    energy = film.incremental_energy()
    stiffness = algebra.assemble(compat.form(_second_derivative(energy, film.state)))
    w, v = ufl.TrialFunction(film.space), ufl.TestFunction(film.space)
    mass = algebra.assemble(compat.form(w[2] * v[2] * plate.dx(2 * plate.degree)))
    free = algebra.FreeDofs(film.space, film.fixed)
    k, m = free.restrict(stiffness), free.restrict(mass)
    wanted = count + eigen.EXTRA
    while True:
        eigenvalues, vectors = eigen.lowest(k, m, wanted)
        last = [c for c in eigen.clusters(eigenvalues, eigen.NEAR) if c[0] < count][-1][-1] + 1
        if last < wanted:
            break
        wanted *= 2
    shapes = np.empty((len(plate.w.x.array), last))
    for i in range(last):
        film.state.x.array[:] = 0.0
        film.state.x.array[free.local] = vectors[:, i]
        film.state.x.scatter_forward()
        shapes[:, i] = film.deflection()
    film.state.x.array[:] = 0.0
    parity = plate.mirrors.even
    return Modes(
        plate,
        eigenvalues[:last],
        shapes,
        [parity] * last,
        {parity: algebra.assemble(compat.form(plate.stiffness_form()))},
        algebra.assemble(compat.form(plate.mass_form())),
    )


def _second_derivative(energy: Any, state: Any) -> Any:
    return ufl.derivative(ufl.derivative(energy, state), state)


@attrs.frozen(eq=False)
class Tensors:
    """Modal force of a film: stretching (L, L), quadratic (L, L, L), cubic (L, L, L, L).

    ``stretching`` is the linear force that the modes' stiffness does not contain.
    """

    stretching: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray


def tensors(modes: Modes, in_plane: str = "free") -> Tensors:
    """Coefficients by direct condensation, those of the attraction included. Collective."""
    n = len(modes.parities)
    if modes.plate.shape is None:
        cubic = condensation.cubic_tensor(modes, in_plane)
        found = Tensors(np.zeros((n, n)), np.zeros((n, n, n)), cubic)
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
    third, fourth = np.zeros((n,) * 3), np.zeros((n,) * 4)
    j, k = np.triu_indices(n)
    pair = np.empty((n, n), dtype=int)
    pair[j, k] = pair[k, j] = np.arange(len(j))
    by_pair, by_two = np.zeros((len(j), n)), np.zeros((len(j), len(j)))
    shape = np.zeros((len(plate.w.x.array), 1))
    if plate.shape is not None:
        shape[:, 0] = plate.shape.x.array
    for field in quadrature.fields(plate, columns=2 * len(j)):
        height = plate.attraction.gap - field.value(shape)[..., 0]
        value = field.value(modes.shapes).reshape(-1, n)
        weight = (plate.attraction.strength * field.weights).ravel()
        products = value[:, j] * value[:, k]
        height = height.ravel()[:, None]
        by_pair += (products * weight[:, None] * 3 / height**4).T @ value
        by_two += (products * weight[:, None] * 12 / height**5).T @ products
    comm, copies = plate.domain.comm, plate.mirrors.copies
    third = copies * comm.allreduce(by_pair)[pair]
    fourth = copies * comm.allreduce(by_two)[pair[:, :, None, None], pair[None, None]]
    return third, fourth
