"""The course of a drive in time: harmonics of one frequency, each with a phase."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.units import wrong

HIGHEST = 20  # harmonic: orbits of 150 harmonics have room for no more
MOST = 40
ALLOWED = (
    "a list such as [{ harmonic = 1, direct = 1 }, { harmonic = 2, parametric = 1, "
    'phase = "90 deg" }]'
)


@attrs.frozen(field_transformer=v.readers)
class Harmonic:
    """One term of a drive: (direct J + parametric P q) cos(harmonic omega t + phase).

    direct, parametric: factors on the levels of the drive; phase in rad. Raises SceneError.
    """

    harmonic: int = attrs.field(
        metadata=v.integer("drive.harmonics.harmonic", 0, HIGHEST, about="0 is a constant force")
    )
    direct: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "drive.harmonics.direct", "1", v.ANY, about="factor on the direct levels"
        ),
    )
    parametric: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "drive.harmonics.parametric", "1", v.ANY, about="factor on the parametric levels"
        ),
    )
    phase: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity("drive.harmonics.phase", "rad", v.ANY, about="at time 0"),
    )

    def __attrs_post_init__(self) -> None:
        if self.harmonic == 0 and self.phase != 0:
            raise wrong("drive.harmonics.phase", self.phase, "0 of a constant force (harmonic 0)")


def read_harmonics(value: Any) -> tuple[Harmonic, ...]:
    """Harmonics from tables of a file, or as they are; raises SceneError."""
    key = "drive.harmonics"
    if isinstance(value, Mapping) or not v.is_list(value) or not len(value):
        raise wrong(key, value, ALLOWED)
    if len(value) > MOST:
        raise SceneError(f"{key}: found {len(value)} harmonics; allowed: at most {MOST}")
    return tuple(
        each if isinstance(each, Harmonic) else v.from_table(Harmonic, key, each) for each in value
    )


def as_harmonics(value: Any) -> tuple[Harmonic, ...] | None:
    """Harmonics, or None; what they may be given as, for type checkers."""
    return None if value is None else read_harmonics(value)
