"""What a device is subjected to: damping, drive and the frequency sweep.

The sections stand in a scene or, for `nanorom respond`, in a file of their own. The modal force is
F(t, q) = (direct * J + parametric * P q) cos(omega t), with patterns J and P of the reduced model.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units
from nanorom.scene.drive import Drive
from nanorom.scene.instrument import Instrument
from nanorom.scene.units import with_unit

DEEPEST = 5


@attrs.frozen(field_transformer=v.readers)
class Damping:
    """Quality factor and viscosity of the material.

    quality_factor: a number, one for all modes or one per mode (L,); None where all that damps is
    known: losses of the film, which add to it.
    material_time: relaxation time tau in s of a Kelvin-Voigt material, stress C:(1 + tau d/dt)E;
    it damps bending beside the quality factor, and stretching, which is nonlinear damping.
    """

    quality_factor: tuple[float, ...] | None = attrs.field(
        default=None,
        converter=v.as_optional_quantities,
        metadata=v.quantities(
            "damping.quality_factor",
            "1",
            about="quality factor beside the film's losses, one for all modes or one per mode",
        ),
    )
    material_time: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "damping.material_time",
            "s",
            v.NOT_NEGATIVE,
            about="relaxation time of a viscous material, stress C:(1 + tau d/dt)E",
        ),
    )

    @property
    def idle(self) -> bool:
        """Nothing in it damps."""
        return self.quality_factor is None and self.material_time == 0.0

    def per_mode(self, count: int) -> tuple[float, ...]:
        """One quality factor for each mode; raises SceneError if the list has another length.

        Infinity where there is none.
        """
        if self.quality_factor is None:
            return (math.inf,) * count
        if len(self.quality_factor) == 1:
            return self.quality_factor * count
        if len(self.quality_factor) != count:
            raise SceneError(
                f"damping.quality_factor: found {len(self.quality_factor)} values; "
                f"allowed: one, or {count} (one per mode)"
            )
        return self.quality_factor


_RELATIVE = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*\*?\s*f1\s*")


@attrs.frozen(field_transformer=v.readers)
class Frequency:
    """A drive frequency: value in Hz or, if relative, in multiples of the model's lowest."""

    value: float
    relative: bool = False

    def hertz(self, lowest: float) -> float:
        """The frequency in Hz, given the lowest frequency of the model in Hz."""
        return self.value * lowest if self.relative else self.value

    def __str__(self) -> str:
        return f"{self.value!r} f1" if self.relative else f"{self.value!r} Hz"


def as_frequency(value: v.Quantity | Frequency) -> Frequency:
    """A frequency, absolute or relative; what it may be given as, for type checkers."""
    return _reader("frequency")(value)


def _reader(key: str) -> Callable[[Any], Frequency]:
    def read(value: Any) -> Frequency:
        if isinstance(value, Frequency):
            return value
        match = _RELATIVE.fullmatch(value) if isinstance(value, str) else None
        if match:
            return Frequency(v.read_quantity(match[1], "1", key, v.POSITIVE), relative=True)
        if isinstance(value, str) and re.search(r"f\d", value):
            raise units.wrong(key, value, 'a multiple of the lowest frequency such as "0.8 f1"')
        return Frequency(v.read_quantity(value, "Hz", key, v.POSITIVE))

    return read


def _frequency(key: str, about: str) -> dict[str, Any]:
    allowed = 'greater than 0, in Hz or as "0.8 f1"'
    return v.custom(key, _reader(key), allowed, about)


