"""Modes as deflections of a surface: all that naming, scaling and drawing ask of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import attrs
import numpy as np
from petsc4py import PETSc

from nanorom.fem.fields.surface import Surface
from nanorom.fem.solvers import algebra
from nanorom.fem.symmetry import Parity

AnyModes = TypeVar("AnyModes", bound="Deflections")


@attrs.frozen(eq=False, kw_only=True)
class Deflections:
    """The lowest modes of a film or shell, sorted by frequency.

    eigenvalues: (n,) squared frequencies in the film's units; shapes: (local dofs, n) of the film's
    deflections; parities: n classes of symmetry; mass: of deflections, assembled on all degrees of
    freedom; diameters: (n,) nodal ones, where the film is a body of revolution; shift: (n,) of
    frequencies, relative, where near ones are told as equal.
    """

    film: Surface
    eigenvalues: np.ndarray
    shapes: np.ndarray
    parities: list[Parity]
    mass: PETSc.Mat
    diameters: np.ndarray | None = None
    shift: np.ndarray | None = None

    @property
    def n_owned(self) -> int:
        """Degrees of freedom of this rank, the first of the local ones."""
        return self.mass.getLocalSize()[0]

    @property
    def key(self) -> str:
        """Tells mesh and modes from others."""
        dofs = self.film.deflections.dofmap.index_map.size_global
        return f"{dofs} dofs, eigenvalues {self.eigenvalues.sum():.9e}"

    def modal(self, operators: Mapping[Parity, PETSc.Mat]) -> np.ndarray:
        """Phi^T K Phi (L, L) over the whole film of matrices by class. Collective."""
        return self._products(
            lambda parity, shapes: algebra.multiply(operators[parity], shapes[: self.n_owned])
        )

    def momentum(self) -> np.ndarray:
        """int m phi (L,) over the whole film, masses on it included. Collective."""
        moved = algebra.multiply(self.mass, np.ones((self.n_owned, 1)))[:, 0]
        total = self.film.domain.comm.allreduce(moved @ self.shapes[: self.n_owned])
        even = np.array([parity == self.film.mirrors.even for parity in self.parities])
        return np.asarray(self.film.mirrors.copies * even * total)

    def _products(self, force: Callable[[Parity, np.ndarray], np.ndarray]) -> np.ndarray:
        """Work (L, L) of the forces of all modes; different parities have none. Collective."""
        owned = self.shapes[: self.n_owned]
        columns = np.empty_like(owned)
        for parity in sorted(set(self.parities)):  # collective: in one order on every rank
            own = [i for i, p in enumerate(self.parities) if p == parity]
            columns[:, own] = force(parity, self.shapes[:, own])
        same = np.array([[a == b for b in self.parities] for a in self.parities])
        product = self.film.mirrors.copies * same * (owned.T @ columns)
        product = self.film.domain.comm.allreduce(product)
        return 0.5 * (product + product.T)

    def take(self: AnyModes, index: np.ndarray) -> AnyModes:
        """Some of the modes, or all in another order."""
        return attrs.evolve(
            self,
            eigenvalues=self.eigenvalues[index],
            shapes=np.ascontiguousarray(self.shapes[:, index]),
            parities=[self.parities[i] for i in index],
            diameters=None if self.diameters is None else self.diameters[index],
            shift=None if self.shift is None else self.shift[index],
        )
