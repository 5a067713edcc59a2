"""The unknowns of a device as a vector, and the arrays of its equations with their derivatives.

Numbers of the scene change the arrays through exact derivatives of the reduced model
(`fem.sensitivity`); numbers of the instruments (drive, read-out, offset) are factors beside it.
All are sought as logarithms but those that may vanish.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.measurement.device.equations import Terms
from nanorom.measurement.unknowns import Film, Unknown
from nanorom.rom.names import plain
from nanorom.scene.scene import Scene
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.fem.sensitivity.model import Arrays, ModelSlopes

FARTHEST = 0.7  # of a logarithm in one step


@attrs.frozen
class Parameter:
    """One number that is sought.

    name: of its unknown; mode: its label, or "" if it is one for all; value, unit: where the
    search begins; logarithm: it is greater than 0.
    """

    name: str
    mode: str
    value: float
    unit: str
    logarithm: bool = True

    @property
    def title(self) -> str:
        """Name with the mode that it is of."""
        return f"{self.name}.{self.mode}" if self.mode else self.name


@attrs.frozen(eq=False)
class Device:
    """A device with its instruments at some values of p parameters.

    scene; label: names of its L modes; terms: arrays of the equations, force per unit of a level;
    gain: (L,) of the read-out, unit of the amplitude per m; offset: Hz, of the frequencies that the
    instrument tells; phase: (L,) rad that it adds to the motion's about each mode's resonance;
    changes: terms per unit of each sought number; gains, phases: (p, L); offsets: (p,).
    """

    scene: Scene
    label: tuple[str, ...]
    terms: Terms
    gain: Array
    offset: float
    phase: Array
    changes: list[Terms]
    gains: Array
    offsets: Array
    phases: Array

    @property
    def frequency(self) -> Array:
        """(L,) Hz."""
        return np.asarray(np.sqrt(self.terms.stiffness) / (2 * np.pi))


@attrs.frozen(eq=False)
class Known:
    """What is known of the instruments.

    pattern: name of the scene's pattern of direct drive that levels multiply, or "" where the
    force on each mode is a number of its own, in N per unit of the level.
    """

    pattern: str


@attrs.define(eq=False)
class Parameters:
    """What is sought, and the way from it to a device.

    scene: with the modes of the fit alone; label: of these modes; unknowns: of the scene's film;
    sought: all parameters, those of the film first; fixed: values by title of the numbers of the
    instruments that are known; signs: of the force on modes, where it is against the others'.
    """

    scene: Scene
    label: tuple[str, ...]
    unknowns: tuple[Unknown, ...]
    sought: tuple[Parameter, ...]
    fixed: Mapping[str, float]
    known: Known
    reduce: Callable[[Scene, Sequence[str]], ModelSlopes]
    evaluations: int = 0
    signs: dict[str, float] = attrs.Factory(dict)

    def start(self) -> Array:
        """(p,) where the search begins."""
        return np.array([_inner(parameter, parameter.value) for parameter in self.sought])

    def values(self, x: Array) -> Array:
        """(p,) in the units of the parameters."""
        return np.array([np.exp(v) if p.logarithm else v for p, v in zip(self.sought, x.tolist())])

    def with_(self, more: Parameter) -> Parameters:
        """With one more that is sought."""
        fixed = {name: value for name, value in self.fixed.items() if name != more.title}
        return attrs.evolve(self, sought=(*self.sought, more), fixed=fixed)

    def film_scene(self, x: Array) -> Scene:
        """The scene with the film that belongs to x (p,); raises SceneError."""
        film = Film.of(self.scene)
        for unknown, value in zip(self.unknowns, self.values(x).tolist()):
            film = unknown.put(film, value)
        return film.put_into(self.scene)

    def device(self, x: Array) -> Device:
        """The device at x (p,); raises NanoromError where there is none."""
        scene = self.film_scene(x)
        found = self.reduce(scene, [unknown.key for unknown in self.unknowns])
        self.evaluations += 1
        names = [plain(name) for name in found.label]
        if sorted(names) != sorted(self.label):
            raise SceneError(f"modes: found {', '.join(names)}; wanted {', '.join(self.label)}")
        order = [names.index(name) for name in self.label]
        value = _picked(found.value, order)
        slopes = [_picked(found.slope[u.key], order) for u in self.unknowns]
        return _Builder(self, dict(self._by_title(x)), value, slopes).device(scene)

    def _by_title(self, x: Array) -> dict[str, float]:
        own = {p.title: v for p, v in zip(self.sought, self.values(x).tolist())}
        return {**self.fixed, **own}


@attrs.frozen(eq=False)
class _Builder:
    """Arrays of one device and their derivatives by every parameter."""

    parameters: Parameters
    numbers: dict[str, float]
    value: Arrays
    slopes: list[Arrays]

    def number(self, name: str, mode: int) -> float:
        """Of a mode, or the one of all."""
        title = f"{name}.{self.parameters.label[mode]}"
        return self.numbers.get(title, self.numbers.get(name, np.nan))

    def each(self, name: str) -> Array:
        return np.array([self.number(name, r) for r in range(len(self.parameters.label))])

    def device(self, scene: Scene) -> Device:
        value, time = self.value, self.numbers["material_time"]
        omega, mass = 2 * np.pi * value.frequency, value.mass
        quality, drive, gain = (self.each(n) for n in ("quality_factor", "drive", "readout"))
        pattern = self.pattern(value)
        terms = Terms(
            omega / quality, omega**2, _over(value.cubic, mass), drive * pattern / mass, time
        )
        changes = [self.by_scene(terms, slope) for slope in self.slopes]
        gains = [np.zeros(len(mass)) for _ in self.slopes]
        offsets = [0.0 for _ in self.slopes]
        phases = [np.zeros(len(mass)) for _ in self.slopes]
        nothing = Terms(0 * omega, 0 * omega, 0 * terms.cubic, 0 * omega, 0.0)
        for parameter in self.parameters.sought[len(self.slopes) :]:
            own = np.array([parameter.mode in ("", name) for name in self.parameters.label])
            table = {
                "quality_factor": attrs.evolve(nothing, damping=-terms.damping * own),
                "material_time": attrs.evolve(nothing, time=1.0),
                "drive": attrs.evolve(nothing, force=terms.force * own),
            }
            changes.append(table.get(parameter.name, nothing))
            gains.append(gain * own * (parameter.name == "readout"))
            offsets.append(1.0 * (parameter.name == "offset"))
            phases.append(1.0 * own * (parameter.name == "phase"))
        return Device(
            scene,
            self.parameters.label,
            terms,
            gain,
            self.numbers["offset"],
            self.each("phase"),
            changes,
            np.array(gains),
            np.array(offsets),
            np.array(phases),
        )

    def pattern(self, arrays: Arrays) -> Array:
        name, signs = self.parameters.known.pattern, self.parameters.signs
        if name:
            return arrays.drive[name]
        return np.array([signs.get(label, 1.0) for label in self.parameters.label])

    def by_scene(self, terms: Terms, slope: Arrays) -> Terms:
        """What the logarithm of a number of the scene changes."""
        omega, mass = 2 * np.pi * self.value.frequency, self.value.mass
        moved, heavier = 2 * np.pi * slope.frequency, slope.mass / mass
        force = -terms.force * heavier
        if self.parameters.known.pattern:
            force = force + self.each("drive") * self.pattern(slope) / mass
        cubic = _over(slope.cubic, mass) - heavier[:, None, None, None] * terms.cubic
        return Terms(terms.damping * moved / omega, 2 * omega * moved, cubic, force, 0.0)


def _inner(parameter: Parameter, value: float) -> float:
    return float(np.log(value)) if parameter.logarithm else value


def _over(cubic: Array, mass: Array) -> Array:
    return np.asarray(cubic / mass[:, None, None, None])


def _picked(arrays: Arrays, order: Sequence[int]) -> Arrays:
    """Of modes in another order."""

    def turned(array: Array) -> Array:
        for axis in range(array.ndim):
            array = array.take(order, axis)
        return array

    return arrays.combined(turned)
