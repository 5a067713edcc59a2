"""Mode shapes on a triangulation."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import ModelError
from nanorom.rom.arrays import as_array, as_integers, expect
from nanorom.types import Array


@attrs.frozen(eq=False)
class Shapes:
    """Mode shapes on a triangulation, to draw them and to rebuild the moving film.

    points: (P, 3) in m; cells: (C, 3) point numbers; values: (L, P), max |phi| = 1.
    """

    points: Array = attrs.field(converter=as_array)
    cells: NDArray[np.int64] = attrs.field(converter=as_integers)
    values: Array = attrs.field(converter=as_array)

    def __attrs_post_init__(self) -> None:
        n_points = len(self.points)
        expect("shapes/points", self.points, (n_points, 3))
        expect("shapes/cells", self.cells, (len(self.cells), 3))
        expect("shapes/values", self.values, (len(self.values), n_points))
        if self.cells.size and not 0 <= self.cells.min() <= self.cells.max() < n_points:
            raise ModelError(f"shapes/cells: point numbers outside 0 ... {n_points - 1}")
