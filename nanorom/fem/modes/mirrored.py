"""By which mirrors a surface that is meshed as a whole is its own image, and how its modes turn.

Found from what is there: nodes, static state and modes.  On a mesh without the mirror no node has
an image, and modes that are neither even nor odd show that something else lacks it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nanorom.fem.fields.surface import Surface
from nanorom.fem.symmetry import AXES, Parity

PLACED = 1e-9  # of the surface's size: how nearly nodes lie on the images of others
ALIKE = 1e-7  # of the largest value: how nearly an image has the value or its opposite


def parities(surface: Surface, state: np.ndarray, shapes: np.ndarray) -> list[Parity]:
    """Parities of n modes about the mirrors x and y that leave all of them as they are. Collective.

    state : (local dofs,) deflection of the state that they are about, which is even; shapes :
    (local dofs, n).  Mirrors pass through the middle of the surface.
    """
    space, comm = surface.deflections, surface.domain.comm
    owned = space.dofmap.index_map.size_local
    points = np.concatenate(comm.allgather(space.tabulate_dof_coordinates()[:owned]))
    columns = np.column_stack([state, shapes])[:owned]
    columns = np.concatenate(comm.allgather(columns))
    low, high = points.min(axis=0), points.max(axis=0)
    tree, size = cKDTree(points), (high - low).max()
    largest = np.maximum(np.abs(columns).max(axis=0), np.finfo(float).tiny)
    found: list[Parity] = [()] * shapes.shape[1]
    for axis in range(len(AXES)):
        images = points.copy()
        images[:, axis] = low[axis] + high[axis] - points[:, axis]
        away, image = tree.query(images)
        if away.max() > PLACED * size:
            continue
        signs = np.sign(np.einsum("ij,ij->j", columns, columns[image]))
        signs[0] = 1.0
        if (np.abs(columns[image] * signs - columns).max(axis=0) <= ALIKE * largest).all():
            found = [(*own, int(sign < 0)) for own, sign in zip(found, signs[1:])]
    return found
