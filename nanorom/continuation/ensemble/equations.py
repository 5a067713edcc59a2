"""The scaled equations of many members as sums of monomials, for all of them at once.

The state is z = (q, dq/dt, 1); time is the drive's angle theta, the same for all members:

    omega_b dv_r/dtheta = -sum_n w_rn z_a z_b z_c + sum_t terms_t(theta) (f_rtb + sum_j p_rjtb q_j)

over monomials n = (a, b, c) and the terms 1, cos theta, sin theta, cos 2 theta, ... of the drive.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import ModalSystem
from nanorom.types import Array, Numbers


@attrs.frozen(eq=False)
class Equations:
    """The equations of B members of one system at levels of their own, in units of `scaled`.

    pairs (p, 2), triples (n, 2): places in z of the factors of pairs, and a pair and a further
    place in z of each monomial; weights (L, n) of the monomials; force (L, 2K + 1, B);
    places (m, 2): row and column of the entries of parametric (m, 2K + 1, B); massless (L,):
    whether a coordinate is a state of first order.
    """

    scaled: ScaledSystem
    pairs: Numbers
    triples: Numbers
    weights: Array
    force: Array
    places: Numbers
    parametric: Array
    massless: Numbers

    @property
    def size(self) -> int:
        return self.scaled.size

    @property
    def tones(self) -> int:
        """The highest harmonic K of the drive."""
        return (self.force.shape[1] - 1) // 2

    @property
    def members(self) -> int:
        """Their number B."""
        return self.force.shape[-1]

    def of(self, members: Numbers) -> Equations:
        """The equations of some of the members, by their numbers."""
        if len(members) == self.members and np.array_equal(members, np.arange(self.members)):
            return self
        return attrs.evolve(
            self,
            force=np.ascontiguousarray(self.force[..., members]),
            parametric=np.ascontiguousarray(self.parametric[..., members]),
        )


def equations_of(system: ModalSystem, direct: Array, parametric: Array) -> Equations:
    """The equations of a system at the levels (B,) and (B,) of its members.

    Raises ContinuationError for levels that do not do.
    """
    strongest = (float(a[np.abs(a).argmax()]) for a in (direct, parametric))
    unit = system.scaled(*strongest)
    levels, which = np.unique(np.stack([direct, parametric], axis=1), axis=0, return_inverse=True)
    forces, stiffnesses = [], []
    for one, two in levels:
        drive = {
            "direct": one * system.direct_at(float(one)),
            "parametric": two * system.parametric_at(float(two)),
        }
        change = system.change(drive, unit)
        forces.append(change.force)
        stiffnesses.append(change.parametric)
    which = np.ravel(which)
    force = np.stack(forces, axis=-1)[..., which]
    some = np.any([np.any(p, axis=-1) for p in stiffnesses], axis=0)
    places = np.argwhere(some)
    stiffness = np.stack([p[places[:, 0], places[:, 1]] for p in stiffnesses], axis=-1)[..., which]
    pairs, triples, weights = monomials(unit)
    return Equations(
        unit,
        pairs,
        triples,
        weights,
        np.ascontiguousarray(force),
        places.astype(np.int32),
        np.ascontiguousarray(stiffness),
        unit.inertia == 0,
    )


def monomials(system: ScaledSystem) -> tuple[Numbers, Numbers, Array]:
    """Pairs (p, 2), triples (n, 2) and weights (L, n) of the forces without the drive."""
    size = system.size
    one, still = 2 * size, np.zeros
    parts = [  # an array, and for each of its axes but the first what to add for a place in z
        (system.stiffness, (0,)),
        (system.inertia[:, None] * system.damping, (size,)),
        (system.quadratic, (0, 0)),
        (system.cubic, (0, 0, 0)),
        (system.loss, (size, 0, 0)),
    ]
    rows, factors, values = [], [], []
    for array, shifts in parts:
        found = np.argwhere(array)
        factor = np.full((len(found), 3), one)
        factor[:, : len(shifts)] = found[:, 1:] + np.array(shifts)
        rows.append(found[:, 0])
        factors.append(np.sort(factor, axis=1))
        values.append(array[tuple(found.T)])
    unique, which = np.unique(np.concatenate(factors), axis=0, return_inverse=True)
    weights = still((size, len(unique)))
    np.add.at(weights, (np.concatenate(rows), np.ravel(which)), np.concatenate(values))
    # the first two factors are the pair: of linear terms, the constant comes last and is one
    pairs, number = np.unique(unique[:, :2], axis=0, return_inverse=True)
    triples = np.stack([np.ravel(number), unique[:, 2]], axis=1)
    return pairs.astype(np.int32), triples.astype(np.int32), weights
