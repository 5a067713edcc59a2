"""A string or beam in one dimension, in all modes of the basis of polynomials that its model has.

The axial force is uniform, N = EA/(2 L) int w'^2 dx: it is condensed exactly, and no tensor is
needed (`fem.models.beam`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np
import scipy.sparse as sp

from nanorom.fem.models.beam import BeamModes, modes
from nanorom.fem.output import losses
from nanorom.fem.output.strip import StripWork
from nanorom.fem.routes.beam import beam_of, motion_of, viscous_of
from nanorom.fem.symmetry import Parity
from nanorom.scene.patterns.pattern import Areal
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assembled import Film, FilmWork, Forces, Operators, Units
from nanorom.verification.factors import Factors
from nanorom.verification.linear import ClassDynamics, completed
from nanorom.verification.symmetry import Classes

ONLY: Parity = ()  # class of symmetry: a beam is no dearer whole
POINTS = 20  # per function, at which the deflection is looked at


@attrs.frozen(eq=False)
class Stretched:
    """Slopes S a (n, m) of a deflection a at time samples, and the axial force (m,) there."""

    slope: Array
    force: Array


@attrs.frozen(eq=False)
class AxialForce:
    """N S a with N = 1/2 a . S a, beam-scaled: `assembled.Discrete` of a beam.

    slope (n, n): S, int phi_j' phi_k' dx; shapes (p, n) at points along the beam.
    """

    slope: Array
    shapes: Array
    even: Parity = ONLY
    odd: bool = True
    follows: bool = False  # the displacement along the beam does, and is condensed

    def settled(self, classes: Classes, parts: Sequence[Array]) -> list[Array]:
        """Deflections as they are."""
        return list(parts)

    @property
    def free(self) -> Mapping[Parity, np.ndarray]:
        """All functions meet the ends' conditions."""
        return {ONLY: np.arange(len(self.slope))}

    def force(
        self, classes: Classes, parts: Sequence[Array], viscous: Array | None = None
    ) -> tuple[list[Array], Stretched]:
        """Force (n, m) of deflections (n, m), and what it is made of."""
        (a,) = parts
        slope = self.slope @ a
        axial = _seen(0.5 * (a * slope).sum(axis=0), viscous)
        return [axial * slope], Stretched(slope, axial)

    def tangent(
        self,
        classes: Classes,
        state: Stretched,
        parts: Sequence[Array],
        viscous: Array | None = None,
    ) -> list[Array]:
        """Derivative (n, m) of the force along deflections (n, m)."""
        (a,) = parts
        axial = _seen((state.slope * a).sum(axis=0), viscous)
        return [state.force * (self.slope @ a) + axial * state.slope]

    def stiffening(self, parity: Parity, state: Stretched, modes: Array) -> Array:
        """What the mean axial force adds to the stiffness of modes (k, k)."""
        return np.asarray(state.force.mean() * (modes.T @ self.slope @ modes))

    def varying(self, parity: Parity, state: Stretched, modes: Array) -> Array:
        """What the rest of it adds to the stiffness of each mode (k, m)."""
        own = np.einsum("nk,nk->k", modes, self.slope @ modes)
        return np.outer(own, state.force - state.force.mean())

    def heights(self, classes: Classes, parts: Sequence[Array]) -> Array:
        """Deflections (p, m) along the beam."""
        return np.asarray(self.shapes @ parts[0])


def _seen(force: Array, viscous: Array | None) -> Array:
    return force if viscous is None else viscous @ force


