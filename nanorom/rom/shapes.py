"""Mode shapes on a triangulation."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import ModelError
from nanorom.files import schema
from nanorom.files.layout import documented, shown
from nanorom.rom.arrays import as_array, as_integers
from nanorom.scene.units import place_with_unit
from nanorom.types import Array

FLAT = 0.1  # deflection of modes that move along the plane: Poisson's ratio leaves them some
OUTSIDE = 1e-9  # of a triangle: a point further out is not in it


@documented
@attrs.frozen(eq=False, repr=False)
class Shapes:
    """Mode shapes on a triangulation, to draw them and to rebuild the moving film.

    Raises ModelError if they do not fit together.
    """

    points: Array = attrs.field(
        converter=as_array, metadata=schema.array("P, 3", "m", "places on the film")
    )
    cells: NDArray[np.int64] = attrs.field(
        converter=as_integers,
        metadata=schema.array("C, 3", "", "triangles by the numbers of their points", kind="whole"),
    )
    values: Array = attrs.field(
        converter=as_array,
        metadata=schema.array("L, P", "1", "mode shapes phi, max |phi| = 1 between the points"),
    )

    def __repr__(self) -> str:
        return "\n".join(["Shapes", *shown(self)])

    def __attrs_post_init__(self) -> None:
        schema.check(self, "shapes")
        n_points = len(self.points)
        if self.cells.size and not 0 <= self.cells.min() <= self.cells.max() < n_points:
            raise ModelError(f"shapes/cells: point numbers outside 0 ... {n_points - 1}")

    @property
    def in_plane(self) -> NDArray[np.bool_]:
        """(L,) which modes hardly deflect the film: those of a solid that move along its plane."""
        return np.asarray(np.abs(self.values).max(axis=1, initial=0.0) < FLAT)

    def at(self, position: Sequence[float]) -> Array:
        """Values (L,) of the mode shapes at a point (x, y) of the film in m, linear on triangles.

        Raises ModelError for a point that is not on the film.
        """
        place = np.asarray(position, dtype=float)
        if place.shape != (2,) or not np.all(np.isfinite(place)):
            raise ModelError(f"position: found {position!r}; allowed x and y in m")
        corners = self.points[self.cells][:, :, :2]
        edges = corners[:, 1:] - corners[:, :1]
        area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
        gap = place - corners[:, 0]
        second = (gap[:, 0] * edges[:, 1, 1] - gap[:, 1] * edges[:, 1, 0]) / area
        third = (edges[:, 0, 0] * gap[:, 1] - edges[:, 0, 1] * gap[:, 0]) / area
        weights = np.stack([1 - second - third, second, third], axis=1)
        cell = int(weights.min(axis=1).argmax())
        if weights[cell].min() < -OUTSIDE:
            raise ModelError(f"position: {place_with_unit(place)} is not on the film")
        return np.asarray(self.values[:, self.cells[cell]] @ weights[cell])
