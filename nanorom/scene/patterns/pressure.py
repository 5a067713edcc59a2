"""A uniform pressure."""

from __future__ import annotations

import attrs

from nanorom.scene.patterns.pattern import Uniform


@attrs.frozen
class Pressure(Uniform):
    """The same pressure everywhere; its level is the amplitude in Pa."""

    name = "pressure"
    unit = "Pa"
