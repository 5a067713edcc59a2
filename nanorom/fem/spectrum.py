"""Resonance frequencies as functions of tension and bending stiffness, with exact gradients.

The transverse stiffness is affine in what is to be found, K = T_x K_x + T_y K_y + D K_D, so that
the operators are assembled once.  A mode phi of K phi = omega^2 M phi gives its own gradient
(Hellmann-Feynman): d omega^2 / d p = phi.K_p phi / phi.M phi, without another solve.
"""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.errors import SceneError
from nanorom.fem import algebra, compat, discretisation, labels
from nanorom.fem import modes as eigen
from nanorom.fem.build import build_plate
from nanorom.fem.modes import ClassSolver, Modes
from nanorom.fem.ritz import LinearForce
from nanorom.fem.scales import Scales
from nanorom.fem.symmetry import Parity
from nanorom.identify import Lines
from nanorom.scene import Scene, Tension


class Spectrum:
    """The lowest resonances of a scene, for any tension, bending stiffness and areal mass.

    The mesh is made for the scene's own values and to its tolerance.  Collective.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        if scene.load is not None:
            raise SceneError("load: a scene to identify is about the unloaded film; remove [load]")
        if scene.support.springs:
            raise SceneError("support: a scene to identify has rigid supports; found springs")
        self.scene = scene
        self.scales = scales = Scales.of(scene)
        tension = max(scene.tension.x, scene.tension.y, 1e-300)
        layer = float(np.sqrt(scales.bending * scales.tension / tension))
        chosen = discretisation.choose(scene, scales.length, layer, scene.accuracy.tolerance)
        self.plate = plate = build_plate(comm, scene, scales, chosen)
        self.mass = algebra.assemble(compat.form(plate.mass_form()))
        self.constants = (plate.tension_x, plate.tension_y, plate.bending_stiffness)
        # per N/m, N/m and N m, in the plate's unit of stiffness
        units = (scales.tension, scales.tension, scales.tension * scales.length**2)
        self.parts: list[dict[Parity, PETSc.Mat]] = []
        for part in self.constants:
            for constant in self.constants:
                constant.value = 0.0
            part.value = 1.0
            self.parts.append(eigen.class_stiffness(plate))
        self.force = LinearForce.of(plate)
        self.units = np.array(units)

    def __call__(
        self, tension_x: float, tension_y: float, bending: float, areal_mass: float, count: int
    ) -> Lines:
        """The ``count`` lowest resonances: T_x, T_y in N/m, D in N m, rho h in kg/m^2."""
        weights = np.array([tension_x, tension_y, bending]) / self.units
        for constant, weight in zip(self.constants, weights):
            constant.value = weight
        stiffness = {p: self._combined(weights, p) for p in self.plate.mirrors.classes}
        solvers = {
            p: ClassSolver(self.plate, p, k, self.mass, self.force) for p, k in stiffness.items()
        }
        modes = eigen.lowest_of_classes(
            self.plate, solvers, stiffness, self.mass, self.force, count
        )
        scene = attrs.evolve(self.scene, tension=Tension(tension_x, tension_y))
        modes, names = labels.name(scene, modes)
        return self._lines(modes, names, areal_mass)

    def _combined(self, weights: np.ndarray, parity: Parity) -> PETSc.Mat:
        matrix = self.parts[0][parity].copy()
        matrix.scale(weights[0])
        for weight, part in zip(weights[1:], self.parts[1:]):
            matrix.axpy(weight, part[parity], PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        return matrix

    def _lines(self, modes: Modes, names: list[str], areal_mass: float) -> Lines:
        mass = np.diag(modes.modal(dict.fromkeys(modes.parities, self.mass)))
        # omega^2 in (rad/s)^2 per unit of each parameter
        scale = 1 / (areal_mass * self.scales.length**2)
        slopes = [
            scale * self.scales.tension / unit * np.diag(modes.modal(part)) / mass
            for part, unit in zip(self.parts, self.units)
        ]
        squares = modes.eigenvalues * self.scales.tension * scale
        slopes.append(-squares / areal_mass)
        frequency = np.sqrt(squares) / (2 * np.pi)
        gradient = np.column_stack(slopes) / (8 * np.pi**2 * frequency[:, None])
        return Lines(frequency, tuple(names), gradient)
