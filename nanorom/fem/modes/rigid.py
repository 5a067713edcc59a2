"""Rigid motions of a flat film out of its plane, which a film that nothing holds is free to make.

They have no frequency and no part in a reduced model: they are left out.  A shift of the spectrum
makes the stiffness definite, K + s M, and leaves the modes as they are.
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


def scale(plate: Plate) -> float:
    """Squared frequency, to its order of magnitude, of the film's lowest mode. Collective."""
    _, radius = extent(plate)
    wave = np.pi / (2 * radius)
    bending = plate.stiffness.bending if plate.bending else 0.0
    return float(bending * wave**4 + np.abs(plate.state.tensor).max() * wave**2)


def count(
    plate: Plate, parity: Parity, free: algebra.FreeDofs, mass: PETSc.Mat, force: LinearForce
) -> int:
    """How many rigid motions of a class of symmetry nothing resists; mass on free rows. Collective.

    Of w = 1, x and y those that rigid supports allow, whose energy is none.
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
        return 0
    allowed = _null(gram[0], gram[1], FREE)
    motions = motions @ allowed
    if motions.shape[1] == 0:
        return 0
    own = free.taken(motions)
    work = own.T @ free.taken(force(parity, motions))
    square = own.T @ algebra.multiply(mass, own)
    work, square = comm.allreduce(np.array([work, square]))
    return _null(work, square, FREE * scale(plate)).shape[1]


def _null(form: np.ndarray, square: np.ndarray, least: float) -> np.ndarray:
    """Combinations (n, m) in which a form is less than a part of another, definite one."""
    root = np.linalg.inv(np.linalg.cholesky(square))
    values, vectors = np.linalg.eigh(root @ form @ root.T)
    return np.asarray(root.T @ vectors[:, np.abs(values) < least])
