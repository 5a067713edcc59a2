"""A film's own equations of motion, in-plane inertia included: what its manifolds are made of.

Unknowns are the deflection w from the static state, of each class of symmetry that takes part, and
the in-plane displacement u of each class of strain.  With s0 the slope of the static state

    E = L + 1/2 grad w (x) grad w ,  L = sym grad u + sym(s0 (x) grad w) ,

so that the force is a polynomial: quadratic with the products of both parts of E, cubic with the
square of the second.  Source: von Karman's and Marguerre's plates.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import attrs
import numpy as np
import scipy.sparse as sp

from nanorom.errors import SceneError
from nanorom.fem.fields import membrane
from nanorom.fem.symmetry import Parity
from nanorom.types import Array
from nanorom.verification.film import DiscreteFilm, pulled, symmetric_product
from nanorom.verification.plate import PlateFilm
from nanorom.verification.symmetry import Classes, images
from nanorom.verification.tables import stretching

CHUNK_ENTRIES = 4_000_000  # numbers that one array of a chunk of cells may have
SHEARED = np.array([1.0, 1.0, 2.0]).reshape(3, 1, 1, 1, 1)  # work of stresses on strains


@attrs.frozen(eq=False, slots=False)
class FilmSystem:
    """`rom.manifold.full.FullSystem` of a plate or membrane, film-scaled.

    mass, stiffness (n, n): by class, deflections first.
    """

    film: PlateFilm
    classes: Classes
    mass: sp.csr_matrix
    stiffness: sp.csr_matrix

    @classmethod
    def of(cls, film: PlateFilm, masters: Sequence[int]) -> FilmSystem:
        """Of the classes that named modes, from 0, lead to; raises SceneError for forces that are
        no polynomials.
        """
        discrete = film.discrete
        if discrete.gate is not None:
            raise SceneError(
                "plate.gate: found; a manifold is made of polynomial forces, which attraction is "
                "none of"
            )
        present = {film.parities[place] for place in masters}
        if discrete.shape is not None:
            present.add(discrete.even)
        classes = Classes.spanned(present)
        return cls(film, classes, _mass(film, classes), _stiffness(film, classes))

    @property
    def discrete(self) -> DiscreteFilm:
        """The film's mesh."""
        return self.film.discrete

    @property
    def size(self) -> int:
        """Number of unknowns n."""
        return int(self.mass.shape[0])

    def embed(self, place: int, values: Array) -> Array:
        """Unknowns (n, p) of deflections (free, p) of one class."""
        found = np.zeros((self.size, values.shape[1]))
        found[self._deflections[place]] = values
        return found

    @property
    def rows(self) -> dict[Parity, slice]:
        """Rows of the deflections of each class."""
        return dict(zip(self.classes.deflections, self._deflections))

    def parts(self, vectors: Array) -> Iterator[tuple[Parity, np.ndarray, Array]]:
        """Of unknowns (n, p), each class of deflections: its free rows of all, and these (f, p)."""
        for parity, rows in self.rows.items():
            yield parity, self.discrete.free[parity], vectors[rows]

    def quadratic(self, u: Array, v: Array) -> Array:
        """Q(u, v) (n, p)."""
        a, b = self._slopes(u), self._slopes(v)
        ahead, behind = self._linear(u, a), self._linear(v, b)
        stress = self._stress(0.5 * symmetric_product(a, b))
        traction = 0.5 * (pulled(self._stress(behind), a) + pulled(self._stress(ahead), b))
        if self._still is not None:
            traction += pulled(stress, np.broadcast_to(self._still, a.shape))
        return self._work(traction, stress)

    def cubic(self, u: Array, v: Array, w: Array) -> Array:
        """T(u, v, w) (n, p)."""
        end = self._ends[len(self.classes.deflections) - 1]
        bent = np.all([x[:end].any(axis=0) for x in (u, v, w)], axis=0)
        found = np.zeros(u.shape)
        if bent.any():
            a, b, c = (self._slopes(x[:, bent]) for x in (u, v, w))
            traction = pulled(self._stress(symmetric_product(a, b)), c)
            traction += pulled(self._stress(symmetric_product(b, c)), a)
            traction += pulled(self._stress(symmetric_product(c, a)), b)
            found[:, bent] = self._work(traction / 6, None)
        return found

    def pair_products(self, vectors: Array, pairs: np.ndarray) -> Array:
        """int S_jk:C:S_lm (p, p) of pairs (p, 2) of vectors (n, r)."""
        slopes, tables = self._slopes(vectors), self.discrete.tables
        found = np.zeros((len(pairs),) * 2)
        cells, points = tables.weights.shape
        step = max(1, CHUNK_ENTRIES // (3 * self.classes.count * points * len(pairs)))
        for first in range(0, cells, step):
            own = slice(first, first + step)
            a, b = (slopes[:, :, own][..., each] for each in pairs.T)
            strain = np.moveaxis(symmetric_product(a, b), 1, 0)
            laws = attrs.evolve(self.discrete.laws, which=self.discrete.laws.which[own])
            stress = laws.stress(strain) * SHEARED
            stress *= tables.weights[own][..., None] / self.classes.count
            found += stress.reshape(-1, len(pairs)).T @ strain.reshape(-1, len(pairs))
        return found

    # -- parts --------------------------------------------------------------------------------

    @cached_property
    def _ends(self) -> list[int]:
        return np.cumsum(_sizes(self.film, self.classes)).tolist()

    @cached_property
    def _parts(self) -> list[slice]:
        return [slice(a, b) for a, b in zip([0, *self._ends], self._ends)]

    @property
    def _deflections(self) -> list[slice]:
        return self._parts[: len(self.classes.deflections)]

    @property
    def _strains(self) -> list[slice]:
        return self._parts[len(self.classes.deflections) :]

    @cached_property
    def _still(self) -> Array | None:
        still = self.discrete.still_slopes(self.classes)
        return None if still is None else still[..., None]

    def _slopes(self, u: Array) -> Array:
        """grad w (images, 2, c, q, p)."""
        return images(self.discrete.slopes(self.classes, [u[part] for part in self._deflections]))

    def _linear(self, u: Array, slope: Array) -> Array:
        """L (images, 3, c, q, p)."""
        tables = self.discrete.tables
        parts = np.zeros((self.classes.count, 3, *slope.shape[2:]))
        for number, (parity, part) in enumerate(zip(self.classes.strains, self._strains)):
            nodal = np.zeros((2 * tables.nodes, u.shape[1]))
            nodal[_rows(self.film, parity)] = u[part]
            x, y = (tables.gradient(nodal[k::2][tables.in_plane]) for k in range(2))
            parts[number] = np.stack([x[0], y[1], 0.5 * (x[1] + y[0])])
        found = images(parts)
        if self._still is not None:
            found = found + symmetric_product(np.broadcast_to(self._still, slope.shape), slope)
        return found

    def _stress(self, strain: Array) -> Array:
        return np.moveaxis(self.discrete.laws.stress(np.moveaxis(strain, 1, 0)), 0, 1)

    def _work(self, traction: Array, stress: Array | None) -> Array:
        """Forces (n, p) of tractions on grad w and stresses on grad u."""
        found = np.zeros((self.size, traction.shape[-1]))
        for part, force in zip(self._deflections, self.discrete.work(self.classes, traction)):
            found[part] = force
        if stress is None or not self._strains:
            return found
        tables = self.discrete.tables
        weighted = images(stress) * (tables.weights[..., None] / self.classes.count)
        for part, parity, (xx, yy, xy) in zip(self._strains, self.classes.strains, weighted):
            load = np.empty((2 * tables.nodes, traction.shape[-1]))
            load[0::2] = tables.work(xx, xy, tables.gather_in_plane)
            load[1::2] = tables.work(xy, yy, tables.gather_in_plane)
            found[part] = load[_rows(self.film, parity)]
        return found


def _rows(film: PlateFilm, parity: tuple[int, ...]) -> np.ndarray:
    """Free unrolled rows of the in-plane displacement."""
    return np.asarray(membrane.free_dofs(film.plate, parity).local)


def _sizes(film: PlateFilm, classes: Classes) -> list[int]:
    free = [len(film.discrete.free[parity]) for parity in classes.deflections]
    if not film.discrete.in_plane:
        return free
    return free + [len(_rows(film, parity)) for parity in classes.strains]


def _mass(film: PlateFilm, classes: Classes) -> sp.csr_matrix:
    blocks = [film.mass(parity) for parity in classes.deflections]
    if film.discrete.in_plane:
        tables, mass = film.discrete.tables, film.pieces.mass.tocoo()
        node = np.empty(tables.nodes, dtype=int)
        node[tables.dofs] = tables.in_plane  # the same basis, numbered otherwise
        moved = sp.csr_matrix((mass.data, (node[mass.row], node[mass.col])), mass.shape)
        # u is scaled by the square of the deflection over the length
        ratio = (film.units.deflection / film.scales.length) ** 2
        whole = sp.kron(moved, ratio * np.eye(2), "csr")
        for parity in classes.strains:
            rows = _rows(film, parity)
            blocks.append(whole[rows][:, rows])
    return sp.block_diag(blocks, format="csr")


def _stiffness(film: PlateFilm, classes: Classes) -> sp.csr_matrix:
    """Of tension, bending and linear stretching."""
    discrete, pieces = film.discrete, film.pieces
    held, shape = not discrete.in_plane, discrete.shape
    count = classes.count
    blocks: list[list[sp.spmatrix | None]] = [
        [None] * (count if held else 2 * count) for _ in range(count if held else 2 * count)
    ]
    for number, parity in enumerate(classes.deflections):
        blocks[number][number] = pieces.of_deflections(parity, discrete.free[parity])
    if not held:
        for number, parity in enumerate(classes.strains):
            rows = _rows(film, parity)
            blocks[count + number][count + number] = pieces.in_plane[rows][:, rows]
    if shape is not None:
        for number, parity in enumerate(classes.deflections):
            free, rows = discrete.free[parity], _rows(film, parity)
            whole = sp.csr_matrix(
                stretching(discrete.tables, shape, discrete.laws, free, rows, held)
            )
            n = len(free)
            blocks[number][number] = blocks[number][number] + whole[:n, :n]
            if not held:
                other = count + classes.strains.index(parity)
                blocks[number][other], blocks[other][number] = whole[:n, n:], whole[n:, :n]
    return sp.bmat(blocks, format="csr")
