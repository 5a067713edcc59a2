"""A force at a point."""

from __future__ import annotations

import attrs

from nanorom.scene.patterns.pattern import Concentrated


@attrs.frozen
class Point(Concentrated):
    """A force at ``position``, (x, y) in m; its level is the amplitude in N."""

    name = "point"
    unit = "N"
