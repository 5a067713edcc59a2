"""Coordinates in which symmetries of a system are changes of sign.

Supports (`harmonics`) know a symmetry only as signs of the coordinates. Exchanging two
identical oscillators is one in the normal coordinates of the linear system; in a pair of equal
frequencies, a reflection is one where an axis of the pair lies along the drive, or along an
extremum of the pair's own nonlinear energy. Such coordinates are taken where they have more
symmetries of this kind than the given ones; else nothing changes. Source: Golubitsky, Stewart and
Schaeffer 1988, doi:10.1007/978-1-4612-4574-2 (fixed-point subspaces).
"""

from __future__ import annotations

import numpy as np

from nanorom.continuation.scaled import ARRAYS, DRIVEN, ROUND_OFF, ScaledSystem
from nanorom.types import Array

EQUAL = 1e-9  # relative difference of squared frequencies below which two modes are a pair
MOST_MODES = 62  # bits of a row of equations for the signs
ON_A_LINE = 1e-6  # of a motion: its extent across its line
PLACES = 5  # at which forces are compared
INVARIANT = 1e-9  # of the forces: what a symmetric system may change by
SAMPLES = 16  # of a circle: terms up to the fourth order, exactly
UNCOUPLED = 1e-9  # of the stiffness: off its diagonal, the coordinates are not normal ones


def with_symmetries(system: ScaledSystem) -> ScaledSystem:
    """The system in the coordinates that show most of its symmetries."""
    if not 1 < system.size <= MOST_MODES or not _may_gain(system):
        return system
    best, most = system, sign_symmetries(system)
    turned = system.turned(_normal_modes(system))
    if (count := sign_symmetries(turned)) > most:
        best, most = turned, count
    for pair in pairs(best):
        for matrix in _axes(best, pair):
            turned = best.turned(matrix)
            if (count := sign_symmetries(turned)) > most:
                best, most = turned, count
    return best


