"""Members in time: their starts, and whole periods of the drive to a tolerance.

All members make the same steps of the drive's angle, as short as the one that needs the shortest;
a stretch of which a member's error is above the tolerance is done again for that member.
"""

from __future__ import annotations

import os

import attrs
import numpy as np

from nanorom.continuation.ensemble.equations import Equations, equations_of
from nanorom.continuation.ensemble.runge_kutta import (
    Advance,
    Stretch,
    by_arrays,
    compiled,
)
from nanorom.continuation.sweep import DISTURBANCE
from nanorom.continuation.system import ModalSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

ANGLE = 1.2  # of the fastest mode in a step, to begin with
ORDER = 8  # by which the error of a step falls with its length
SAFE = 1.1  # times as many steps as the order asks for
EASY = 0.05  # of the tolerance, below which steps may be longer
MOST_GROWTH = 3.0  # of the number of steps at once
LEAST_STEPS, MOST_STEPS = 8, 4096  # of a period of the drive
MOST_NUMBERS = 250_000_000  # kept of all members, 2 GB
ENGINES = ("auto", "compiled", "arrays")


@attrs.define(eq=False)
class Ensemble:
    """Members of one system at levels of their own; their states are scaled, (T + 1, 2L, B) with T
    tangents, at phase 0 of the drive.
    """

    equations: Equations
    tolerance: float
    advance: Advance
    steps: int = LEAST_STEPS  # of a period, for what is next

    def begin(self, lowest: float) -> None:
        """Steps for a lowest drive frequency, scaled; the errors say later what they should be."""
        self.steps = self._at_least(2 * np.pi * self.equations.scaled.fastest / lowest / ANGLE)

    def _at_least(self, steps: float) -> int:
        return int(np.clip(np.ceil(steps), LEAST_STEPS, MOST_STEPS))

    def run(
        self, states: Array, members: Numbers, omega: Array, periods: int, samples: int
    ) -> tuple[Array, Array, Numbers]:
        """States (T + 1, 2L, b) of some members (b,) after `periods` of their drive of scaled
        frequency (b,), `samples` (n, 2L, b) at equal distances on the way, the last at the end,
        and which of them have left all bounds (b,).

        Raises ContinuationError where even the shortest steps do not do.
        """
        found = np.empty_like(states)
        kept = np.empty((samples, *states.shape[1:]))
        left = np.zeros(len(members), dtype=bool)
        todo, needed, per_period = np.arange(len(members)), 0, self.steps
        while len(todo):
            stretch = self._stretch(periods, samples, per_period)
            trial = np.ascontiguousarray(states[..., todo])
            equations = self.equations.of(members[todo])
            there, errors = self.advance(equations, trial, 1 / omega[todo], stretch)
            good = errors <= self.tolerance
            shortest = stretch.per_period >= MOST_STEPS
            gone = ~good & (shortest & ~np.isfinite(errors))
            if (shortest & ~good & ~gone).any():
                raise ContinuationError(
                    f"time integration: more than {MOST_STEPS} steps of a period are needed at "
                    f"omega = {omega[todo][~good][0] * self.equations.scaled.frequency:.6g}"
                )
            done = good | gone
            found[..., todo[done]], kept[..., todo[done]] = trial[..., done], there[..., done]
            left[todo[done]] = gone[done]
            if good.any():  # what leaves all bounds says nothing of the others' steps
                needed = stretch.per_period
            per_period = self._better(stretch.per_period, float(errors.max()))
            if good.all() and len(todo) == len(members):
                needed = min(needed, per_period)
            todo = todo[~done]
        self.steps = needed or self.steps
        return found, kept, left

    def _stretch(self, periods: int, samples: int, steps: int) -> Stretch:
        """At least so many steps of a period, and whole numbers between samples."""
        between = -(-periods * steps // samples)
        while (between * samples) % periods:
            between += 1
        return Stretch(between * samples // periods, samples, between)

    def _better(self, steps: int, error: float) -> int:
        """Steps of a period by the largest error of so many: more, or fewer where they are easy."""
        ratio = error / self.tolerance
        if EASY <= ratio <= 1:
            return steps
        factor = SAFE * ratio ** (1 / ORDER) if np.isfinite(ratio) else MOST_GROWTH
        return self._at_least(steps * min(max(factor, 0.5), MOST_GROWTH))


@attrs.frozen(eq=False)
class Members:
    """What members (B,) are: levels, drive frequencies (B, n) in the order of their sweeps and
    states (B, 2L), in the user's units.
    """

    direct: Array
    parametric: Array
    omega: Array
    states: Array


def members_of(
    system: ModalSystem, omega: object, direct: object, parametric: object, state: object
) -> Members:
    """Members by broadcasting: omega (n,) or (B, n), levels number or (B,), state (2L,) or
    (B, 2L), or None for a small disturbance of rest.

    Raises ContinuationError for what is not finite, or of other numbers of members.
    """
    size = 2 * (system.size + (system.states.size if system.states else 0))
    frequencies = _finite(omega, "omega", (1, 2), "frequencies as (n,) or (B, n)")
    if not frequencies.size or not np.all(frequencies > 0):
        raise ContinuationError("omega: give the frequencies of the sweep as positive numbers")
    levels = [
        _finite(value, name, (0, 1), "a level or (B,) levels")
        for name, value in (("direct", direct), ("parametric", parametric))
    ]
    if state is None:
        unit = system.scaled(*(float(np.abs(level).max()) for level in levels))
        state = unit.given_states(np.full(size, DISTURBANCE))
    states = _finite(state, "state", (1, 2), f"(q, dq/dt) as {size} numbers, or (B, {size})")
    if states.shape[-1] != size:
        raise ContinuationError(
            f"state: found {states.shape[-1]} numbers; give (q, dq/dt) as {size} finite numbers"
        )
    shapes = (frequencies.shape[:-1], *(level.shape for level in levels), states.shape[:-1])
    try:
        (count,) = np.broadcast_shapes((1,), *shapes)
    except ValueError:
        told = ", ".join(str(shape[0]) for shape in shapes if shape)
        raise ContinuationError(
            f"omega, direct, parametric, state: found {told} members; allowed one number of them"
        ) from None
    length = frequencies.shape[-1]
    if count * length * 2 * size > MOST_NUMBERS:
        raise ContinuationError(
            f"omega: found {count} members at {length} frequencies, {2 * size} numbers each; "
            f"allowed {MOST_NUMBERS} numbers; give fewer members at once"
        )
    direct, parametric = (np.broadcast_to(level, count) for level in levels)
    return Members(
        direct,
        parametric,
        np.broadcast_to(frequencies, (count, length)),
        np.broadcast_to(states, (count, size)),
    )


def ensemble_of(
    system: ModalSystem, members: Members, tolerance: float, engine: str, workers: int | None
) -> Ensemble:
    """The ensemble of members; engine: one of `ENGINES`; workers: threads of the compiled one, as
    many as there are processors if left out.

    Raises ContinuationError for an engine that is not there, and for levels that do not do.
    """
    if not 1e-13 <= tolerance <= 1e-2:
        raise ContinuationError(f"tolerance: found {tolerance!r}; allowed 1e-13 to 1e-2")
    if engine not in ENGINES:
        raise ContinuationError(f"engine: found {engine!r}; allowed {', '.join(ENGINES)}")
    if workers is None:
        workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    kernel = compiled(max(1, int(workers))) if engine != "arrays" else None
    if kernel is None and engine == "compiled":
        raise ContinuationError(
            "engine: found no C compiler that works; install gcc or pip install ziglang, or "
            "leave engine out"
        )
    equations = equations_of(system, members.direct, members.parametric)
    result = Ensemble(equations, tolerance, kernel or by_arrays)
    result.begin(float(members.omega.min()) / equations.scaled.frequency)
    return result


def _finite(value: object, name: str, dimensions: tuple[int, ...], allowed: str) -> Array:
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ContinuationError(f"{name}: found {value!r}; allowed {allowed}") from None
    if found.ndim not in dimensions or not np.all(np.isfinite(found)):
        raise ContinuationError(
            f"{name}: found an array of shape {found.shape}; give {allowed}, all finite numbers"
        )
    return found
