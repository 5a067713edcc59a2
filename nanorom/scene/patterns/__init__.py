"""Drive patterns: one file for each, and the tables by which everything else finds them."""

from typing import Any

import attrs

from nanorom.scene.patterns.gate import GateForce, GateStiffness
from nanorom.scene.patterns.laser import Laser
from nanorom.scene.patterns.modulation import PaperModulation, TensionModulation
from nanorom.scene.patterns.pattern import DirectPattern, ParametricPattern, Pattern
from nanorom.scene.patterns.point import Point
from nanorom.scene.patterns.pressure import Pressure
from nanorom.scene.patterns.shaking import Shaking
from nanorom.scene.patterns.spot import Spot
from nanorom.scene.patterns.wire import Wire

_DIRECT: tuple[type[DirectPattern], ...] = (
    Pressure,
    Spot,
    Point,
    Shaking,
    Wire,
    GateForce,
    Laser,
)
_PARAMETRIC: tuple[type[ParametricPattern], ...] = (
    TensionModulation,
    PaperModulation,
    GateStiffness,
)

DIRECT = {kind.name: kind for kind in _DIRECT}
PARAMETRIC = {kind.name: kind for kind in _PARAMETRIC}


def _keys(kinds: tuple[type[Pattern], ...]) -> dict[str, Any]:
    """Fields of [drive] that one pattern or another needs beside its level, by name.

    Raises TypeError for a key that is no field of a section, or that two declare differently.
    """
    found: dict[str, Any] = {}
    for kind in kinds:
        for field in attrs.fields(kind):
            first = found.setdefault(field.name, field.evolve(default=None))
            if "key" not in field.metadata or first.metadata != field.metadata:
                raise TypeError(f"{kind.__name__}.{field.name}: declare it as a key, once")
    return found


KEYS = _keys((*_DIRECT, *_PARAMETRIC))
