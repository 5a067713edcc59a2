"""Drive patterns: one file for each, and the tables by which everything else finds them."""

from nanorom.scene.patterns.modulation import PaperModulation, TensionModulation
from nanorom.scene.patterns.pattern import DirectPattern, ParametricPattern
from nanorom.scene.patterns.point import Point
from nanorom.scene.patterns.pressure import Pressure
from nanorom.scene.patterns.spot import Spot

_DIRECT: tuple[type[DirectPattern], ...] = (Pressure, Spot, Point)
_PARAMETRIC: tuple[type[ParametricPattern], ...] = (TensionModulation, PaperModulation)

DIRECT = {kind.name: kind for kind in _DIRECT}
PARAMETRIC = {kind.name: kind for kind in _PARAMETRIC}
AIMS = tuple(dict.fromkeys(key for kind in _DIRECT for key in kind.keys()))
"""Keys of [drive] that one pattern or another needs beside its level."""
