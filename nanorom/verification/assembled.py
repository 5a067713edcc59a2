"""What the orbits of a film need of it, whatever it is made of: a plate on a mesh, a beam."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import attrs
import numpy as np
import scipy.sparse.linalg as spl

from nanorom.fem.symmetry import Parity
from nanorom.scene.patterns.pattern import VirtualWork
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.linear import ClassDynamics
from nanorom.verification.symmetry import Classes

Forces = dict[Parity, Array]  # (degrees of freedom,) in N by class
Operators = Callable[[Parity], Any]  # (free, free) in N/m on a class, what it adds to the stiffness


class Discrete(Protocol):
    """The force on all degrees of freedom of a film, beyond that of tension and bending.

    free : rows of the degrees of freedom of each class that may move; even : the class that every
    mirror leaves as it is; odd : the force on the mirrored deflection is the mirrored force.
    Deflections and forces are lists of (free, m), one for each class; a state is what the force
    makes of an orbit.
    """

    @property
    def free(self) -> Mapping[Parity, np.ndarray]:
        """Rows by class."""

    @property
    def even(self) -> Parity:
        """A class."""

    @property
    def odd(self) -> bool:
        """Whether the film does not tell its sides."""

    def force(
        self, classes: Classes, parts: Sequence[Array], viscous: Array | None = None
    ) -> tuple[list[Array], Any]:
        """Force of deflections at time samples, and the state that it is the force of.

        viscous (m, m): 1 + tau d/dt on time samples, of a viscoelastic material.
        """

    def tangent(
        self, classes: Classes, state: Any, parts: Sequence[Array], viscous: Array | None = None
    ) -> list[Array]:
        """Derivative of the force about a state, along deflections."""

    @property
    def follows(self) -> bool:
        """Whether what follows modes at once, at second order, is among the unknowns."""

    def settled(self, classes: Classes, parts: Sequence[Array]) -> list[Array]:
        """Motions of modes alone, with what of the film follows them at once."""

    def stiffening(self, parity: Parity, state: Any, modes: Array) -> Array:
        """What the mean membrane force of a state adds to the stiffness of modes (k, k)."""

    def varying(self, parity: Parity, state: Any, modes: Array) -> Array:
        """What the rest of it adds to the stiffness of each mode (k, m) at time samples."""

    def heights(self, classes: Classes, parts: Sequence[Array]) -> Array:
        """Deflections (..., m) at many points of the film, from the static state."""


@attrs.frozen
class Units:
    """SI value = unit x value: time in s, deflection in m, stiffness in N/m, tension in N/m."""

    time: float
    deflection: float
    stiffness: float

    @property
    def force(self) -> float:
        """In N."""
        return self.stiffness * self.deflection

    @property
    def energy(self) -> float:
        """In J."""
        return self.force * self.deflection


@attrs.frozen(eq=False)
class Film(ABC):
    """A scene's film: all that its orbits need, film-scaled, and the units to and from SI.

    names, parities, values : of named modes (N,), their classes and squared frequencies; modal :
    matrices and tensors of the named modes in SI units: mass, stiffness, quadratic, cubic; of a
    viscoelastic material, bending and stretching; of a squeezed gas, squeezed, its damping in N/m
    per film-scaled rate; losses : 1/Q by mechanism; inside (L,): places of
    the model's modes among the named; classes : of symmetry, copies : how many of the meshed part
    make the whole.
    """

    scene: Scene
    units: Units
    discrete: Discrete
    names: list[str]
    parities: list[Parity]
    values: Array
    modal: dict[str, Array]
    losses: dict[str, Array]
    inside: np.ndarray
    classes: Sequence[Parity]
    copies: int

    @abstractmethod
    def shapes(self, parity: Parity) -> Array:
        """Named modes (free, k) of a class, of unit mass on the meshed part."""

    @abstractmethod
    def mass(self, parity: Parity) -> Any:
        """Matrix (free, free) of a class."""

    @abstractmethod
    def dynamics(self, parity: Parity, highest: float) -> ClassDynamics:
        """Linear dynamics of a class, its modes known up to a frequency (film-scaled)."""

    @property
    @abstractmethod
    def work(self) -> VirtualWork[Forces, Operators]:
        """Of simple forces on all degrees of freedom of the meshed part."""

    @property
    def quality(self) -> Array:
        """Quality factor (N,) of each named mode, by the film's losses and what the scene gives.

        Outside the model the latter is that of its highest mode.
        """
        assert self.scene.damping is not None
        given = self.scene.damping.per_mode(len(self.inside))
        found = np.full(len(self.parities), given[-1])
        found[self.inside] = given
        return np.asarray(1 / (1 / found + sum(self.losses.values())))

    @property
    def rates(self) -> Array:
        """Damping rate (N,) of each named mode."""
        return self.natural / self.quality

    @property
    def natural(self) -> Array:
        """Natural frequency (N,) of each named mode, with what a gas adds to its stiffness."""
        squares = np.diag(self.modal["stiffness"]) / self.modal["mass"]
        return np.asarray(np.sqrt(squares) * self.units.time)

    @property
    def scale(self) -> Array:
        """Amplitude (N,) in m of each named mode per coordinate of unit mass."""
        mass = self.modal["mass"] / (self.units.stiffness * self.units.time**2) / self.copies
        return np.asarray(self.units.deflection / np.sqrt(mass))

    def all_named(self, coefficients: Array) -> Array:
        """Coefficients (m, N) of all named modes, of (m, L) of the model's or of all."""
        if coefficients.shape[1] != len(self.inside):
            return coefficients
        found = np.zeros((len(coefficients), len(self.parities)))
        found[:, self.inside] = coefficients
        return found

    def of_class(self, parity: Parity) -> np.ndarray:
        """Places (k,) of the named modes of a class."""
        return np.array([i for i, p in enumerate(self.parities) if p == parity], dtype=int)


@attrs.frozen(eq=False)
class FilmWork(VirtualWork[Forces, Operators]):
    """Virtual work on all degrees of freedom, by class."""

    film: Film

    def proportional(self, force: Forces) -> Operators:
        driven = on_free(self.film, force)
        return lambda parity: _proportional(self.film, driven, parity)


UNSEEN = 1e-12  # of the largest force: a class that is driven less is not driven


def on_free(film: Film, whole: Forces) -> Forces:
    """Forces on the degrees of freedom that may move, of the classes that are driven."""
    forces = {p: f[film.discrete.free[p]] for p, f in whole.items()}
    largest = max(float(np.abs(f).max()) for f in forces.values())
    return {p: f for p, f in forces.items() if np.abs(f).max() > UNSEEN * largest}


def _proportional(film: Film, driven: Forces, parity: Parity) -> Any:
    """F_r = J_r q_r of the named modes, with the J_r of a direct force on the whole film."""
    own, shapes = film.of_class(parity), film.shapes(parity)
    momenta = film.mass(parity) @ shapes
    size = len(shapes)
    direct = driven.get(parity, np.zeros(size))
    # J_r of all copies, its force on one of them
    factor = -(shapes.T @ direct) * film.scale[own] / film.units.deflection

    def apply(columns: Array) -> Array:
        pulled = momenta @ (factor[:, None] * (momenta.T @ columns.reshape(size, -1)))
        return np.asarray(pulled.reshape(columns.shape))

    return spl.LinearOperator((size, size), matvec=apply, matmat=apply)
