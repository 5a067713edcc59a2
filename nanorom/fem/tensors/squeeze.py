"""Gas that a film squeezes against a wall: what stiffness and damping it gives each mode.

Reynolds' equation for a small motion w = q phi exp(i omega t) over a gap g at a pressure P
(Langlois 1962, Quart. Appl. Math. 20, 131; Blech 1983, J. Lubr. Tech. 105, 615):

    -lap p + i sigma p = i sigma phi,    sigma = 12 mu omega/(P g^2),    p by P q/g,

with p = 0 where the gap is open to the gas around, no flow where it is sealed.  The force on the
mode is -(P/g) int p phi, of which the part in phase is a spring and the rest a damper.  Rarefied
gas has an effective viscosity (Veijola et al. 1995, doi:10.1016/0924-4247(95)00995-7).
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.models import operators
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import line
from nanorom.scene.material import Gas

MOST_STEPS = 50  # of the frequency and of what the gas does at it
SETTLED = 1e-12  # relative, of frequencies


@attrs.frozen(eq=False)
class Squeezed:
    """Modes with the gas: frequency (L,) in Hz, and its complex stiffness (L,) in N/m there."""

    frequency: np.ndarray
    stiffness: np.ndarray


def squeezed(
    modes: Modes, gas: Gas, length: float, mass: np.ndarray, stiffness: np.ndarray
) -> Squeezed:
    """What a gas makes of modes of masses (L,) in kg and stiffnesses (L,) in N/m. Collective.

    length : the plate's unit of it in m.  Each mode by itself: that the gas couples them is left
    out.  Raises SolverError where it changes their order.
    """
    found = one_by_one(modes, gas, length, mass, stiffness)
    if (np.diff(found.frequency) < -SETTLED * found.frequency[1:]).any():
        raise SolverError(
            "gas.gap: the squeezed gas is so stiff that it changes the order of the modes; ask for "
            "fewer of them, or widen the gap"
        )
    return attrs.evolve(found, frequency=np.maximum.accumulate(found.frequency))


def one_by_one(
    modes: Modes, gas: Gas, length: float, mass: np.ndarray, stiffness: np.ndarray
) -> Squeezed:
    """The same, whatever order the gas gives them. Collective."""
    assert gas.gap is not None
    film = Film.of(modes.plate, gas.vented)
    force, frequency = np.zeros(len(mass), dtype=complex), np.zeros(len(mass))
    for i, parity in enumerate(modes.parities):
        omega = np.sqrt(stiffness[i] / mass[i])
        for _ in range(MOST_STEPS):
            sigma = gas.squeeze_number(omega, length)
            force[i] = film.response(modes.shapes[:, i], parity, sigma)
            force[i] *= gas.pressure * length**2 / gas.gap
            last, omega = omega, np.sqrt((stiffness[i] + force[i].real) / mass[i])
            if abs(omega / last - 1) < SETTLED:
                break
        frequency[i] = omega / (2 * np.pi)
    return Squeezed(frequency, force)


@attrs.frozen(eq=False)
class Film:
    """The gas in the gap: the Laplacian and the mass of pressures."""

    plate: Plate
    stiffness: operators.ClassStiffness
    mass: PETSc.Mat

    @classmethod
    def of(cls, plate: Plate, vented: bool) -> Film:
        """Under a plate, whose edges are all open or all sealed. Collective."""
        mesh = plate.domain.mesh
        mirrors = plate.domain.facets_of([line(axis) for axis in plate.mirrors.axes])
        edge = np.setdiff1d(compat.exterior_facets(mesh), mirrors).astype(np.int32)
        gas = attrs.evolve(
            plate,
            bending=False,
            held=edge if vented else edge[:0],
            stiffness=Stiffness(),
            state=State(),
            masses=(),
            patchwork=None,
        )
        return cls(gas, operators.ClassStiffness(gas), operators.mass(gas))

    def response(self, shape: np.ndarray, parity: Any, sigma: float) -> complex:
        """int p phi of a deflection (local dofs,) of a parity, over the whole film. Collective."""
        free = operators.free_deflections(self.plate, parity)
        laplacian, mass = free.restrict(self.stiffness[parity]), free.restrict(self.mass)
        turned = mass.copy()
        turned.scale(sigma)
        back = mass.copy()
        back.scale(-sigma)
        whole = PETSc.Mat().createNest([[laplacian, back], [turned, laplacian]], comm=free.comm)
        whole = whole.convert("aij")
        n_owned = self.mass.getLocalSize()[0]
        load = free.taken(algebra.multiply(self.mass, shape[:n_owned, None])[:, 0])
        b, x = whole.createVecLeft(), whole.createVecRight()
        b.array[:] = np.concatenate([np.zeros_like(load), sigma * load])
        solver = PETSc.KSP().create(free.comm)
        solver.setOperators(whole)
        solver.setType("preonly")
        solver.getPC().setType("lu")
        solver.getPC().setFactorSolverType("mumps")
        solver.solve(b, x)
        real, imaginary = np.split(x.array_r, 2)
        found = free.comm.allreduce(np.array([load @ real, load @ imaginary]))
        for each in (whole, turned, back, solver):
            each.destroy()
        return complex(*(self.plate.mirrors.copies * found))
