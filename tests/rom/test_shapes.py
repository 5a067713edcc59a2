"""Mode shapes between the points at which they are kept."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.errors import ModelError
from nanorom.rom.shapes import Shapes
from tests.conftest import square_shapes


def test_values_between_points_are_those_of_a_plane():
    grid = square_shapes(np.random.default_rng(0), 1)
    plane = np.stack([grid.points[:, 0], 1e-6 - 2 * grid.points[:, 1]]) * 1e6
    shapes = Shapes(grid.points, grid.cells, plane)
    for x, y in np.random.default_rng(1).uniform(0, 1, (20, 2)):
        assert shapes.at((x * 1e-6, y * 1e-6)) == pytest.approx([x, 1 - 2 * y], abs=1e-12)
    with pytest.raises(ModelError, match="is not on the film"):
        shapes.at((2e-6, 0.0))
    with pytest.raises(ModelError, match="position: found"):
        shapes.at((0.0,))
