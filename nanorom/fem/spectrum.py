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
from nanorom.fem.fields.places import bounding_box
from nanorom.fem.mesh import discretisation
from nanorom.fem.models import operators
from nanorom.fem.models.build import build_plate
from nanorom.fem.models.operators import LinearForce, Stiffness
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State
from nanorom.fem.modes import eigen
from nanorom.fem.modes import names as labels
from nanorom.fem.modes.eigen import ClassSolver, Modes
from nanorom.fem.routes.registry import check_of_plates
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity
from nanorom.rom.spectrum import Lines, RitzClass, RitzSpectrum
from nanorom.scene.film import Tension
from nanorom.scene.geometry import String
from nanorom.scene.scene import Scene
from nanorom.scene.support import Edge
from nanorom.scene.units import with_unit

RATIOS = (1e-3, 2e-2, 0.4)  # D/(T L^2) of the modes that span Ritz' basis
DEPENDENT = 1e-12  # of the largest square: shapes of the basis that add nothing to the others


class Spectrum:
    """The lowest resonances of a scene, for any tension, bending stiffness and areal mass.

    The mesh is made for the scene's own values and to its tolerance.  Collective.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        check_of_plates(scene, "a scene to identify")
        if scene.load is not None:
            raise SceneError("load: a scene to identify is about the unloaded film; remove [load]")
        if scene.support.springs or any(isinstance(k, Edge) for k in scene.support.kinds):
            raise SceneError(
                "support: a scene to identify has rigid supports; found springs or in_plane"
            )
        if scene.masses:
            raise SceneError("mass: a scene to identify is about the bare film; remove [[mass]]")
        if scene.regions:
            raise SceneError("region: a scene to identify is of one film; remove [[region]]")
        if scene.tension.variation is not None:
            raise SceneError("tension.variation: found; allowed in a scene to identify: none")
        if scene.tension.xy:
            shear = with_unit(scene.tension.xy, "N/m", 6)
            raise SceneError(f"tension.xy: found {shear}; allowed in a scene to identify: 0")
        self.scene = scene
        self.scales = scales = Scales.of(scene)
        tension = max(scene.tension.x, scene.tension.y, 1e-300)
        layer = float(np.sqrt(scales.bending * scales.tension / tension))
        chosen = discretisation.choose(scene, scales.length, layer, scene.accuracy.tolerance)
        self.plate = plate = build_plate(comm, scene, scales, chosen)
        self.mass = operators.mass(plate)
        # per N/m, N/m and N m, in the plate's unit of stiffness
        units = (scales.tension, scales.tension, scales.tension * scales.length**2)
        self.parts: list[dict[Parity, PETSc.Mat]] = [
            dict(operators.ClassStiffness(self._about(alone))) for alone in np.eye(3)
        ]
        self.units = np.array(units)

    def __call__(
        self, tension_x: float, tension_y: float, bending: float, areal_mass: float, count: int
    ) -> Lines:
        """The ``count`` lowest resonances: T_x, T_y in N/m, D in N m, rho h in kg/m^2."""
        modes, names = self._modes((tension_x, tension_y, bending), count)
        mass = np.diag(modes.modal(dict.fromkeys(modes.parities, self.mass)))
        slopes = [
            unit * np.diag(modes.modal(part)) / mass / areal_mass
            for part, unit in zip(self.parts, self._squares_per)
        ]
        squares = modes.eigenvalues * self.scales.tension / self.scales.length**2 / areal_mass
        del modes
        compat.free_memory(self.mass.comm.tompi4py())
        return Lines.of(squares, np.column_stack(slopes), names, areal_mass)

    @property
    def length(self) -> float:
        """Half of what the film spans, in m. Collective."""
        low, high = bounding_box(self.plate)
        sides = high - low
        span = sides.max() if isinstance(self.scene.geometry, String) else sides.min()
        return 0.5 * self.scales.length * float(span)

    def reduced(self, count: int) -> RitzSpectrum:
        """The spectrum in a basis of ``count`` modes at several bending stiffnesses. Collective."""
        ratios = RATIOS if self.scales.bending else (0.0,)
        found = [self._modes((1.0, 1.0, ratio * self.length**2), count) for ratio in ratios]
        shapes = np.concatenate([modes.shapes[: modes.n_owned] for modes, _ in found], axis=1)
        parities = [parity for modes, _ in found for parity in modes.parities]
        names = [name for _, own in found for name in own]
        classes = []
        for parity in sorted(set(parities)):
            own = [i for i, other in enumerate(parities) if other == parity]
            parts = [part[parity] for part in self.parts]
            classes.append(self._projected(parts, shapes[:, own], [names[i] for i in own]))
        return RitzSpectrum(tuple(classes))

    def _projected(self, parts: list[PETSc.Mat], shapes: np.ndarray, names: list[str]) -> RitzClass:
        """Stiffness in the span of shapes (owned dofs, s). Collective."""
        sums = self.plate.domain.comm.allreduce
        squares, vectors = np.linalg.eigh(sums(shapes.T @ algebra.multiply(self.mass, shapes)))
        kept = squares > DEPENDENT * squares[-1]
        vectors, norms = vectors[:, kept], np.sqrt(squares[kept])
        basis = shapes @ (vectors / norms)
        projected = [
            unit * sums(basis.T @ algebra.multiply(part, basis))
            for part, unit in zip(parts, self._squares_per)
        ]
        symmetric = [0.5 * (part + part.T) for part in projected]
        return RitzClass(np.array(symmetric), (vectors * norms).T, tuple(names))

    @property
    def _squares_per(self) -> np.ndarray:
        """omega^2 rho h in SI units per eigenvalue of each part of the stiffness and its unit."""
        return self.scales.tension / self.scales.length**2 / self.units

    def _modes(self, stiffness: tuple[float, float, float], count: int) -> tuple[Modes, list[str]]:
        """At least the ``count`` lowest modes at T_x, T_y in N/m and D in N m, and their names."""
        weights = np.array(stiffness) / self.units
        plate = self._about(weights)
        force = LinearForce.of(plate)
        classes = plate.mirrors.classes
        matrices = Stiffness({p: self._combined(weights, p) for p in classes})
        solvers = {p: ClassSolver(plate, p, matrices, self.mass, force) for p in matrices}
        modes = eigen.lowest_of_classes(plate, solvers, matrices, self.mass, force, count)
        scene = attrs.evolve(self.scene, tension=Tension(*stiffness[:2]))
        return labels.name(scene, modes)

    def _about(self, weights: np.ndarray) -> Plate:
        """The plate of T_x, T_y and D (3,) in its units."""
        tension_x, tension_y, bending = (float(weight) for weight in weights)
        plate = self.plate.about(State((tension_x, tension_y)))
        return plate.resisting(attrs.evolve(plate.stiffness, bending=bending))

    def _combined(self, weights: np.ndarray, parity: Parity) -> PETSc.Mat:
        matrix = self.parts[0][parity].copy()
        matrix.scale(weights[0])
        for weight, part in zip(weights[1:], self.parts[1:]):
            matrix.axpy(weight, part[parity], PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        return matrix
