"""Two drives at once: the response to two tones of any frequencies, their sidebands and mixing.

A tone is an undamped oscillator y'' + omega^2 y = 0 that is coupled to the modes one way: its state
(cos, -omega sin) of the tone's phase joins theirs, and the return map of the first tone's period
needs no other change. The second angle is then the phase of the second tone, which turns by a given
amount; otherwise the curves, their growth and their folds are those of a torus.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import attrs
import numpy as np

from nanorom.continuation.arrays import finite
from nanorom.continuation.branches.start import first_orbit
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.drive import CARRIER
from nanorom.continuation.orbits.harmonics import forced_support
from nanorom.continuation.orbits.orbit import Orbit, PeriodicOrbit, orbit_state
from nanorom.continuation.scaled import ARRAYS, DRIVEN, ScaledSystem
from nanorom.continuation.settings import Settings
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.continuation.tori.course import Course
from nanorom.continuation.tori.family import Family
from nanorom.continuation.tori.invariance import Curve, Direction
from nanorom.continuation.tori.parameter import Level, Varied, rising
from nanorom.continuation.tori.report import Report
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.continuation.tori.torus import Torus
from nanorom.errors import ContinuationError
from nanorom.types import Array

SAME_FREQUENCY = 1e-9


@attrs.frozen
class Tone:
    """A harmonic drive: (direct J + parametric P q) cos(omega t)."""

    omega: Level
    direct: Level = 0.0
    parametric: Level = 0.0


class TwoToneMap(ReturnMap):
    """The return map of the first tone for states at given phases of the second."""

    free = False

    def __init__(
        self,
        equations: Callable[[float], tuple[ScaledSystem, float]],
        second: Callable[[float], float],
        period_multiple: int,
    ) -> None:
        super().__init__(equations, period_multiple)
        self.second = second

    def rotation(self, parameter: float) -> float | None:
        return self.second(parameter) * self.duration(parameter)

    def __call__(self, states: Array, parameter: float, angles: Array | None = None) -> Array:
        images = super().__call__(self._joined(states, parameter, angles), parameter)
        return images[:, self._modal(images)]

    def with_tangent(
        self, states: Array, parameter: float, angles: Array | None = None
    ) -> tuple[Array, Array]:
        images, maps = super().with_tangent(self._joined(states, parameter, angles), parameter)
        modal = self._modal(images)
        return images[:, modal], maps[:, modal[:, None], modal]

    def samples(
        self, states: Array, parameter: float, count: int, angles: Array | None = None
    ) -> Array:
        everything = super().samples(self._joined(states, parameter, angles), parameter, count)
        return everything[:, :, self._modal(everything)]

    def _joined(self, states: Array, parameter: float, angles: Array | None) -> Array:
        assert angles is not None
        half = states.shape[1] // 2
        tone = np.cos(angles)[:, None], -self.second(parameter) * np.sin(angles)[:, None]
        return np.concatenate([states[:, :half], tone[0], states[:, half:], tone[1]], axis=1)

    def _modal(self, states: Array) -> Array:
        """Which columns belong to the modes."""
        half = states.shape[-1] // 2
        return np.delete(np.arange(2 * half), [half - 1, 2 * half - 1])


def with_tone(system: ScaledSystem, tone: ScaledSystem, omega: float) -> ScaledSystem:
    """The equations with an oscillator more, whose displacement cos(omega t) drives them with the
    force and the parametric pattern of `tone`.
    """
    size = system.size

    def padded(array: Array, axes: int) -> Array:
        return np.pad(array, [(0, 1)] * axes + [(0, 0)] * (array.ndim - axes))

    arrays = {}
    for name in ARRAYS:
        array = getattr(system, name)
        arrays[name] = padded(array, array.ndim - (name in DRIVEN))
    pattern = tone.parametric[..., CARRIER]
    arrays["stiffness"][:size, size] = -tone.force[:, CARRIER]
    arrays["stiffness"][size, size] = omega**2
    arrays["quadratic"][:size, :size, size] -= pattern / 2
    arrays["quadratic"][:size, size, :size] -= pattern / 2
    return replace(system, inertia=np.append(system.inertia, 1.0), shapes=None, **arrays)


@one_thread()
def two_tones(
    system: ModalSystem,
    first: Tone,
    second: Tone,
    orbit: PeriodicOrbit | None = None,
    *,
    tolerance: float = 1e-10,
    harmonics: int = 100,
    steps: int = 200,
) -> Torus:
    """The response to two tones while the frequency or a level of the second one varies.

    Parameters
    ----------
    system : ModalSystem
    first : Tone
        The first drive, all numbers.
    second : Tone
        The second drive; one of its values is a range (low, high), which is followed from low to
        high and beyond folds. Where that is a level, the tone is raised from zero to `low` first;
        where it is the frequency, at `low`.
    orbit : PeriodicOrbit, optional
        The response to the first drive alone to start from; that from rest if left out.
    tolerance, harmonics, steps : as of `follow_torus`

    Returns
    -------
    Torus
        `second` is the frequency of the second tone, `parameter` what varies; exponents (n, 2L) are
        all growth rates. The lines are those of `state.motion`: `line(p, 0)` and `line(0, 1)` at
        the two drives, where p = period_multiple, `line(m, k)` at m omega / p + k second.

    Raises
    ------
    ContinuationError
        for wrong input, or where the response to the first drive cannot be followed so far.
    """
    name, span = _range(first, second)
    scaled = system.scaled(float(first.direct), float(first.parametric))  # type: ignore[arg-type]
    rate = float(first.omega) / scaled.frequency  # type: ignore[arg-type]
    start = _first_response(scaled, rate, orbit)
    begin = attrs.evolve(second, **{name: span[0]})
    tones = _Tones(system, scaled, rate, start.period_multiple)
    curve = _raised(
        Family(tones.map(lambda part: _part(begin, part)), tolerance, harmonics, steps),
        orbit_state(start),
    )
    unit = scaled.frequency if name == "omega" else max(abs(span[0]), abs(span[1]))
    map_ = tones.map(lambda value: attrs.evolve(begin, **{name: value * unit}))
    limits = span[0] / unit, span[1] / unit
    family = Family(map_, tolerance, harmonics, steps)
    curve = Curve(curve.values, curve.rotation, limits[0])
    course = Course().run(family, curve, _rising(curve), limits, None)
    varied = Varied(name, unit, limits, {}, scaled, map_.equations)
    return Report(varied, map_).torus(family, course)


@attrs.frozen(eq=False)
class _Tones:
    """The return maps of one first drive for any second one."""

    system: ModalSystem
    scaled: ScaledSystem
    rate: float
    period_multiple: int

    def map(self, tone: Callable[[float], Tone]) -> TwoToneMap:
        direct = self.system.change({"direct": self.system.direct}, self.scaled)
        pattern = self.system.change({"parametric": self.system.parametric}, self.scaled)

        def frequency(parameter: float) -> float:
            return float(tone(parameter).omega) / self.scaled.frequency  # type: ignore[arg-type]

        def equations(parameter: float) -> tuple[ScaledSystem, float]:
            levels = tone(parameter)
            drive = direct.times(levels.direct).plus(pattern, levels.parametric)  # type: ignore[arg-type]
            return with_tone(self.scaled, drive, frequency(parameter)), self.rate

        return TwoToneMap(equations, frequency, self.period_multiple)


def _part(tone: Tone, part: float) -> Tone:
    """The tone with a part of its levels."""
    return attrs.evolve(
        tone,
        direct=part * tone.direct,  # type: ignore[operator]
        parametric=part * tone.parametric,  # type: ignore[operator]
    )


def _rising(curve: Curve) -> Direction:
    return Direction(np.zeros_like(curve.values), 0.0, 1.0)


def _raised(family: Family, state: Array) -> Curve:
    """The curve at the full level of the second tone, from the state without it."""
    values = np.tile(state, (2 * family.ladder[0] + 1, 1))
    rotation = family.equations.map.rotation(0.0)
    assert rotation is not None
    curve = Curve(values, rotation, 0.0)
    for member in family.follow(curve, _rising(curve), (-1.0, 1.0)):
        curve = member.curve
    if family.ending != "range" or curve.parameter < 0:
        raise ContinuationError(
            "second: the response cannot be followed while this tone is raised from zero; "
            "begin at a lower level or another frequency"
        )
    return curve


def _first_response(system: ScaledSystem, rate: float, orbit: PeriodicOrbit | None) -> Orbit:
    if orbit is None:
        return first_orbit(Tracer(system, forced_support(system), 1, Settings()), rate)
    p = orbit.period_multiple
    if abs(orbit.omega / system.frequency - rate) > SAME_FREQUENCY * rate:
        raise ContinuationError(
            f"orbit: its drive frequency {orbit.omega:g} is not that of the first tone"
        )
    return Orbit(system.inner(orbit.coefficients), rate / p, p)


def _range(first: Tone, second: Tone) -> tuple[str, tuple[float, float]]:
    """Which value of the second tone varies, and its range; raises ContinuationError."""
    names = [field.name for field in attrs.fields(Tone)]
    for name in names:
        if not finite(getattr(first, name)):
            raise ContinuationError(
                f"first.{name}: found {getattr(first, name)!r}; allowed a finite number"
            )
    ranges = [name for name in names if isinstance(getattr(second, name), (tuple, list))]
    if len(ranges) != 1:
        raise ContinuationError(
            f"second: found {len(ranges)} ranges (low, high); allowed exactly one of "
            f"{', '.join(names)}"
        )
    for name in set(names) - set(ranges):
        if not finite(getattr(second, name)):
            raise ContinuationError(
                f"second.{name}: found {getattr(second, name)!r}; allowed a finite number"
            )
    name = ranges[0]
    span = rising(f"second.{name}", getattr(second, name))
    lowest = span[0] if name == "omega" else float(second.omega)  # type: ignore[arg-type]
    if min(lowest, float(first.omega)) <= 0:  # type: ignore[arg-type]
        raise ContinuationError("omega: both tones need positive frequencies")
    return name, span
