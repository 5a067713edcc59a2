"""Independent parts of the variational equation: the modes that a disturbance of an orbit couples.

The tangent stiffness along an orbit couples only such modes as the moving ones couple. Under a
symmetric load the modes of a film fall into classes, and the variational equation into as many
parts that know nothing of each other: four under a pressure on a disc in tension along x and y.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from nanorom.continuation.orbits.pairs import Index, PairMatrix
from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array


@dataclass(frozen=True, eq=False)
class Part:
    """Modes (Lp,) that the variational equation couples while only m modes move.

    The tangent stiffness K and damping C + W of the part are linear in products of the moving
    modes, in their coordinates and velocities; entries [r, l] are flattened.
    """

    modes: Index
    cubic: PairMatrix  # of moving modes: the cubic term of K
    quadratic: Array  # (m, Lp * Lp)
    loss: PairMatrix  # W
    mixed: Array  # (Lp, m, Lp, m): of K, by velocity and coordinate
    stiffness: Array  # (Lp, Lp), as the others
    parametric: Array  # (2K + 1, Lp * Lp), by terms of the drive
    damping: Array
    inertia: Array  # (Lp,)
    has_loss: bool

    @property
    def size(self) -> int:
        return len(self.modes)

    @classmethod
    def of(cls, system: ScaledSystem, moving: Index, modes: Index) -> Part:
        """The part of some modes."""
        inner, outer = np.ix_(modes, modes), np.ix_(modes, modes, moving, moving)
        quadratic = system.quadratic[np.ix_(modes, moving, modes)].transpose(1, 0, 2)
        return cls(
            modes=modes,
            cubic=PairMatrix(3.0 * system.cubic[outer].transpose(2, 3, 0, 1)),
            quadratic=2.0 * quadratic.reshape(len(moving), len(modes) ** 2),
            loss=PairMatrix(system.loss[outer].transpose(2, 3, 0, 1)),
            mixed=2.0 * system.loss[np.ix_(modes, moving, modes, moving)],
            stiffness=system.stiffness[inner],
            parametric=by_term(system.parametric[inner]),
            damping=system.damping[inner],
            inertia=system.inertia[modes],
            has_loss=system.has_loss,
        )


def by_term(parametric: Array) -> Array:
    """Stiffness patterns (L, L, 2K + 1) as a matrix (2K + 1, L * L)."""
    return np.ascontiguousarray(parametric.reshape(-1, parametric.shape[-1]).T)


_of_system: WeakKeyDictionary[ScaledSystem, dict[bytes, list[Part]]] = WeakKeyDictionary()


def independent_parts(system: ScaledSystem, moving: Index) -> list[Part]:
    """The parts into which all modes fall while only the `moving` ones move; found once."""
    known = _of_system.setdefault(system, {})
    key = moving.tobytes()
    if key not in known:
        label = _coupled(system, moving)
        groups = [np.flatnonzero(label == i) for i in range(label.max() + 1)]
        known[key] = [Part.of(system, moving, group) for group in groups]
    return known[key]


def _coupled(system: ScaledSystem, moving: Index) -> Index:
    """Numbers (L,) of the parts to which the modes belong."""
    every = np.ix_(np.arange(system.size), np.arange(system.size), moving, moving)
    joined = (system.stiffness != 0) | (system.damping != 0)
    joined |= (system.parametric != 0).any(axis=2)
    joined |= (system.cubic[every] != 0).any(axis=(2, 3))
    joined |= (system.quadratic[:, :, moving] != 0).any(axis=2)
    if system.has_loss:
        loss = system.loss != 0
        joined |= loss[every].any(axis=(2, 3))
        joined |= loss[:, moving][:, :, :, moving].any(axis=(1, 3))
    return np.asarray(connected_components(coo_matrix(joined), directed=False)[1])
