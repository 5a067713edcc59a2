"""Models near that of a scene, to first order in its numbers; and what follows from them.

Quantities that are no entries of arrays, such as effective coefficients, are explicit functions of
these: their derivatives are differences of fourth order, whose error is far below round-off's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.rom import quantities
from nanorom.rom.model import ReducedModel
from nanorom.rom.quantities import Arrays
from nanorom.scene.scene import Scene
from nanorom.types import Array

STEP = 1e-3  # of ln(key), of which the fourth power is the error


@attrs.frozen(eq=False)
class Near:
    """Arrays of a flat scene's model, their derivatives by ln(key) of its numbers, its modes."""

    scene: Scene
    value: Arrays
    slopes: Mapping[str, Arrays]
    label: tuple[str, ...]
    number: tuple[int, ...]

    def model(self, key: str = "", change: float = 0.0) -> ReducedModel:
        """The model where ln(key) is larger by a change; without damping."""
        slope, size = self.slopes.get(key), len(self.label)

        def moved(pick: Any) -> Any:
            own = pick(self.value)
            return own if slope is None else own + change * pick(slope)

        return ReducedModel(
            frequency=moved(lambda a: a.frequency),
            mass=moved(lambda a: a.mass),
            label=self.label,
            number=np.array(self.number),
            damping=np.zeros((size, size)),  # that of the scene takes its place
            stiffness=moved(lambda a: a.stiffness),
            quadratic=np.zeros((size,) * 3),
            cubic=moved(lambda a: a.cubic),
            drive={name: moved(lambda a, n=name: a.drive[n]) for name in self.value.drive},
            parametric={
                name: moved(lambda a, n=name: a.parametric[n]) for name in self.value.parametric
            },
            scene=self.scene.to_toml(),
        )

    def quantity(self, name: str) -> tuple[float, str, tuple[float, ...]]:
        """Value and unit of a quantity, and its derivatives by ln(key); raises ModelError."""
        if self.scene.lossy:
            raise ModelError(f"of: {name} has no derivatives beside losses of the film")
        damping = self.scene.damping

        def model(key: str, change: float) -> ReducedModel:
            found = self.model(key, change)
            return found if damping is None else found.with_damping(damping)

        def at(key: str) -> Callable[[float], Array]:
            return lambda change: np.array(
                quantities.value(name, model(key, change), self.label)[0]
            )

        value, unit = quantities.value(name, model("", 0.0), self.label)
        slopes = (float(difference(at(key))) for key in self.slopes)
        return value, unit, tuple(slopes)


def difference(function: Callable[[float], Array]) -> Array:
    """The derivative at 0 of an explicit function, by differences of fourth order."""

    def of(step: float) -> Array:
        return np.asarray((function(step) - function(-step)) / (2 * step))

    return np.asarray((4 * of(STEP) - of(2 * STEP)) / 3)
