"""The parameter along which a family of tori is followed: drive frequency or one of the levels."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import attrs
import numpy as np

from nanorom.continuation.arrays import finite
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import check_range
from nanorom.continuation.system import ModalSystem
from nanorom.errors import ContinuationError

NAMES = ("omega", "direct", "parametric")
Level = float | tuple[float, float]


@attrs.frozen(eq=False)
class Varied:
    """name: "omega", "direct" or "parametric"; unit: its value where the scaled parameter is 1;
    span: scaled; fixed: the other two in the user's units; system: the scaled equations (without
    the drive that is varied); equations: scaled parameter -> equations and drive frequency.
    """

    name: str
    unit: float
    span: tuple[float, float]
    fixed: Mapping[str, float]
    system: ScaledSystem
    equations: Callable[[float], tuple[ScaledSystem, float]]

    def scaled(self, value: float) -> float:
        return value / self.unit

    def holds(self, value: float) -> bool:
        return self.span[0] <= value / self.unit <= self.span[1]


def varied(system: ModalSystem, given: Mapping[str, Level]) -> Varied:
    """The one of omega, direct, parametric that is given as a range (low, high).

    Raises ContinuationError unless there is exactly one, rising and finite, beside finite levels.
    """
    ranges = {name: value for name, value in given.items() if isinstance(value, (tuple, list))}
    fixed = {name: value for name, value in given.items() if name not in ranges}
    if len(ranges) != 1:
        raise ContinuationError(
            f"{', '.join(NAMES)}: found {len(ranges)} ranges (low, high); allowed exactly one"
        )
    levels: dict[str, float] = {}
    for name, value in fixed.items():
        if not finite(value):
            raise ContinuationError(f"{name}: found {value!r}; allowed a finite number")
        levels[name] = float(value)  # type: ignore[arg-type]
    ((name, span),) = ranges.items()
    if name == "omega":
        return _frequency(system, check_range(span), levels)  # type: ignore[arg-type]
    return _level(system, name, rising(name, span), levels)


def _frequency(
    system: ModalSystem, span: tuple[float, float], levels: Mapping[str, float]
) -> Varied:
    scaled = system.scaled(levels["direct"], levels["parametric"])
    unit = scaled.frequency
    return Varied(
        "omega",
        unit,
        (span[0] / unit, span[1] / unit),
        levels,
        scaled,
        lambda parameter: (scaled, parameter),
    )


def _level(
    system: ModalSystem, name: str, span: tuple[float, float], levels: Mapping[str, float]
) -> Varied:
    system.check_proportional()
    scaled = system.scaled(levels.get("direct", 0.0), levels.get("parametric", 0.0))
    unit = max(abs(value) for value in span)
    change = system.change({name: system.arrays()[name]}, scaled).times(unit)
    rate = levels["omega"] / scaled.frequency
    return Varied(
        name,
        unit,
        (span[0] / unit, span[1] / unit),
        levels,
        scaled,
        lambda parameter: (scaled.plus(change, parameter), rate),
    )


def rising(name: str, value: object) -> tuple[float, float]:
    """A range as two floats; raises ContinuationError unless it is finite and rising."""
    try:
        low, high = (float(v) for v in value)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise ContinuationError(f"{name}: found {value!r}; allowed (low, high)") from None
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ContinuationError(f"{name}: found ({low:g}, {high:g}); allowed a rising finite range")
    return low, high
