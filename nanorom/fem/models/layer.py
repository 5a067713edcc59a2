"""The edge layer sqrt(D/T) in which a clamped film bends, and whether a mesh can see it.

Where nodes are farther apart than the layer is wide, a solution is smooth without it: what is
missing leaves no trace in the solution's decay, from which errors are estimated otherwise.
"""

from __future__ import annotations

import numpy as np

from nanorom.errors import SolverError
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import compat
from nanorom.scene.units import with_unit

SEEN = 5.0  # layers between nodes up to which the estimate from the decay is right to a factor of 2
MOST = 1e-3  # relative effect of an unseen layer on frequencies that is refused, unless stated


def unseen(plate: Plate, width: float, length: float, tolerance: float | None) -> float:
    """Relative effect on frequencies of a layer that the mesh does not see; 0 if it does.

    width : of the layer, in units of ``length`` (m).  A clamped film vibrates as if it were
    shorter by the layer at its edge: to first order by the layer times half the edge's length per
    area.  Raises SolverError where that is more than the tolerance and `MOST`.  Collective.
    """
    if not plate.bending:
        return 0.0
    mesh, comm = plate.domain.mesh, plate.domain.comm
    vertices = mesh.geometry.x[compat.cell_nodes(mesh)[:, :3], :2]
    sides = vertices[:, 1:] - vertices[:, :1]
    areas = 0.5 * np.abs(np.linalg.det(sides))
    facets = plate.clamped[plate.clamped < mesh.topology.index_map(1).size_local]
    ends = mesh.geometry.x[compat.facet_vertices(mesh, facets), :2]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    apart = 2 * areas[compat.cells_at(mesh, facets)] / lengths / plate.degree
    widest = max(comm.allgather(apart.max(initial=0.0)))
    owned = mesh.topology.index_map(2).size_local
    edge, area = comm.allreduce(np.array([lengths.sum(), areas[:owned].sum()]))
    if widest <= SEEN * width:
        return 0.0
    effect = float(width * edge / (2 * area))
    if effect > max(MOST, tolerance or 0.0):
        layer, apart, highest = (
            with_unit(each * length, "m", 3) for each in (width, widest, plate.degree * width)
        )
        raise SolverError(
            f"the mesh does not resolve the edge layer sqrt(D/T) = {layer}: its nodes at the "
            f"clamped edge are {apart} apart, and frequencies would be wrong by up to "
            f"{effect:.1e}; make the cells there at most {highest} high, or leave the mesh to "
            "the program"
        )
    return effect
