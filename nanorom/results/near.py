"""Models near that of a scene, by its numbers; and what follows from them.

Quantities that are no entries of arrays, such as effective coefficients, are explicit functions of
these: their derivatives are differences of fourth order, whose error is far below round-off's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.files import schema
from nanorom.rom import quantities
from nanorom.rom.model import ReducedModel
from nanorom.rom.names import index_of
from nanorom.rom.quantities import Arrays
from nanorom.scene.scene import Scene
from nanorom.types import Array

STEP = 1e-3  # of ln(key), of which the fourth power is the error
APART = 5e-3  # of ln(key), between neighbours: meshes leave 1e-8 of what changes by as much
PLACES = (-2, -1, 1, 2)  # of neighbours, in steps
DRAWN = ("shapes", "larger")  # of a model, which no quantity asks for

Line = Callable[[float], ReducedModel]  # the model where ln(key) is larger by a change


@attrs.frozen(eq=False)
class Named:
    """A number of a model or a response: its value, its unit, and d value / d ln(key) by line."""

    value: float
    unit: str
    slope: tuple[float, ...]


class Near(Protocol):
    """A scene's model and those near it.

    keys: of the scene; lines: one by key, and where these are not exact another one by key, whose
    difference from the first tells their error.
    """

    @property
    def scene(self) -> Scene: ...  # noqa: D102
    @property
    def exact(self) -> bool: ...  # noqa: D102
    @property
    def keys(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def lines(self) -> Sequence[Line]: ...  # noqa: D102
    @property
    def model(self) -> ReducedModel: ...  # noqa: D102

    def quantity(self, name: str) -> Named:
        """Of a name, with its derivatives; raises ModelError."""
        ...


@attrs.frozen(eq=False)
class Tangent:
    """Arrays of a flat scene's model, their exact derivatives by ln(key) of its numbers, its modes.

    Its models have no damping.
    """

    scene: Scene
    value: Arrays
    slopes: Mapping[str, Arrays]
    label: tuple[str, ...]
    number: tuple[int, ...]
    exact: bool = True

    @property
    def keys(self) -> tuple[str, ...]:
        """Of the scene."""
        return tuple(self.slopes)

    @property
    def lines(self) -> Sequence[Line]:
        """By key."""
        return [partial(self._moved, key) for key in self.slopes]

    @property
    def model(self) -> ReducedModel:
        """That of the scene."""
        return self._moved("", 0.0)

    def quantity(self, name: str) -> Named:
        """Of a name: linear in arrays, or an explicit function of them; raises ModelError."""
        if not quantities.linear(name, self.label):
            if self.scene.lossy:
                raise ModelError(f"of: {name} has no derivatives beside losses of the film")
            return _of_models(name, self)
        slopes = (
            quantities.slope(name, self.value, change, self.label)
            for change in self.slopes.values()
        )
        return Named(*quantities.value(name, self.value, self.label), tuple(slopes))

    def _moved(self, key: str, change: float) -> ReducedModel:
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


@attrs.frozen(eq=False)
class Neighbours:
    """A scene's model and reduced ones beside it, between which all arrays are interpolated.

    beside: by key of the scene, models at `PLACES` of its logarithm, in steps of `APART`.  Lines
    take all of them, and a second time all but the last.  Raises ModelError where a neighbour
    has other modes.
    """

    scene: Scene
    model: ReducedModel
    beside: Mapping[str, Sequence[ReducedModel]]
    exact: bool = False
    _parts: Mapping[str, Sequence[Mapping[str, Any]]] = attrs.field(init=False)

    @_parts.default
    def _in_order(self) -> dict[str, list[dict[str, Any]]]:
        return {
            key: [self._alike(key, other) for other in models]
            for key, models in self.beside.items()
        }

    @property
    def keys(self) -> tuple[str, ...]:
        """Of the scene."""
        return tuple(self.beside)

    @property
    def lines(self) -> Sequence[Line]:
        """By key, through all neighbours, then through all but the last."""
        return [
            partial(self._between, key, some)
            for some in ((0, 1, 2, 3), (0, 1, 2))
            for key in self.beside
        ]

    def quantity(self, name: str) -> Named:
        """Of a name, an explicit function of the model; raises ModelError."""
        return _of_models(name, self)

    def _alike(self, key: str, other: ReducedModel) -> dict[str, Any]:
        """What another model is made of, its modes in the order of this one's names."""
        places = [index_of(other.label, name) for name in self.model.label]
        if None in places or len(other.label) != len(places):
            raise ModelError(
                f"by: {key} changes which modes there are, {', '.join(other.label)} for "
                f"{', '.join(self.model.label)}; ask for more modes"
            )
        return _arrays(other, [place for place in places if place is not None])

    def _between(self, key: str, some: Sequence[int], change: float) -> ReducedModel:
        places = np.array([0.0, *(PLACES[i] for i in some)])
        weights = _lagrange(places, change / APART)
        own = _arrays(self.model, range(self.model.size))
        parts = [own, *(self._parts[key][i] for i in some)]
        mixed = {name: _mixed(weights, [part[name] for part in parts]) for name in own}
        return attrs.evolve(self.model, **dict.fromkeys(DRAWN), **mixed)


def _arrays(model: ReducedModel, places: Sequence[int]) -> dict[str, Any]:
    """What some modes of a model are made of, and numbers of the state that they are about."""
    found = schema.picked(model, "L", places)
    found = {name: own for name, own in found.items() if name not in (*DRAWN, "label", "number")}
    return found | {"static": {name: a for name, a in model.static.items() if a.ndim == 0}}


def _lagrange(places: Array, at: float) -> Array:
    """Weights (n,) of values at some places, for the polynomial through them at another."""
    apart = places[:, None] - places
    np.fill_diagonal(apart, 1.0)
    above = np.where(np.eye(len(places), dtype=bool), 1.0, at - places)
    return np.asarray(above.prod(axis=1) / apart.prod(axis=1))


def _mixed(weights: Array, parts: Sequence[Any]) -> Any:
    """Sums of arrays, and of what holds arrays; of words and numbers of modes, the first."""
    first = parts[0]
    if isinstance(first, np.ndarray) and first.dtype.kind == "f":
        return np.tensordot(weights, np.array(parts), axes=1)
    if isinstance(first, Mapping):
        return {name: _mixed(weights, [part[name] for part in parts]) for name in first}
    if attrs.has(type(first)):
        names = [field.name for field in attrs.fields(type(first))]
        own = {n: _mixed(weights, [getattr(part, n) for part in parts]) for n in names}
        return attrs.evolve(first, **own)
    return first


def _of_models(name: str, near: Near) -> Named:
    """A quantity of models, damped as the scene says."""
    damping, label = near.scene.damping, near.model.label

    def at(model: ReducedModel) -> tuple[float, str]:
        damped = model if damping is None else model.with_damping(damping)
        return quantities.value(name, damped, label)

    def along(line: Line) -> float:
        return float(difference(lambda change: np.array(at(line(change))[0])))

    return Named(*at(near.model), tuple(map(along, near.lines)))


def difference(function: Callable[[float], Array]) -> Array:
    """The derivative at 0 of an explicit function, by differences of fourth order."""

    def of(step: float) -> Array:
        return np.asarray((function(step) - function(-step)) / (2 * step))

    return np.asarray((4 * of(STEP) - of(2 * STEP)) / 3)