def sign_symmetries(system: ScaledSystem) -> int:
    """The number of independent changes of sign of coordinates, with or without a shift by half a
    period of the drive, that leave the equations as they are.
    """
    shift = np.uint64(1) << np.uint64(system.size)
    rows: set[int] = set()
    for name in ARRAYS:
        places = np.nonzero(getattr(system, name))
        row = np.zeros(len(places[0]), dtype=np.uint64)
        coordinates = places[:-1] if name in DRIVEN else places
        for index in coordinates:
            row ^= np.uint64(1) << index.astype(np.uint64)
        if name in DRIVEN:  # half a period turns the odd harmonics
            row[(places[-1] + 1) // 2 % 2 == 1] ^= shift
        rows.update(np.unique(row).tolist())
    return system.size + 1 - _rank(rows)


def generators(system: ScaledSystem) -> list[Array]:
    """Generators (L, L) of rotations of pairs that leave the equations as they are.

    They are sought among all joint rotations of pairs of equal frequency: of each, the part of the
    force that changes is linear in the generator, and a polynomial that vanishes at random places
    vanishes.
    """
    found = pairs(system)
    if not found:
        return []
    turns = np.zeros((len(found), system.size, system.size))
    for number, (a, b) in enumerate(found):
        turns[number, a, b], turns[number, b, a] = -1.0, 1.0
    random = np.random.default_rng(0)
    places = random.standard_normal((PLACES, 2, system.size))
    changes = np.array([[_change(system, turn, q, v) for q, v in places] for turn in turns])
    flat = changes.reshape(len(found), -1)
    sizes, vectors = np.linalg.eigh(flat @ flat.T)
    scale = max(float(np.abs(_forces(system, *places[0])).max()), 1.0) ** 2 * flat.shape[1]
    return [
        np.tensordot(vector, turns, axes=1)
        for size, vector in zip(sizes, vectors.T)
        if size < INVARIANT**2 * scale
    ]


def _forces(system: ScaledSystem, q: Array, v: Array) -> Array:
    """The forces (4K + 3, L): of the motion, of the terms of the drive and of the parametric
    drive.
    """
    products = np.outer(q, q)
    own = system.stiffness @ q + system.damping @ v
    own = own + np.einsum("rjk,jk->r", system.quadratic, products)
    own = own + np.einsum("rjkl,jk,l->r", system.cubic, products, q, optimize=True)
    own = own + np.einsum("rkjl,jl,k->r", system.loss, products, v, optimize=True)
    parametric = np.einsum("rjk,j->kr", system.parametric, q)
    return np.concatenate([own[None], system.force.T, parametric])


def _change(system: ScaledSystem, turn: Array, q: Array, v: Array) -> Array:
    """How the forces at turned places differ from turned forces, to first order (exactly, for a
    cubic, by central differences of four places).
    """
    slope = np.zeros((4 * system.tones + 3, system.size))
    for step, weight in ((1.0, 8 / 12), (-1.0, -8 / 12), (2.0, -1 / 12), (-2.0, 1 / 12)):
        slope += weight * _forces(system, q + step * turn @ q, v + step * turn @ v)
    return np.asarray(slope - _forces(system, q, v) @ turn.T)


def _rank(rows: set[int]) -> int:
    """Rank over the field of two elements."""
    pivots: dict[int, int] = {}
    for row in rows:
        while row:
            top = row.bit_length()
            if top not in pivots:
                pivots[top] = row
                break
            row ^= pivots[top]
    return len(pivots)


def _may_gain(system: ScaledSystem) -> bool:
    stiffness = system.stiffness
    off = np.abs(stiffness - np.diag(np.diag(stiffness))).max()
    return bool(off > UNCOUPLED * np.abs(stiffness).max()) or bool(pairs(system))


def _normal_modes(system: ScaledSystem) -> Array:
    """Linear modes as columns, by frequency; orthogonal where the stiffness is symmetric. States of
    first order stay by themselves.
    """
    massive = np.flatnonzero(system.inertia)
    if len(massive) < system.size:
        columns = np.eye(system.size)
        if len(massive):
            columns[np.ix_(massive, massive)] = _normal_modes(system.restrict(massive))
        return columns
    stiffness = system.stiffness
    if np.allclose(stiffness, stiffness.T, rtol=0, atol=ROUND_OFF * np.abs(stiffness).max()):
        return np.linalg.eigh((stiffness + stiffness.T) / 2)[1]
    values, vectors = np.linalg.eig(stiffness)
    vectors = vectors[:, np.argsort(values.real)].real
    return np.asarray(vectors / np.linalg.norm(vectors, axis=0))


def wave(system: ScaledSystem, coefficients: Array) -> str:
    """Whether the largest motion (2H + 1, L) of a pair of equal frequency is along a line
    ("standing") or not ("travelling"); "" of systems without such pairs, and at rest.
    """
    motions = [coefficients[:, list(pair)] for pair in pairs(system)]
    if not motions or not np.any(motions):
        return ""
    largest = max(motions, key=lambda motion: float(np.abs(motion).max()))
    sizes = np.linalg.svd(largest, compute_uv=False)
    return "standing" if sizes[1] < ON_A_LINE * sizes[0] else "travelling"


def pairs(system: ScaledSystem, equal: float = EQUAL) -> list[tuple[int, int]]:
    """Modes of equal frequency that the stiffness does not couple to others."""
    squares = np.diag(system.stiffness)
    order = np.argsort(squares, kind="stable")
    order = order[system.inertia[order] > 0]
    near = np.abs(np.diff(squares[order])) < equal * np.abs(squares[order][1:])
    return [(int(a), int(b)) for a, b in zip(order[:-1][near], order[1:][near])]


def _axes(system: ScaledSystem, pair: tuple[int, int]) -> list[Array]:
    """Rotations of a pair to axes that the drive, the damping or the nonlinear force prefer."""
    block = np.ix_(pair, pair)
    angles = []
    for force in system.force[list(pair)].T:
        if force.any():
            angles.append(float(np.arctan2(force[1], force[0])))
    for matrix in (*np.moveaxis(system.parametric[block], -1, 0), system.damping[block]):
        symmetric = (matrix + matrix.T) / 2
        angles.append(float(np.arctan2(2 * symmetric[0, 1], symmetric[0, 0] - symmetric[1, 1]) / 2))
    turns = 2 * np.pi / SAMPLES * np.arange(SAMPLES)
    direction = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    cubic = system.cubic[np.ix_(pair, pair, pair, pair)]
    quadratic = system.quadratic[np.ix_(pair, pair, pair)]
    radial = [
        (np.einsum("rjk,nr,nj,nk->n", quadratic, *[direction] * 3), (1, 3)),
        (np.einsum("rjkl,nr,nj,nk,nl->n", cubic, *[direction] * 4), (2, 4)),
    ]
    for values, orders in radial:
        terms = np.fft.rfft(values) / SAMPLES
        for order in orders:
            if abs(terms[order]) > ROUND_OFF * np.abs(values).max(initial=0.0):
                angles.append(float(-np.angle(terms[order]) / order))
    return [_rotation(system.size, pair, angle) for angle in angles if angle]


def _rotation(size: int, pair: tuple[int, int], angle: float) -> Array:
    matrix = np.eye(size)
    c, s = np.cos(angle), np.sin(angle)
    matrix[np.ix_(pair, pair)] = [[c, -s], [s, c]]
    return matrix
