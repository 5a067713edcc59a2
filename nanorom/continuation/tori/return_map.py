"""The map of states over one period of the response, for a batch of states at once.

Time is crossed by Taylor series of high order (`TaylorStepper`). Where the equations and the orbit
from which a torus branches are symmetric, the map goes over half the period and turns the signs of
the modes: it has the same invariant curves at half the cost.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.continuation.orbits.flow import TaylorStepper
from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array

Equations = Callable[[float], tuple[ScaledSystem, float]]  # parameter -> equations, drive frequency
STEP_ANGLE = 1.5  # of the fastest mode within a Taylor step, to begin with
LAST_TERMS = 1e-14  # of the Taylor series, relative to the state
RATIO = 0.26  # of successive terms of a series of order 24 whose last are LAST_TERMS
LEAST_ORDER = 8


class ReturnMap:
    """States at drive phase 0 -> states a period of the response later.

    `angles` of the states on a curve matter only where a second drive gives them (`TwoToneMap`).
    """

    free = True  # the second angle is the motion's own

    def __init__(
        self, equations: Equations, period_multiple: int = 1, signs: Array | None = None
    ) -> None:
        self.equations, self.period_multiple, self.signs = equations, period_multiple, signs
        self._steps = 0
        self._stepper: tuple[float, TaylorStepper, float] | None = None

    @property
    def parts(self) -> int:
        """How many times the map is applied in one period of the response."""
        return 1 if self.signs is None else 2

    def duration(self, parameter: float) -> float:
        """Time the map takes."""
        return 2 * np.pi * self.period_multiple / self.parts / self.at(parameter)[1]

    def at(self, parameter: float) -> tuple[TaylorStepper, float]:
        if self._stepper is None or self._stepper[0] != parameter:
            system, omega = self.equations(parameter)
            self._stepper = parameter, TaylorStepper(system), omega
        return self._stepper[1:]

    def rotation(self, parameter: float) -> float | None:
        """The turn of the second angle where it is given: not here."""
        return None

    def __call__(self, states: Array, parameter: float, angles: Array | None = None) -> Array:
        """Images (n, 2L) of the states (n, 2L)."""
        return self._advance(states, parameter, False)[0]

    def with_tangent(
        self, states: Array, parameter: float, angles: Array | None = None
    ) -> tuple[Array, Array]:
        """Images (n, 2L) and their derivatives (n, 2L, 2L) by the states."""
        images, maps = self._advance(states, parameter, True)
        assert maps is not None
        return images, maps

    def samples(
        self, states: Array, parameter: float, count: int, angles: Array | None = None
    ) -> Array:
        """States (count, n, 2L) at `count` equidistant times of the whole period."""
        stepper, omega = self.at(parameter)
        duration = 2 * np.pi * self.period_multiple / omega / count
        # shorter steps than those of the map converge with fewer terms
        shorter = min(1.0, self._steps * self.parts / count)
        order = int(np.ceil(np.log(LAST_TERMS) / np.log(RATIO * shorter)))
        stepper = TaylorStepper(stepper.system, max(LEAST_ORDER, min(order, stepper.order)))
        result = [states]
        for i in range(count - 1):
            phase = np.full(len(states), omega * duration * i)
            rate, time = np.full(len(states), omega), np.full(len(states), duration)
            result.append(stepper.step(result[-1], rate, phase, time, variation=False)[0])
        return np.stack(result)

    def _advance(
        self, states: Array, parameter: float, variation: bool
    ) -> tuple[Array, Array | None]:
        stepper, omega = self.at(parameter)
        duration = 2 * np.pi * self.period_multiple / self.parts / omega
        least = max(2, int(np.ceil(duration * stepper.fastest / STEP_ANGLE)))
        self._steps = max(self._steps, least)
        while True:
            images, maps, error = self._cross(stepper, omega, states, duration, variation)
            if error < LAST_TERMS or not np.isfinite(error):
                break
            self._steps += max(1, self._steps // 5)
        if self.signs is not None:
            turn = np.tile(self.signs, 2)
            images = images * turn
            maps = None if maps is None else maps * turn[:, None]
        return images, maps

    def _cross(
        self,
        stepper: TaylorStepper,
        omega: float,
        states: Array,
        duration: float,
        variation: bool,
    ) -> tuple[Array, Array | None, float]:
        n, count = len(states), self._steps
        rate, time = np.full(n, omega), np.full(n, duration / count)
        total: Array | None = None
        worst = 0.0
        for i in range(count):
            phase = np.full(n, omega * duration * i / count)
            states, maps, error = stepper.step(states, rate, phase, time, variation)
            if maps is not None:
                total = maps if total is None else maps @ total
            worst = max(worst, error)
            if not worst < LAST_TERMS:
                break
        return states, total, worst
