"""Self-excited oscillations: limit cycles without a drive, from Hopf points of the state at rest.

The period is unknown, and so is where on the orbit time begins: one coordinate begins at its
turning point. Source: Kuznetsov, Elements of Applied Bifurcation Theory, section 10.2.2 (starting
at a Hopf point).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nanorom.continuation.curves.conditioned import (
    OrbitCurve,
    Phase,
    PhasedCurve,
    orbit_curve,
    within,
)
from nanorom.continuation.curves.curve import Point
from nanorom.continuation.curves.parameter import Given, Parameter, parameter_of
from nanorom.continuation.curves.rest import RestPoint
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

FIRST_AMPLITUDE = 1e-3  # in scaled units: still linear
FIRST_HARMONICS = 3


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
        Its `omega` is the motion's own. One multiplier, along the motion, is 1.

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
    curve = PhasedCurve.along(line, phase, first.rate, level, at, tolerance, least)
    points = curve.follow(first, 1.0, steps, largest_step, direction)
    return orbit_curve(line, within(points, level, line.size), 1, free=True)


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
