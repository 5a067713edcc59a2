"""Rigid motions of a flat film out of its plane, which a film that nothing holds is free to make.

They have no frequency and no part in a reduced model: they are left out.  A shift of the spectrum
makes the stiffness definite, K + s M, and leaves the modes as they are.  So it does where springs
resist them, but by less than the stiffness of bending is rounded by.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from nanorom.fem.fields.places import extent
from nanorom.fem.models.operators import LinearForce
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import algebra
from nanorom.fem.symmetry import Parity

FREE = 1e-12  # of the stiffness of bending over the whole film: what resists less is rounding
SOFT = 0.1  # of that of bending alone: small cells round their stiffness by 1e-3 and more, measured


def scale(plate: Plate) -> float:
    """Squared frequency, to its order of magnitude, of the film's lowest mode. Collective."""
    return bent(plate) + float(np.abs(plate.state.tensor).max()) * wavenumber(plate) ** 2


def bent(plate: Plate) -> float:
    """The part of it that bending has: tension may act along one axis, or relax. Collective."""
    return float(plate.stiffness.bending * wavenumber(plate) ** 4) if plate.bending else 0.0


def wavenumber(plate: Plate) -> float:
    """Of half a wave over the film's longer side. Collective."""
    return float(np.pi / (2 * extent(plate)[1]))


def resisted(
    plate: Plate, parity: Parity, free: algebra.FreeDofs, mass: PETSc.Mat, force: LinearForce
) -> np.ndarray:
    """Squared frequencies (n,) of a class's rigid motions; mass on free rows. Collective.

    Of w = 1, x and y those that rigid supports allow; by `scale` `FREE` and less are nothing.
    """
    comm, places = free.comm, plate.deflections.tabulate_dof_coordinates()[:, :2]
    motions = np.column_stack([np.ones(len(places)), places])
    odd = [plate.mirrors.parity_in(axis, parity) for axis in ("x", "y")]
    fits = [all(p is None or p == q for p, q in zip(odd, own)) for own in ((0, 0), (1, 0), (0, 1))]
    motions = motions[:, fits]
    held = np.ones(free.n_owned, dtype=bool)
    held[free.local] = False
    owned = motions[: free.n_owned]
    gram = comm.allreduce(np.array([owned[held].T @ owned[held], owned.T @ owned]))
    if motions.shape[1] == 0:
        return np.empty(0)
    at_supports, allowed = _ratios(gram[0], gram[1])
    motions = motions @ allowed[:, at_supports < FREE]
    if motions.shape[1] == 0:
        return np.empty(0)
    own = free.taken(motions)
    work = own.T @ free.taken(force(parity, motions))
    square = own.T @ algebra.multiply(mass, own)
    work, square = comm.allreduce(np.array([work, square]))
    return _ratios(work, square)[0]


def _ratios(form: np.ndarray, square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sizes (n,) of a form by another, definite one, and the combinations (n, n) that have them."""
    root = np.linalg.inv(np.linalg.cholesky(square))
    values, vectors = np.linalg.eigh(root @ form @ root.T)
    return np.abs(values), root.T @ vectors
