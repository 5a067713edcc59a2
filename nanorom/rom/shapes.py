"""Mode shapes on a triangulation."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import ModelError
from nanorom.files import schema
from nanorom.files.layout import documented, shown
from nanorom.rom.arrays import as_array, as_integers
from nanorom.types import Array


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
