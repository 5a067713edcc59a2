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


FACTORS = {"direct": ("direct",), "parametric": ("parametric",), "both": LEVELS}


def parameter_of(
    system: ModalSystem,
    given: Given,
    span: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
) -> Parameter:
    """What is varied, over a range of levels.

    given : "direct" or "parametric", a level, or "both", a factor on both; the name of another
        array, a factor on it; arrays by name that are added `level` times; or a system, which is
        reached at level 1, from the first one at level 0
    direct, parametric : the levels otherwise

    Raises ContinuationError for another parameter or a range that is not rising and finite.
    """
    if not (np.isfinite(span).all() and span[0] < span[1]):
        raise ContinuationError(f"level: found {span}; allowed a rising range (low, high)")
    size = float(max(abs(value) for value in span))
    if isinstance(given, ModalSystem):
        unit = with_symmetries(given.scaled(direct, parametric))
        change = given.towards(system, unit, direct, parametric).times(-size)
        return Parameter("system", unit, unit.plus(change, -1.0 / size), change, size)
    levels = {"direct": direct, "parametric": parametric}
    if isinstance(given, str) and given in LEVELS:
        levels[given] = size
    return through(system, given, levels, size)[0]


def through(
    system: ModalSystem,
    given: str | Mapping[str, object],
    levels: Mapping[str, float],
    size: float = 0.0,
) -> tuple[Parameter, float]:
    """What is varied about the equations at levels, in whose coordinates it is, and its value
    there; size: the unit of its steps, that value itself if left out.

    Raises ContinuationError for what is no parameter, or is zero there.
    """
    unit = with_symmetries(system.scaled(**levels))
    added, start = _arrays(system, given, levels)
    size = size or abs(start)
    change = system.change(added, unit).times(size)
    name = given if isinstance(given, str) else ", ".join(given)
    return Parameter(name, unit, unit.plus(change, -start / size), change, size), start


def _arrays(
    system: ModalSystem, given: str | Mapping[str, object], levels: Mapping[str, float]
) -> tuple[dict[str, object], float]:
    """Arrays of which the system has `level` times as much, and its level at given ones."""
    if not isinstance(given, str):
        return dict(given), 0.0
    if given in FACTORS:
        system.check_proportional()
        used = [name for name in FACTORS[given] if levels[name]]
        if not used:
            raise ContinuationError(f"parameter: the level of {given!r} is zero at the point")
        if given == "both":
            return {name: levels[name] * system.arrays()[name] for name in used}, 1.0
        return {given: system.arrays()[given]}, levels[given]
    if given not in TENSORS:
        known = ", ".join((*FACTORS, *TENSORS))
        raise ContinuationError(f"parameter: found {given!r}; allowed {known}, arrays or a system")
    if not getattr(system, given).any():
        raise ContinuationError(f"parameter: {given!r} is zero; give the array to be added")
    return {given: getattr(system, given)}, 1.0
