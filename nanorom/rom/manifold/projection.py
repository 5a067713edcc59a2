"""The equations of motion of all degrees of freedom on the fields that a manifold is made of.

The fields W_a of the manifold of all degrees of freedom and the masters span a space in which the
manifold lies, whatever its style.  In coordinates of that space the equations (Galerkin) have this
very manifold, order by order, for each W_a solves its linear problem there, too.  So a modal system
of a few tens of coordinates stands for the film.  Fields are damped as modes are, by a Q.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from nanorom.errors import ModelError
from nanorom.rom import tensors
from nanorom.rom.manifold.direct import CHUNK, Fields, swapped
from nanorom.rom.manifold.full import FullSystem
from nanorom.rom.manifold.monomials import Monomials
from nanorom.types import Array

ALIKE = 1e-14  # of squared norms: directions of the fields below are round-off of others
SEEN = 1e-5  # of the first master where its cubic force is its linear one: fields of less are left
# out, which changes a frequency by the square of that
SPARED = 1e-3  # the same, where there would be more than MOST
REFINED, BESIDE = 3, 1e-4  # times, each by the shift's distance; of a frequency squared
MOST = 60  # coordinates, whose tensors take half a minute: their time goes with the third power


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
    system: FullSystem,
    shapes: Array,
    squares: Array,
    found: Fields,
    others: Array | None = None,
) -> Projection:
    """On modes (n, N) of unit mass and squared frequencies (N,), masters first, and their fields.

    others (n, k): further fields to be in the space, such as responses to a drive.  Raises
    ModelError for more fields than tensors can be made of.
    """
    places = np.arange(len(found.monomials))
    alone = (places <= swapped(found.monomials)) & found.slaves.any(axis=1)
    rows, degrees = found.slaves[alone].T, found.monomials.powers[alone].sum(axis=1)
    rows = rows * _unit(found, float(squares[0])) ** (degrees - 1)
    # a slave in resonance would hide all else: no field counts for more than the first master
    norms = np.sqrt(np.einsum("nk,nk->k", rows, system.stiffness @ rows) / squares[0])
    rows = rows / np.maximum(norms, 1.0)
    if others is not None:
        norms = np.sqrt(np.einsum("nk,nk->k", others, system.stiffness @ others))
        rows = np.column_stack([rows, others * (np.sqrt(squares[0]) / norms)])
    following, values = _following(system, shapes, rows, float(squares[0]))
    vectors = np.concatenate([shapes, following], axis=1)
    return Projection(
        vectors,
        np.concatenate([squares, values]),
        _quadratic(system, vectors),
        _cubic(system, vectors),
    )


def _unit(found: Fields, square: float) -> float:
    """The first master at which its cubic force would be its linear one, by its backbone."""
    monomials: Monomials = found.monomials
    if monomials.order < 3:
        return 1.0
    powers = np.zeros(monomials.variables, dtype=int)
    powers[0], powers[monomials.variables // 2] = 2, 1
    shift = abs(float(found.dynamics[monomials.place(powers.tolist()), 0]))
    return float(np.sqrt(3 / 8 * np.sqrt(square) / shift)) if shift > 0 else 1.0


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


def _following(
    system: FullSystem, shapes: Array, fields: Array, square: float
) -> tuple[Array, Array]:
    """Vectors (n, k) of unit mass that span fields (n, p) without the modes, as if they were
    modes, and their squared frequencies (k,).

    square : the elastic energy, twice, that fields are to be seen beside.
    """
    fields = fields[:, fields.any(axis=0)]
    for _ in range(2):  # round-off of the first time is removed by the second
        fields = fields - shapes @ ((system.mass @ shapes).T @ fields)
    if not fields.size:
        return np.zeros((len(shapes), 0)), np.zeros(0)
    norms, turned = eigh(fields.T @ (system.stiffness @ fields))
    large = np.flatnonzero(norms > max(ALIKE * norms.max(), SEEN**2 * square))
    room = MOST - shapes.shape[1]
    if len(large) > room:
        if norms[-room - 1] > SPARED**2 * square:
            raise ModelError(
                f"order: found one whose manifold spans {len(large)} fields; allowed: up to {room} "
                "beside the modes; lower the order, or take fewer masters"
            )
        large = large[-room:]
    fields = fields @ (turned[:, large] / np.sqrt(norms[large]))
    masses, turned = eigh(fields.T @ (system.mass @ fields), fields.T @ (system.stiffness @ fields))
    if masses.min(initial=1.0) <= 0:
        raise ModelError("manifold: a field that follows the masters has no inertia")
    return (fields @ (turned / np.sqrt(masses)))[:, ::-1], 1 / masses[::-1]


def _quadratic(system: FullSystem, vectors: Array) -> Array:
    """v_a . Q(v_b, v_c) (r, r, r)."""
    size = vectors.shape[1]
    first, second = np.triu_indices(size)
    found = np.empty((size, size, size))
    for begin in range(0, len(first), CHUNK):
        j, k = (each[begin : begin + CHUNK] for each in (first, second))
        work = vectors.T @ system.quadratic(vectors[:, j], vectors[:, k])
        found[:, j, k] = found[:, k, j] = work
    return found


def _cubic(system: FullSystem, vectors: Array) -> Array:
    """v_a . T(v_b, v_c, v_d) (r, r, r, r)."""
    pairs = np.column_stack(np.triu_indices(vectors.shape[1]))
    products = np.empty((vectors.shape[1],) * 4)
    tensors.unpacked(system.pair_products(vectors, pairs), pairs, products)
    return tensors.symmetrised(products)
