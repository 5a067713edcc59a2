"""The equations of motion of all degrees of freedom on the fields that a manifold is made of.

The fields W_a of the manifold of all degrees of freedom and the masters span a space in which the
manifold lies, whatever its style.  In coordinates of that space the equations (Galerkin) have this
very manifold, order by order, for each W_a solves its linear problem there, too.  So a modal system
of a few tens of coordinates stands for the film.  Fields are damped as modes are, by a Q.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement

import attrs
import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from nanorom.errors import ModelError
from nanorom.rom.manifold.basis import basis
from nanorom.rom.manifold.direct import CHUNK, Fields, swapped
from nanorom.rom.manifold.equations import Equations, displacement_unit
from nanorom.rom.manifold.full import FullSystem
from nanorom.rom.tensors import symmetrise
from nanorom.types import Array

ALIKE = 1e-12  # of squared norms: directions of the fields below are round-off of others
REFINED, BESIDE = 3, 1e-4  # times, each by the shift's distance; of a frequency squared
MOST = 90  # coordinates: half a gigabyte of tensors


@attrs.frozen(eq=False)
class Projection:
    """M, K, Q and T in coordinates of unit mass that no stiffness couples.

    vectors (n, r): the masters, then what follows them, by frequency; squares (r,): squared
    frequencies; quadratic (r, r, r); cubic (r, r, r, r).
    """

    vectors: Array
    squares: Array
    quadratic: Array
    cubic: Array


def project(
    system: FullSystem, shapes: Array, squares: Array, found: Fields, others: Array | None = None
) -> Projection:
    """On masters (n, m) of unit mass and squared frequencies (m,), and their fields.

    others (k, n): further fields to be in the space, such as responses to a drive.  Raises
    ModelError for more fields than tensors can be made of.
    """
    places = np.arange(len(found.monomials))
    rows = found.slaves[places <= swapped(found.monomials)]
    if others is not None:
        rows = np.concatenate([rows, others])
    following, values = _following(system, shapes, rows)
    vectors = np.concatenate([shapes, following], axis=1)
    size = vectors.shape[1]
    if size > MOST:
        raise ModelError(
            f"order: found one whose manifold spans {size} fields; allowed: up to {MOST}; lower "
            "the order, or take fewer masters"
        )
    return Projection(
        vectors,
        np.concatenate([squares, values]),
        _tensor(system.quadratic, vectors, 2),
        _tensor(system.cubic, vectors, 3),
    )


def in_units(found: Projection, quality: Array, scale: Array, time: float) -> Equations:
    """Equations in units of their own: time in s, scale (r,): m per coordinate of unit mass.

    quality (r,): quality factors of masters and fields.
    """
    first, size = float(np.sqrt(found.squares[0])), len(scale)
    unit = 1 / scale
    share = (scale[0] * unit) ** 2  # of the first one's mass
    by = (scale[0] / first) ** 2
    stiffness = np.diag(share * found.squares / first**2)
    damping = np.diag(share * np.sqrt(found.squares) / (first * quality))
    quadratic = by * found.quadratic * np.einsum("i,j,k->ijk", unit, unit, unit)
    cubic = by * found.cubic * np.einsum("i,j,k,l->ijkl", unit, unit, unit, unit)
    amplitude = displacement_unit(stiffness, quadratic, cubic, 0)
    return Equations(
        first / time,
        amplitude,
        basis(np.diag(share), damping, stiffness),
        mass=np.diag(share),
        damping=damping,
        stiffness=stiffness,
        quadratic=quadratic * amplitude,
        cubic=symmetrise(cubic * amplitude**2),
        cubic_damping=np.zeros((size,) * 4),
        direct=np.zeros(size),
        parametric=np.zeros((size, size)),
    )


def near(system: FullSystem, start: Array, squares: Array) -> tuple[Array, Array]:
    """Modes (n, m) of unit mass near others, and their squared frequencies, from about these (m,).

    By inverse iteration of the whole group, about each of its frequencies in turn.
    """
    found = start
    for _ in range(REFINED):
        columns = []
        for value, column in zip(squares, found.T):
            shifted = system.stiffness - value * (1 - BESIDE) * system.mass
            columns.append(splu(shifted.tocsc()).solve(system.mass @ column))
        found = np.column_stack(columns)
        squares, turned = eigh(
            found.T @ (system.stiffness @ found), found.T @ (system.mass @ found)
        )
        found = found @ turned
    sign = np.sign(np.einsum("nm,nm->m", found, system.mass @ start))
    return found * sign, squares


def _following(system: FullSystem, shapes: Array, rows: Array) -> tuple[Array, Array]:
    """Vectors (n, k) of unit mass that span fields (p, n) without the masters, as if they were
    modes, and their squared frequencies (k,).
    """
    fields = rows[rows.any(axis=1)].T
    for _ in range(2):  # round-off of the first time is removed by the second
        fields = fields - shapes @ ((system.mass @ shapes).T @ fields)
    if not fields.size:
        return np.zeros((len(shapes), 0)), np.zeros(0)
    fields = fields / np.sqrt(np.einsum("nk,nk->k", fields, system.stiffness @ fields))
    norms, turned = eigh(fields.T @ (system.stiffness @ fields))
    large = norms > ALIKE * norms.max()
    fields = fields @ (turned[:, large] / np.sqrt(norms[large]))
    masses, turned = eigh(fields.T @ (system.mass @ fields), fields.T @ (system.stiffness @ fields))
    if masses.min() <= 0:
        raise ModelError("manifold: a field that follows the masters has no inertia")
    return (fields @ (turned / np.sqrt(masses)))[:, ::-1], 1 / masses[::-1]


def _tensor(force: Callable[..., Array], vectors: Array, degree: int) -> Array:
    """vectors . force(vectors, ...), (r,) * (degree + 1)."""
    size = vectors.shape[1]
    chosen = np.array(list(combinations_with_replacement(range(size), degree)))
    found = np.empty((len(chosen), size))
    for begin in range(0, len(chosen), CHUNK):
        part = chosen[begin : begin + CHUNK]
        columns = [vectors[:, part[:, k]] for k in range(degree)]
        found[begin : begin + CHUNK] = (vectors.T @ force(*columns)).T
    places = np.zeros((size,) * degree, dtype=int)
    places[tuple(chosen.T)] = np.arange(len(chosen))
    every = np.sort(np.indices((size,) * degree).reshape(degree, -1), axis=0)
    whole = found[places[tuple(every)]]
    return np.ascontiguousarray(whole.T.reshape((size,) * (degree + 1)))
