"""What `follow_torus` returns: tori and their bifurcations in the user's units."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from nanorom.continuation.tori.motion import QuasiPeriodic
from nanorom.types import Array

TORUS_POINTS = {
    "NS": "where the torus shrinks to a periodic orbit",
    "LP": "fold of tori",
    "PD": "torus doubling",
    "BP": "branch point of tori",
    "TR": "third frequency",
}


@attrs.frozen(eq=False)
class TorusState:
    """One torus of a family.

    parameter: what is varied, in the user's unit; omega: drive frequency; second: the second base
    frequency, rad per unit of time, modulo omega / period_multiple and sign; amplitude (L,) = max
    |q_r|; exponents (2L - 1,): growth rates of the normal directions, per unit of time, falling;
    residual: largest error of the invariance between the nodes, relative to the states; harmonics:
    of the second angle.
    """

    parameter: float
    omega: float
    second: float
    amplitude: Array
    exponents: Array
    residual: float
    harmonics: int
    motion: QuasiPeriodic = attrs.field(repr=False)

    @property
    def stable(self) -> bool:
        return bool(self.exponents[0] < 0)

    @property
    def rotation(self) -> float:
        """Turns of the second angle per period of the drive."""
        return self.second / self.omega


@attrs.frozen(eq=False)
class TorusPoint:
    """A bifurcation of tori: type is one of `TORUS_POINTS`."""

    type: str
    state: TorusState

    @property
    def omega(self) -> float:
        return self.state.omega

    @property
    def second(self) -> float:
        return self.state.second

    @property
    def amplitude(self) -> Array:
        return self.state.amplitude


@attrs.define(eq=False)
class Torus:
    """A family of tori in the order in which it was followed.

    omega, second, rotation, parameter (n,), amplitude (n, L), stable (n,), exponents (n, 2L - 1),
    residual (n,): see `TorusState`; varied: name of the parameter; ending: why it stops ("range",
    "bifurcation": it shrinks to a periodic orbit, "breakdown": the curve is no longer smooth,
    "steps").
    """

    states: list[TorusState] = attrs.field(repr=False)
    special_points: list[TorusPoint]
    period_multiple: int
    varied: str
    ending: str
    _at: Callable[[int, float], TorusState] = attrs.field(repr=False)

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, index: int) -> TorusState:
        return self.states[index]

    def _column(self, name: str) -> Array:
        return np.array([getattr(state, name) for state in self.states])

    @property
    def parameter(self) -> Array:
        return self._column("parameter")

    @property
    def omega(self) -> Array:
        return self._column("omega")

    @property
    def second(self) -> Array:
        return self._column("second")

    @property
    def rotation(self) -> Array:
        return self._column("rotation")

    @property
    def amplitude(self) -> Array:
        return self._column("amplitude")

    @property
    def stable(self) -> Array:
        return self._column("stable")

    @property
    def exponents(self) -> Array:
        return self._column("exponents")

    @property
    def residual(self) -> Array:
        return self._column("residual")

    def at(self, parameter: float) -> list[TorusState]:
        """The tori of the family at one value of the parameter, in order; empty where it has
        none.

        Raises ContinuationError where one of them cannot be corrected.
        """
        values = self.parameter
        passed = np.flatnonzero((values[:-1] - parameter) * (values[1:] - parameter) <= 0)
        return [self._at(int(index), float(parameter)) for index in passed]

    def points(self, kind: str | None = None) -> list[TorusPoint]:
        """Special points of one type, or all."""
        return [point for point in self.special_points if kind in (None, point.type)]
