"""A film that is another one in some of its cells: what it resists with and weighs, as fields."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem

from nanorom.errors import SceneError
from nanorom.fem.fields import quadrature
from nanorom.fem.fields.surface import Surface
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.solvers import compat
from nanorom.scene import elasticity
from nanorom.scene.outlines import SurfaceRegion
from nanorom.scene.region import DrawnRegion, Region, Section
from nanorom.scene.units import with_unit

FOLLOWS = 1e-6  # relative error of a region's area in a mesh that follows its edges


@attrs.frozen(eq=False)
class Patchwork:
    """What a film is cell by cell, in the units of its stiffness.

    space : of one value per cell; which : (local cells,) number of the section, 0 the film itself;
    law, moments : (n, 3, 3) of the sections, by E h and D; mass : (n,) per area, by rho h; loss :
    (n,) of the bent film.
    """

    space: Any
    which: np.ndarray
    law: np.ndarray
    moments: np.ndarray
    mass: np.ndarray
    loss: np.ndarray

    @classmethod
    def of(
        cls, plate: Any, which: np.ndarray, sections: Sequence[Section], loss: float
    ) -> Patchwork:
        """Of a plate in so many sections beside itself; loss : of the film itself."""
        known = plate.stiffness
        return cls(
            space=compat.lagrange_space(plate.domain.mesh, 0),
            which=which,
            law=np.array([known.law, *(s.law for s in sections)]),
            moments=np.array([known.bending_law, *(s.moments for s in sections)]),
            mass=np.array([1.0, *(s.mass for s in sections)]),
            loss=np.array([loss, *(s.loss for s in sections)]),
        )

    @property
    def stiffest(self) -> np.ndarray:
        """(n,) of bending, by D along any direction."""
        return np.array([elasticity.stiffest(elasticity.as_law(law)) for law in self.moments])

    def field(self, values: np.ndarray) -> Any:
        """Function of a value (n,) per section."""
        function = fem.Function(self.space)
        function.x.array[compat.cell_dofs(self.space)[:, 0]] = values[self.which]
        return function

    def matrix(self, values: np.ndarray) -> Any:
        """UFL (3, 3) of symmetric matrices (n, 3, 3); an entry that none has is no coefficient."""
        found: dict[tuple[int, int], Any] = {}
        for i, j in zip(*np.triu_indices(3)):
            entry = values[:, i, j]
            found[i, j] = found[j, i] = self.field(entry) if np.any(entry) else 0
        return ufl.as_matrix([[found[i, j] for j in range(3)] for i in range(3)])

    def weighed(self, field: quadrature.CellFields, weights: np.ndarray) -> np.ndarray:
        """Weights (c, q, 1) of integration times the mass per area."""
        return weights * self.mass[self.which[field.cells]][:, None, None]


def located(
    plate: Surface, regions: Sequence[Region], length: float, found: str | None = None
) -> np.ndarray:
    """Which region (local cells,), counted from 1, holds each cell, 0 for none. Collective.

    length : the plate's unit of it in m; found : how messages begin.  Raises SceneError if a region
    has no cells or cells that it cuts, or two have one.
    """
    domain, owned = plate.domain, quadrature.owned_cells(plate)
    cells = np.arange(len(compat.cell_nodes(domain.mesh)))
    middle = length * quadrature.map_cells(plate, cells, np.full((1, 2), 1 / 3))[0][:, 0]
    areas, copies = length**2 * quadrature.areas(plate), plate.mirrors.copies
    which = np.zeros(len(cells), dtype=np.int32)
    for number, region in enumerate(regions, 1):
        name = found or f"region: found number {number}"
        if isinstance(region, SurfaceRegion):
            inside = _tagged(domain, region.surface, name)
        else:
            assert isinstance(region, DrawnRegion)
            inside = region.depth(middle) > 0
        taken = domain.comm.allreduce(int(np.count_nonzero(which[inside])))
        if taken:
            raise SceneError(
                f"{name}, a {region.shape} of which {taken} cells belong to another, too; "
                "allowed: regions that touch at most"
            )
        which[inside] = number
        area = copies * domain.comm.allreduce(float(areas[inside[:owned]].sum()))
        whole = area if region.area is None else region.area
        if area == 0 or abs(area / whole - 1) > FOLLOWS:
            raise SceneError(
                f"{name}, a {region.shape} of {with_unit(whole, 'm^2', 6)}, of which the "
                f"mesh has {with_unit(area, 'm^2', 6)}; allowed: on the film, its edge along "
                'those of cells: in a mesh file name it as a physical surface, shape = "surface"'
            )
    return which


def _tagged(domain: Domain, surface: str, name: str) -> np.ndarray:
    """Whether local cells (c,) are of a physical surface."""
    if surface not in domain.surfaces:
        known = ", ".join(sorted(domain.surfaces)) or "none, as it has no physical surfaces"
        raise SceneError(
            f"{name}, but the mesh has no physical surface '{surface}'; allowed: {known}"
        )
    return domain.surfaces[surface]