@attrs.frozen(field_transformer=v.readers)
class Sweep:
    """Range of the drive frequency, and how far bifurcating branches are followed.

    start, stop: ("from" and "to" in a file) Hz or multiples of the lowest frequency, "0.8 f1".
    depth: generations of bifurcating branches to follow; tolerance: relative, of the orbits.
    """

    start: Frequency = attrs.field(
        converter=as_frequency, metadata=_frequency("sweep.from", "lowest drive frequency")
    )
    stop: Frequency = attrs.field(
        converter=as_frequency, metadata=_frequency("sweep.to", "highest drive frequency")
    )
    depth: int | None = attrs.field(
        default=None,
        metadata=v.integer(
            "sweep.depth", 0, DEEPEST, about="generations of bifurcating branches that are followed"
        ),
    )
    tolerance: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "sweep.tolerance", "1", v.within(1e-14, 0.1), about="relative, of the orbits"
        ),
    )

    def __attrs_post_init__(self) -> None:
        if self.start.relative == self.stop.relative and self.start.value >= self.stop.value:
            raise SceneError(
                f"sweep.to: found {self.stop}; allowed: above sweep.from ({self.start})"
            )

    @classmethod
    def between(cls, ends: Any) -> Sweep:
        """Of its two ends; raises SceneError."""
        if not v.is_list(ends) or len(ends) != 2:
            raise SceneError(
                f"sweep: found {ends!r}; allowed: lowest and highest drive frequency, such as "
                '("0.8 f1", "1.2 f1")'
            )
        return cls(*ends)

    def hertz(self, lowest: float) -> tuple[float, float]:
        """Ends of the range in Hz; raises SceneError if they are in the wrong order."""
        start, stop = self.start.hertz(lowest), self.stop.hertz(lowest)
        if start >= stop:
            raise SceneError(
                f"sweep.to: found {self.stop} = {with_unit(stop, 'Hz', 6)}; "
                f"allowed: above sweep.from ({self.start} = {with_unit(start, 'Hz', 6)})"
            )
        return start, stop


def check_complete(damping: Damping | None, drive: Drive | None, sweep: Sweep | None) -> None:
    """Raise SceneError if a response is asked for and a section that it needs is missing."""
    if drive is None and sweep is None:
        return
    for name, section in (("damping", damping), ("drive", drive), ("sweep", sweep)):
        if section is None:
            raise SceneError(f"{name}: missing section [{name}], which a frequency response needs")


@attrs.frozen(kw_only=True)
class Excitation:
    """The sections that a frequency response needs; without damping, the model's own is used.

    readout : what makes a voltage of it, if anything.
    """

    drive: Drive
    sweep: Sweep
    damping: Damping | None = None
    readout: Instrument | None = None

    @classmethod
    def from_file(cls, path: str | Path) -> Excitation:
        """Read [drive], [sweep] and optionally [damping] and [readout] from a file.

        Raises SceneError.
        """
        path = Path(path)
        text = v.read_text(path)
        try:
            return cls.from_dict(v.parse_toml(text))
        except SceneError as error:
            raise SceneError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Excitation:
        """Read the sections from nested dictionaries; raises SceneError."""
        classes: dict[str, Any] = {"drive": Drive, "sweep": Sweep, "damping": Damping}
        classes["readout"] = Instrument
        for name in document:
            if name not in classes:
                hint = v.did_you_mean(name, classes)
                raise SceneError(f"{name}: unknown section{hint}; allowed: {', '.join(classes)}")
        for name in ("drive", "sweep"):
            if name not in document:
                raise SceneError(f"{name}: missing section [{name}]")
        found = {name: v.from_table(classes[name], name, t) for name, t in document.items()}
        if "damping" in found and found["damping"].idle:
            raise SceneError(
                "damping.quality_factor: missing; leave out [damping] for a model's own damping"
            )
        return cls(**found)

    @classmethod
    def asked(
        cls,
        scene: str,
        drive: Any = None,
        sweep: Any = None,
        damping: Any = None,
        readout: Instrument | None = None,
    ) -> Self:
        """What is asked of the model of a scene: what is given, else what its TOML text has.

        A drive may be its direct levels, a sweep its two ends, a damping its quality factor, each
        of them a table of keys.  Raises SceneError.
        """
        short: dict[str, tuple[type, Callable[[Any], Any]]] = {
            "drive": (Drive, Drive),
            "sweep": (Sweep, Sweep.between),
            "damping": (Damping, Damping),
            "readout": (Instrument, Instrument),
        }
        found = {"drive": drive, "sweep": sweep, "damping": damping, "readout": readout}
        found = {name: value for name, value in found.items() if value is not None}
        if drive is None or sweep is None:
            own = v.parse_toml(scene)
            found = {n: own[n] for n in ("drive", "sweep", "readout") if n in own} | found
        for name in ("drive", "sweep"):
            if name not in found:
                raise SceneError(
                    f"{name}: missing; give one, or a model whose scene has a section [{name}]"
                )
        return cls(**{n: v.taken(short[n][0], n, each, short[n][1]) for n, each in found.items()})

    def to_toml(self) -> str:
        """The sections as TOML in SI numbers; reading it gives an equal object."""
        return v.to_tables(self)
