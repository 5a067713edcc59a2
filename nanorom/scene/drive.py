"""The drive of a scene: levels, and the patterns of force that they act with."""

from __future__ import annotations

from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.patterns import AIMS, DIRECT, PARAMETRIC
from nanorom.scene.patterns.pattern import DirectPattern
from nanorom.scene.units import wrong
from nanorom.scene.waves import ALLOWED, Harmonic, as_harmonics, read_harmonics

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


@attrs.frozen(field_transformer=v.readers)
class Drive:
    """Levels of the direct and the parametric drive, and what they act on.

    direct: levels of the direct pattern, ``direct_pattern`` of `nanorom.scene.patterns`: "pressure"
        and "spot" in Pa, "point" in N.  The latter two act at ``position`` (x, y) in m, a spot
        within a ``radius`` in m.
    parametric: levels of ``parametric_pattern``: "tension" in N/m, "paper" in Pa/m.
    harmonics: terms of the drive by harmonics of its frequency; cos(omega t) of both if left out.
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
    position: tuple[float, ...] | None = attrs.field(
        default=None,
        converter=v.as_optional_quantities,
        metadata=v.quantities(
            "drive.position", "m", v.ANY, about="x and y of a spot's centre or of a point"
        ),
    )
    radius: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "drive.radius", "m", about="of a spot, where its intensity is 1/e^2 of the centre's"
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

    def __attrs_post_init__(self) -> None:
        for name, unit in zip(("direct", "parametric"), self.units):
            levels = _levels(getattr(self, name), unit, f"drive.{name}")
            object.__setattr__(self, name, levels)
        self._check_aim()
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

    def _check_aim(self) -> None:
        needed = DIRECT[self.direct_pattern].keys()
        for name in AIMS:
            given = getattr(self, name) is not None
            if given != (name in needed):
                what = "missing" if not given else "not used"
                found = f'direct_pattern = "{self.direct_pattern}"'
                raise SceneError(f"drive.{name}: {what} with {found}")
        if self.position is not None and len(self.position) != 2:
            raise wrong("drive.position", self.position, 'x and y such as ["1 um", "0 um"]')

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
        kind = DIRECT[self.direct_pattern]
        return kind(**{name: getattr(self, name) for name in kind.keys()})

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
