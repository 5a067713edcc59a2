"""Self-excited oscillations: limit cycles without a drive, from Hopf points of the state at rest.

The period is unknown, and so is where on the orbit time begins: one coordinate begins at its
turning point. Source: Kuznetsov, Elements of Applied Bifurcation Theory, section 10.2.2 (starting
at a Hopf point).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import attrs
import numpy as np

from nanorom.continuation.curves.conditioned import (
    OrbitCurve,
    Phase,
    PhasedCurve,
    multipliers_of,
    orbit_curve,
    within,
)
from nanorom.continuation.curves.curve import Place, Point
from nanorom.continuation.curves.parameter import Given, Parameter, parameter_of
from nanorom.continuation.curves.rest import RestPoint
from nanorom.continuation.orbits.bifurcations import Kind, crossed
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

FIRST_AMPLITUDE = 1e-3  # in scaled units: still linear
FIRST_HARMONICS = 3
NEAR_CRITICAL = 1e-6  # of a multiplier, at a place that is located to 1e-9 of a step


@one_thread()
def limit_cycles(
    system: ModalSystem,
    point: RestPoint,
    level: tuple[float, float],
    parameter: Given = "direct",
    *,
    direct: float = 0.0,
    parametric: float = 0.0,
    at: Sequence[float] = (),
    tolerance: float = 1e-9,
    steps: int = 300,
    largest_step: float = 0.1,
) -> OrbitCurve:
    """Follow the limit cycles that begin at a Hopf point, until they leave the range or shrink to
    a state at rest.

    Parameters
    ----------
    system, parameter, direct, parametric : as for `rest_states`, which found the point
    point : RestPoint
        Of type "HB".
    level : (low, high) of the parameter, where to stop
    at : levels at which there are to be points
    tolerance : size of the last harmonics, relative to the orbit
    steps : most steps
    largest_step : arc length, relative to the size of the orbit, the frequency and the range

    Returns
    -------
    OrbitCurve
        Its `omega` is the motion's own. One multiplier, along the motion, is 1. Where the motion
        doubles its period or becomes a torus there are points, which `critical` tells; branches
        that leave it there, and branch points, are not looked for.

    Raises
    ------
    ContinuationError
        for another point, a range that does not hold it, or if no motion begins there.
    """
    if point.type != "HB":
        raise ContinuationError(f'point: found type {point.type!r}; allowed "HB", a Hopf point')
    if not level[0] <= point.level <= level[1]:
        raise ContinuationError(
            f"level: range ({level[0]:g}, {level[1]:g}) does not hold that of the point, "
            f"{point.level:g}"
        )
    line = parameter_of(system, parameter, level, direct, parametric)
    first, direction, largest = _first(line, point)
    phase = Phase(np.eye(line.unit.size)[largest], 1, 0.0)
    least = FIRST_AMPLITUDE / 2
    curve = _FreeMotions.along(line, phase, first.rate, level, at, tolerance, least)
    points = curve.follow(first, 1.0, steps, largest_step, direction)
    return orbit_curve(line, within(points, level, line.size), 1, free=True)


@attrs.define(eq=False, kw_only=True)
class _FreeMotions(PhasedCurve):
    """Limit cycles along a parameter, with points where they double or become tori."""

    _known: dict[bytes, Numbers] = attrs.field(factory=dict, init=False)

    def _between(self, here: Place, there: Place) -> list[Point]:
        balance = there.balance
        before = here if here.balance is balance else self._moved(here, balance)
        self._known = {key: self._known[key] for key in self._known if key == here.z.tobytes()}
        found = super()._between(here, there)
        for kind in crossed():
            if not kind.changes_motion:
                continue
            place = self._located(before, there, partial(self._test, kind))
            if place is not None and kind.distance(self._others(place)) < NEAR_CRITICAL:
                found.append(attrs.evolve(self._unpack(place), code=kind.code))
        if any(point.turn for point in found):  # in no order of their levels
            return found
        along = balance.basis.size + 1
        falling = bool(there.z[along] < before.z[along])
        return sorted(found, key=lambda point: point.level, reverse=falling)

    def _test(self, kind: Kind, place: Place) -> float:
        """Changes its sign at a bifurcation of a kind."""
        return kind.condition.crossing(self._others(place))

    def _others(self, place: Place) -> Numbers:
        """The multipliers (2L - 1,) beside that along the motion."""
        key = place.z.tobytes()
        if key not in self._known:
            point = self._unpack(place)
            system = self.origin.plus(self.change, point.level)
            values = multipliers_of(system, point, self.multiple)
            self._known[key] = np.delete(values, np.abs(values - 1).argmin())
        return self._known[key]


def _first(line: Parameter, point: RestPoint) -> tuple[Point, Array, int]:
    """A small motion next to the Hopf point, the direction in which it grows, and the coordinate
    that moves most.
    """
    unit = line.unit
    shape = unit.inner(point.shape.real) + 1j * unit.inner(point.shape.imag)
    largest = int(np.abs(shape).argmax())
    shape = shape / shape[largest]
    direction = np.zeros((2 * FIRST_HARMONICS + 1, unit.size))
    direction[1], direction[2] = shape.real, -shape.imag
    full = FIRST_AMPLITUDE * direction
    full[0] = unit.inner(point.state)
    first = Point(full, point.omega / unit.frequency, point.level / line.size)
    return first, direction, largest
