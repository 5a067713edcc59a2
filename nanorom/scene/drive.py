"""The drive of a scene: levels, and the patterns of force that they act with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.patterns import DIRECT, KEYS, PARAMETRIC
from nanorom.scene.patterns.gate import GateForce, GateStiffness
from nanorom.scene.patterns.laser import Laser
from nanorom.scene.patterns.pattern import DirectPattern, ParametricPattern, Pattern
from nanorom.scene.units import with_unit
from nanorom.scene.waves import ALLOWED, Harmonic, as_harmonics, read_harmonics
from nanorom.types import Array

Kind = TypeVar("Kind", bound=Pattern)

# keys that give levels, and the patterns that they bring
SOURCES: dict[str, dict[str, type[Pattern]]] = {
    "voltage": {"direct": GateForce, "parametric": GateStiffness},
    "laser": {"direct": Laser},
}
MOST_LEVELS = 100
LEVELS = f"one or a list of up to {MOST_LEVELS}, 0 or more, in the unit of the pattern"


def _levels(value: Any, unit: str, key: str) -> tuple[float, ...]:
    levels = v.read_quantities(value, unit, key, v.NOT_NEGATIVE)
    if len(levels) > MOST_LEVELS:
        raise SceneError(f"{key}: found {len(levels)} levels; allowed: at most {MOST_LEVELS}")
    return levels


def _as_given(value: Any) -> Any:
    """Levels are read when the unit of their pattern is known."""
    return value


def _with_keys(cls: type, fields: list[Any]) -> list[Any]:
    """The fields of a drive and those of all patterns, which may be None."""
    return v.readers(cls, [*fields, *KEYS.values()])


_section = attrs.frozen(field_transformer=_with_keys)


@_section
class Drive:
    """Levels of the direct and the parametric drive, and what they act on.

    direct, parametric: levels of ``direct_pattern`` and of ``parametric_pattern``, each in the unit
        that its class in `nanorom.scene.patterns` names.
    harmonics: terms of the drive by harmonics of its frequency; cos(omega t) of both if left out.
    voltage: amplitude in V on a gate that attracts the film, in the place of all of these; laser:
        that in W of light that heats it.
    The two lists go together level by level; a single value serves all levels of the other.
    Raises SceneError for levels, units or keys that do not fit the patterns.
    """

    direct: tuple[float, ...] = attrs.field(
        default=0.0,
        converter=v.as_quantities,
        metadata=v.custom(
            "drive.direct",
            _as_given,
            allowed=LEVELS,
            about="amplitude of the direct drive, level by level",
        ),
    )
    parametric: tuple[float, ...] = attrs.field(
        default=0.0,
        converter=v.as_quantities,
        metadata=v.custom(
            "drive.parametric",
            _as_given,
            allowed=LEVELS,
            about="amplitude of the parametric drive, level by level",
        ),
    )
    direct_pattern: str = attrs.field(
        default="pressure",
        metadata=v.choice(
            "drive.direct_pattern", DIRECT, about="what the direct levels are the amplitude of"
        ),
    )
    parametric_pattern: str = attrs.field(
        default="tension",
        metadata=v.choice(
            "drive.parametric_pattern",
            PARAMETRIC,
            about="what the parametric levels are the amplitude of",
        ),
    )
    harmonics: tuple[Harmonic, ...] | None = attrs.field(
        default=None,
        converter=as_harmonics,
        metadata=v.custom(
            "drive.harmonics",
            read_harmonics,
            allowed=ALLOWED,
            about="course of both drives in time, instead of cos(omega t)",
        ),
    )

    voltage: tuple[float, ...] | None = attrs.field(
        default=None,
        converter=v.as_optional_quantities,
        metadata=v.custom(
            "drive.voltage",
            lambda value: _levels(value, "V", "drive.voltage"),
            allowed=f"one or a list of up to {MOST_LEVELS}, 0 or more",
            about="amplitude v of V + v cos(omega t) on a gate of [load], level by level; the "
            "keys above are then left out",
            unit="V",
        ),
    )

    laser: tuple[float, ...] | None = attrs.field(
        default=None,
        converter=v.as_optional_quantities,
        metadata=v.custom(
            "drive.laser",
            lambda value: _levels(value, "W", "drive.laser"),
            allowed=f"one or a list of up to {MOST_LEVELS}, 0 or more",
            about="amplitude P1 of a laser's power P0 + P1 cos(omega t), in the same way",
            unit="W",
        ),
    )

    if TYPE_CHECKING:  # keys of patterns are known when they are collected

        def __init__(
            self,
            direct: v.Quantity | Sequence[v.Quantity] | Array = 0.0,
            parametric: v.Quantity | Sequence[v.Quantity] | Array = 0.0,
            direct_pattern: str = "pressure",
            parametric_pattern: str = "tension",
            harmonics: Any = None,
            voltage: v.Quantity | Sequence[v.Quantity] | Array | None = None,
            laser: v.Quantity | Sequence[v.Quantity] | Array | None = None,
            **keys: Any,
        ) -> None: ...

        def __getattr__(self, key: str) -> Any: ...

    def __attrs_post_init__(self) -> None:
        self._take_source()
        for name, unit in zip(("direct", "parametric"), self.units):
            levels = _levels(getattr(self, name), unit, f"drive.{name}")
            object.__setattr__(self, name, levels)
        self._check_keys()
        if self.laser is not None and max(self.laser) > self.power:
            raise SceneError(
                f"drive.laser: found {with_unit(max(self.laser), 'W', 6)}; allowed: at most "
                f"drive.power, {with_unit(self.power, 'W', 6)}, as light has no negative power"
            )
        self._check_harmonics()
        n_direct, n_parametric = len(self.direct), len(self.parametric)
        if n_direct != n_parametric and min(n_direct, n_parametric) > 1:
            raise SceneError(
                f"drive: found {n_direct} direct and {n_parametric} parametric levels; "
                "allowed: lists of one length, or a single value beside a list"
            )
        if (0.0, 0.0) in self.levels:
            raise SceneError(
                "drive: a level has neither direct nor parametric drive; "
                "allowed: drive.direct or drive.parametric greater than 0 at every level"
            )

    def _take_source(self) -> None:
        """Levels and patterns of a voltage or a laser; raises SceneError for others beside it."""
        source, chosen = self.source, (self.direct_pattern, self.parametric_pattern)
        for name, brought in SOURCES.items():
            for pattern in brought.values():
                if pattern.name in chosen and source != name:
                    raise SceneError(
                        f'drive.{name}: missing; it is what brings the pattern "{pattern.name}"'
                    )
        if source is None:
            return
        made: dict[str, Any] = {}
        for name, pattern in SOURCES[source].items():
            made |= {name: getattr(self, source), f"{name}_pattern": pattern.name}
        section: Any = type(self)
        for name, field in attrs.fields_dict(section).items():
            given = getattr(self, name)
            given = tuple(given) if v.is_list(given) else given
            usual = field.default, (field.default,), made.get(name)
            if name not in (source, *KEYS) and given not in usual:
                raise SceneError(f"drive.{name}: found beside drive.{source}; allowed: that alone")
        for name, value in made.items():
            object.__setattr__(self, name, value)

    @property
    def source(self) -> str | None:
        """Which of `SOURCES` gives the levels; None where they are given themselves."""
        return next((name for name in SOURCES if getattr(self, name) is not None), None)

    def _check_keys(self) -> None:
        """Keys are given where a pattern needs them, and nowhere where none has them."""
        chosen: tuple[tuple[str, Mapping[str, type[Pattern]], type[Pattern]], ...] = (
            ("direct_pattern", DIRECT, DIRECT[self.direct_pattern]),
            ("parametric_pattern", PARAMETRIC, PARAMETRIC[self.parametric_pattern]),
        )
        for name in KEYS:
            needed = [f'{key} = "{kind.name}"' for key, _, kind in chosen if name in kind.needs()]
            if needed and getattr(self, name) is None:
                raise SceneError(f"drive.{name}: missing with {needed[0]}")
            used = any(name in kind.keys() for _, _, kind in chosen)
            if not used and getattr(self, name) is not None:
                found = [
                    f'{key} = "{kind.name}"'
                    for key, table, kind in chosen
                    if any(name in each.keys() for each in table.values())
                ]
                raise SceneError(f"drive.{name}: not used with {', '.join(found)}")

    def _check_harmonics(self) -> None:
        """Levels that no harmonic uses move nothing."""
        for name in ("direct", "parametric"):
            used = any(getattr(each, name) for each in self.harmonics or ())
            if self.harmonics is not None and any(getattr(self, name)) and not used:
                raise SceneError(
                    f"drive.harmonics: none has {name}, but drive.{name} has levels; allowed: one "
                    f"or more with {name} = 1, say"
                )

    @property
    def pattern(self) -> DirectPattern:
        """The direct pattern, aimed."""
        return self._aimed(DIRECT[self.direct_pattern])

    @property
    def modulation(self) -> ParametricPattern:
        """The parametric pattern, aimed."""
        return self._aimed(PARAMETRIC[self.parametric_pattern])

    def _aimed(self, kind: type[Kind]) -> Kind:
        known = {name: getattr(self, name) for name in kind.keys()}
        return kind(**{name: value for name, value in known.items() if value is not None})

    @property
    def electrode(self) -> int:
        """Number of the gate of [load] that a voltage alternates on."""
        return int(self.gate or 1)

    @property
    def levels(self) -> tuple[tuple[float, float], ...]:
        """(direct, parametric) of each level, in `units`."""
        count = max(len(self.direct), len(self.parametric))
        direct = self.direct * (count if len(self.direct) == 1 else 1)
        parametric = self.parametric * (count if len(self.parametric) == 1 else 1)
        return tuple(zip(direct, parametric))

    @property
    def units(self) -> tuple[str, str]:
        """Units of the direct and of the parametric levels."""
        return DIRECT[self.direct_pattern].unit, PARAMETRIC[self.parametric_pattern].unit

    @property
    def names(self) -> list[str]:
        """What tells the levels apart: the voltage or the power, else what is not always zero."""
        used = [self.source is None and any(column) for column in zip(*self.levels)]
        if self.source is not None:
            used[0] = True  # it is the amplitude of both
        levels = [zip(level, self.units, used) for level in self.levels]
        return [" + ".join(with_unit(x, u, 3) for x, u, ours in level if ours) for level in levels]

    @property
    def told(self) -> list[str]:
        """The levels in words, "5 Pa direct, 0 N/m parametric" or "50 mV"."""
        if self.source is not None:
            return self.names
        both = [map(with_unit, level, self.units) for level in self.levels]
        return [f"{direct} direct, {parametric} parametric" for direct, parametric in both]


def _about_keys() -> str:
    """What the patterns say of the keys that they bring."""
    lines = []
    for name, field in KEYS.items():
        unit = field.metadata["unit"]
        lines.append(f"{name}: {field.metadata['about']}{f', in {unit}' if unit else ''}.")
    return "\n    ".join(lines)


Drive.__doc__ = f"{Drive.__doc__}Keys of patterns:\n    {_about_keys()}"
