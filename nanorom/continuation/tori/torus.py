"""What `follow_torus` returns: tori and their bifurcations in the user's units."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.tori.motion import QuasiPeriodic
from nanorom.types import Array

TORUS_POINTS = {
    "NS": "where the torus shrinks to a periodic orbit",
    "LP": "fold of tori",
    "PD": "torus doubling",
    "BP": "branch point of tori",
    "TR": "third frequency",
}


@brief
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
        """Whether all normal directions decay."""
        return bool(self.exponents[0] < 0)

    @property
    def rotation(self) -> float:
        """Turns of the second angle per period of the drive, a ratio."""
        return self.second / self.omega


@brief
@attrs.frozen(eq=False)
class TorusPoint:
    """A bifurcation of tori: type is one of `TORUS_POINTS`."""

    type: str
    state: TorusState

    @property
    def omega(self) -> float:
        """Drive frequency in rad per unit of time."""
        return self.state.omega

    @property
    def second(self) -> float:
        """Second base frequency in rad per unit of time."""
        return self.state.second

    @property
    def amplitude(self) -> Array:
        """max |q_r| (L,) in the system's units."""
        return self.state.amplitude


@attrs.frozen(eq=False)
class ResonanceTongue:
    """An interval of the parameter in which the motion locks.

    ratio: p/q turns of the second angle per period of the response, so that q periods make one of
    the locked motion; low, high: ends of the interval, in the parameter's unit; locked: the locked
    orbit half way between them; stable: whether it is.
    """

    ratio: Fraction
    low: float
    high: float
    locked: PeriodicOrbit = attrs.field(repr=False)
    stable: bool

    @property
    def name(self) -> str:
        """p:q, as in "1:13"."""
        return f"{self.ratio.numerator}:{self.ratio.denominator}"

    @property
    def width(self) -> float:
        """high - low, in the unit of the parameter."""
        return self.high - self.low


@brief
@attrs.define(eq=False)
class Torus:
    """A family of tori in the order in which it was followed.

    omega, second, rotation, parameter (n,), amplitude (n, L), stable (n,), exponents (n, 2L - 1),
    residual (n,): see `TorusState`; tongues: where it locks, passed or at its end; missed: ratios,
    as of a tongue, at which it may lock but no locked orbits were found; varied: name of the
    parameter; ending: why it stops ("range", "bifurcation": it shrinks to a periodic orbit,
    "breakdown": the curve is no longer smooth, "steps"), at both ends if it has two.
    """

    states: list[TorusState] = attrs.field(repr=False)
    special_points: list[TorusPoint]
    tongues: list[ResonanceTongue]
    missed: list[Fraction]
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
        """What is varied (n,), in the user's unit."""
        return self._column("parameter")

    @property
    def omega(self) -> Array:
        """Drive frequency (n,) in rad per unit of time."""
        return self._column("omega")

    @property
    def second(self) -> Array:
        """Second base frequency (n,) in rad per unit of time."""
        return self._column("second")

    @property
    def rotation(self) -> Array:
        """Turns of the second angle per period of the drive (n,), a ratio."""
        return self._column("rotation")

    @property
    def amplitude(self) -> Array:
        """max |q_r| (n, L) in the system's units."""
        return self._column("amplitude")

    @property
    def stable(self) -> Array:
        """Whether all normal directions decay (n,), truth values without a unit."""
        return self._column("stable")

    @property
    def exponents(self) -> Array:
        """Growth rates (n, 2L - 1) of the normal directions per unit of time, falling."""
        return self._column("exponents")

    @property
    def residual(self) -> Array:
        """Largest error (n,) of the invariance between the nodes, relative to the states."""
        return self._column("residual")

    def at(self, parameter: float) -> list[TorusState]:
        """The tori of the family at one value of the parameter (in its unit), in order; empty
        where it has none.

        Raises ContinuationError where one of them cannot be corrected.
        """
        values = self.parameter
        passed = np.flatnonzero((values[:-1] - parameter) * (values[1:] - parameter) <= 0)
        return [self._at(int(index), float(parameter)) for index in passed]

    def points(self, kind: str | None = None) -> list[TorusPoint]:
        """Special points of one type, or all."""
        return [point for point in self.special_points if kind in (None, point.type)]
