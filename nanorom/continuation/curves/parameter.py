"""A parameter of a system: levels of a drive, factors on arrays, or the way to another system."""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from nanorom.continuation.orbits.coordinates import with_symmetries
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import LEVELS, TENSORS, ModalSystem
from nanorom.errors import ContinuationError

Given = str | Mapping[str, object] | ModalSystem


@attrs.frozen(eq=False)
class Parameter:
    """The scaled equations origin + (level / size) change.

    name: of the parameter; unit: the equations whose coordinates and units those are; size: the
    level of the user at which the scaled one is 1.
    """

    name: str
    unit: ScaledSystem
    origin: ScaledSystem
    change: ScaledSystem
    size: float

    def at(self, level: float) -> ScaledSystem:
        """The equations at a scaled level."""
        return self.origin.plus(self.change, level)


def parameter_of(
    system: ModalSystem,
    given: Given,
    span: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
) -> Parameter:
    """What is varied, over a range of levels.

    given : "direct" or "parametric", a level; the name of another array, a factor on it; arrays by
        name that are added `level` times; or a system, which is reached at level 1, from the first
        one at level 0
    direct, parametric : the levels otherwise

    Raises ContinuationError for another parameter or a range that is not rising and finite.
    """
    if not (np.isfinite(span).all() and span[0] < span[1]):
        raise ContinuationError(f"level: found {span}; allowed a rising range (low, high)")
    size = float(max(abs(value) for value in span))
    if isinstance(given, ModalSystem):
        unit = with_symmetries(given.scaled(direct, parametric))
        back = given.towards(system, unit, direct, parametric)
        name, start, change = "system", 1.0, back.times(-1.0)
    elif isinstance(given, Mapping):
        unit = with_symmetries(system.scaled(direct, parametric))
        name, start, change = ", ".join(given), 0.0, system.change(given, unit)
    elif given in LEVELS:
        system.check_proportional()
        levels = {"direct": direct, "parametric": parametric, given: size}
        unit = with_symmetries(system.scaled(**levels))
        name, start = given, size
        change = system.change({given: system.arrays()[given]}, unit)
    elif given in TENSORS:
        unit = with_symmetries(system.scaled(direct, parametric))
        name, start = given, 1.0
        change = system.change({given: getattr(system, given)}, unit)
    else:
        known = ", ".join((*LEVELS, *TENSORS))
        raise ContinuationError(f"parameter: found {given!r}; allowed {known}, arrays or a system")
    change = change.times(size)
    return Parameter(name, unit, unit.plus(change, -start / size), change, size)
