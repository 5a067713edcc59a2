"""Films of which everything that moves is an unknown: shells and solids, from their own forces.

Nothing is condensed: M u'' + K u + Q(u, u) + T(u, u, u) = f.  In these coordinates modes pull on
the rest at second order (a director that turns becomes shorter, a surface that bends is drawn in),
and the rest answers at once.  So a modal orbit is an orbit of the film only with what follows it
(`settled`), and its equations are those of the modes with all else condensed (`condensed`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Protocol

import attrs
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from nanorom.fem.symmetry import Parity
from nanorom.rom import tensors
from nanorom.rom.manifold.full import FullSystem
from nanorom.rom.shapes import Shapes
from nanorom.types import Array
from nanorom.verification.assembled import Film
from nanorom.verification.factors import Factors
from nanorom.verification.linear import ClassDynamics, completed
from nanorom.verification.symmetry import Classes

ONLY: Parity = ()  # class of symmetry: such films are meshed as a whole
MOST_SETTLING = 20  # times that what follows is corrected
SETTLED = 1e-6  # of the work of what follows: a start needs no more
PAIRS_AT_ONCE = 256  # columns of a force


class Moving(FullSystem, Protocol):
    """A full system whose forces are also known summed, which takes a third of the time."""

    def linear(self, u: Array) -> Array:
        """K u (n, p): of slender solids the entries of K have too few digits for a resonance."""

    def force(self, u: Array) -> Array:
        """Q(u, u) + T(u, u, u) (n, p)."""

    def along(self, u: Array, v: Array) -> Array:
        """2 Q(u, v) + 3 T(u, u, v) (n, p)."""


@attrs.frozen(eq=False)
class Rest:
    """What is not in modes (n, m) of unit mass, and how it gives way to forces at once.

    momenta (n, m): M times the modes; static: factors of K.
    """

    modes: Array
    momenta: Array
    static: Factors

    @classmethod
    def of(cls, system: FullSystem, modes: Array, static: Factors) -> Rest:
        """Beyond modes of a system."""
        return cls(modes, system.mass @ modes, static)

    def force(self, columns: Array) -> Array:
        """Forces (n, p) without their work on the modes."""
        return np.asarray(columns - self.momenta @ (self.modes.T @ columns))

    def response(self, columns: Array) -> Array:
        """Static displacement (n, p) under forces, none of the modes in it."""
        found = self.static.solve(self.force(columns))
        return np.asarray(found - self.modes @ (self.momenta.T @ found))


@attrs.frozen(eq=False)
class WholeForce:
    """Forces beyond linear ones: `assembled.Discrete` of a full system.

    surface (p, n): deflections at many points; rest: beyond the named modes.
    """

    system: Moving
    surface: sp.csr_matrix
    rest: Rest
    even: Parity = ONLY
    odd: bool = False
    follows: bool = True

    @property
    def free(self) -> Mapping[Parity, np.ndarray]:
        """All that is an unknown."""
        return {ONLY: np.arange(self.system.size)}

    def force(
        self, classes: Classes, parts: Sequence[Array], viscous: Array | None = None
    ) -> tuple[list[Array], Array]:
        """Force (n, m) of a motion (n, m), and the motion."""
        (u,) = parts
        return [self.system.force(u)], u

    def tangent(
        self, classes: Classes, state: Array, parts: Sequence[Array], viscous: Array | None = None
    ) -> list[Array]:
        """Derivative (n, m) of the force along (n, m)."""
        return [self.system.along(state, parts[0])]

    def settled(self, classes: Classes, parts: Sequence[Array]) -> list[Array]:
        """A motion (n, m) of the named modes, with what follows it at once."""
        (moved,) = parts
        slaves, last = np.zeros_like(moved), np.inf
        for _ in range(MOST_SETTLING):
            change = -self.rest.response(self.system.force(moved + slaves)) - slaves
            size = float(np.abs(change).max())
            if not size < last:
                break
            slaves, last = slaves + change, size
            if size <= SETTLED * np.abs(slaves).max(initial=0.0):
                break
        return [moved + slaves]

    def stiffening(self, parity: Parity, state: Array, modes: Array) -> Array:
        """Nothing: with all else at rest modes would be made far too stiff."""
        return np.zeros((modes.shape[1],) * 2)

    def varying(self, parity: Parity, state: Array, modes: Array) -> Array:
        """Nothing, too."""
        return np.zeros((modes.shape[1], state.shape[1]))

    def heights(self, classes: Classes, parts: Sequence[Array]) -> Array:
        """Deflections (p, m) from the static state."""
        return np.asarray(self.surface @ parts[0])


@attrs.frozen(eq=False)
class WholeFilm(Film):
    """A film whose unknowns are all that moves; named (n, N): modes of unit mass."""

    discrete: WholeForce
    named: Array

    @abstractmethod
    def drawn(self, vectors: Array) -> Shapes:
        """Deflections in m of vectors (n, r) that are reached at a coordinate of 1 m."""

    def shapes(self, parity: Parity) -> Array:
        """Named modes (n, N)."""
        return self.named

    def mass(self, parity: Parity) -> sp.csr_matrix:
        """Matrix (n, n)."""
        return self.discrete.system.mass

    def dynamics(self, parity: Parity, highest: float) -> ClassDynamics:
        """Linear dynamics, its modes known up to a frequency (film-scaled)."""
        system = self.discrete.system
        alone = ClassDynamics(
            stiffness=_elastic(system),
            mass=system.mass,
            static=self.discrete.rest.static,
            extra=0,
            modes=self.named,
            values=self.values,
            rates=self.rates,
            loss=0.0,
        )
        return completed(alone, float(self.quality[-1]), highest, system.stiffness)


def _elastic(system: Moving) -> spl.LinearOperator:
    """K (n, n) to more digits than its entries have."""
    shape = (system.size,) * 2

    def apply(columns: Array) -> Array:
        found = system.linear(columns.reshape(system.size, -1))
        return np.asarray(found.reshape(columns.shape))

    return spl.LinearOperator(shape, matvec=apply, matmat=apply, dtype=float)


def outer(factors: Array, rank: int) -> Array:
    """Products of the factors, for all indices of a tensor of a rank."""
    found = factors
    for _ in range(rank - 1):
        found = np.multiply.outer(found, factors)
    return found


def condensed(system: Moving, rest: Rest) -> tuple[Array, Array]:
    """Quadratic (N, N, N) and cubic (N, N, N, N) of modes of unit mass, all else following.

    As `fem.tensors.solid` has them.
    """
    modes, n = rest.modes, rest.modes.shape[1]
    pairs = np.column_stack(np.triu_indices(n))
    j, k = pairs.T
    force = np.empty((len(modes), len(pairs)))
    for first in range(0, len(pairs), PAIRS_AT_ONCE):
        own = slice(first, first + PAIRS_AT_ONCE)
        force[:, own] = system.quadratic(modes[:, j[own]], modes[:, k[own]])
    quadratic = np.zeros((n, n, n))
    quadratic[:, j, k] = quadratic[:, k, j] = modes.T @ force
    response = rest.response(force)
    energy = force.T @ response
    products, given_way = np.zeros((n,) * 4), np.zeros((n,) * 4)
    tensors.unpacked(system.pair_products(modes, pairs), pairs, products)
    tensors.unpacked(0.5 * (energy + energy.T), pairs, given_way)
    even = (quadratic + quadratic.transpose(1, 0, 2) + quadratic.transpose(2, 1, 0)) / 3
    return even, tensors.symmetrised(products) + tensors.paired(given_way)