@attrs.frozen(eq=False)
class BeamFilm(Film):
    """A beam; degrees of freedom are coordinates of unit mass of all modes of its basis.

    stiffness (n, n) of tension and bending, bending (n, n) its part of that; static : its factors;
    modal_work : of simple forces on all modes scaled to max |phi| = 1; per_unit (n,): amplitude of
    these per coordinate.
    """

    stiffness: sp.csr_matrix
    bending: sp.csr_matrix
    modal_work: StripWork
    per_unit: Array

    def shapes(self, parity: Parity) -> Array:
        """Named modes (n, k): the first."""
        return np.eye(len(self.per_unit), len(self.names))

    def mass(self, parity: Parity) -> sp.csr_matrix:
        """Matrix (n, n): one."""
        return sp.identity(len(self.per_unit), format="csr")

    def dynamics(self, parity: Parity, highest: float) -> ClassDynamics:
        """Linear dynamics, its modes known up to a frequency (beam-scaled)."""
        assert self.scene.damping is not None
        time = self.scene.damping.material_time / self.units.time
        named = ClassDynamics(
            stiffness=self.stiffness,
            mass=self.mass(parity),
            static=Factors(self.stiffness, "beam's stiffness"),
            extra=0,
            modes=self.shapes(parity),
            values=self.values,
            rates=self.rates,
            loss=0.0,
            viscous=time * self.bending if time else None,
        )
        return completed(named, float(self.quality[-1]), highest, self.stiffness)

    @property
    def work(self) -> BeamWork:
        """Of simple forces on all coordinates."""
        return BeamWork(self)


@attrs.frozen(eq=False)
class BeamWork(FilmWork):
    """Virtual work on all coordinates of a beam."""

    film: BeamFilm

    def _all(self, modal: Array) -> Forces:
        return {ONLY: modal * self.film.per_unit}

    def uniform(self, pressure: float = 1.0) -> Forces:
        return self._all(self.film.modal_work.uniform(pressure))

    def areal(self, pattern: Areal) -> Forces:
        return self._all(self.film.modal_work.areal(pattern))

    def points(self, places: Array, weights: Array, key: str) -> Forces:
        return self._all(self.film.modal_work.points(places, weights, key))

    def inertia(self, acceleration: float = 1.0) -> Forces:
        return self._all(self.film.modal_work.inertia(acceleration))

    def stretch(self, tension: float = 1.0) -> Operators:
        unit = np.outer(self.film.per_unit, self.film.per_unit)
        return lambda parity: -unit * self.film.modal_work.stretch(tension)


def assemble(scene: Scene, more: int, tolerance: float | None = None) -> BeamFilm:
    """The beam of a scene with ``more`` named modes than the model has; no mesh to be made.

    Raises SolverError as `nanorom.reduce`.
    """
    beam, width = beam_of(scene)
    named = modes(beam, scene.modes.highest + more)
    whole, count = named.completed(), len(named.frequency)
    every = np.arange(count)
    stiff = float(named.stiffness[0, 0])
    mass = beam.mass_per_length * beam.length
    units = Units(
        time=float(np.sqrt(mass / stiff)),
        deflection=float(np.sqrt(beam.length**3 * stiff / beam.axial_stiffness)),
        stiffness=stiff,
    )
    unit_mass = 1 / np.sqrt(whole.mass / mass)
    both = np.outer(unit_mass, unit_mass)
    rows = np.linspace(0.0, beam.length, POINTS * whole.functions + 1)
    return BeamFilm(
        scene=scene,
        units=units,
        discrete=AxialForce(
            slope=beam.length * both * whole.slope,
            shapes=(unit_mass[:, None] * whole.shapes(rows)).T,
        ),
        names=[f"({n + 1},0)" for n in every],
        parities=[ONLY] * count,
        values=(2 * np.pi * named.frequency * units.time) ** 2,
        modal=_modal(named, scene),
        losses=losses.losses(scene, motion_of(named, every, width)),
        inside=np.array(scene.modes.numbers) - 1,
        classes=[ONLY],
        copies=1,
        stiffness=sp.csr_matrix(both * whole.stiffness / stiff),
        bending=sp.csr_matrix(both * whole.bending / stiff),
        modal_work=StripWork(whole, np.arange(whole.functions), width),
        per_unit=unit_mass,
    )


def _modal(named: BeamModes, scene: Scene) -> dict[str, Array]:
    """Matrices and tensors of the named modes in SI units."""
    count = len(named.frequency)
    found = {
        "mass": named.mass,
        "stiffness": named.stiffness,
        "quadratic": np.zeros((count,) * 3),
        "cubic": named.cubic,
    }
    return found | viscous_of(scene, named, np.arange(count))
