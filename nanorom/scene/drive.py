"""The drive of a scene: levels, and the patterns of force that they act with."""

from __future__ import annotations

from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.units import wrong

# pattern -> unit of its level
DIRECT_PATTERNS = {"pressure": "Pa", "spot": "Pa", "point": "N"}
PARAMETRIC_PATTERNS = {"tension": "N/m", "paper": "Pa/m"}
MOST_LEVELS = 100


def _levels(value: Any, unit: str, key: str) -> tuple[float, ...]:
    levels = v.read_quantities(value, unit, key, v.NOT_NEGATIVE)
    if len(levels) > MOST_LEVELS:
        raise SceneError(f"{key}: found {len(levels)} levels; allowed: at most {MOST_LEVELS}")
    return levels


@attrs.frozen
class Drive:
    """Levels of the direct and the parametric drive, and what they act on.

    direct: amplitude of a uniform pressure in Pa (pattern "pressure"), of a Gaussian spot of light
        in Pa at its centre (pattern "spot": p exp(-2 d^2/radius^2) at a distance d from
        ``position``), or of a force in N at ``position`` (pattern "point").
    parametric: amplitude of the isotropic tension modulation in N/m (pattern "tension"), or in
        Pa/m the gamma of Keskekler et al., F_r = J_r q_r gamma cos(omega t) (pattern "paper").
    The two lists go together level by level; a single value serves all levels of the other.
    """

    direct: tuple[float, ...] = attrs.field(default=0.0, metadata={"key": "direct", "unit": None})
    parametric: tuple[float, ...] = attrs.field(
        default=0.0, metadata={"key": "parametric", "unit": None}
    )
    direct_pattern: str = v.choice("drive.direct_pattern", DIRECT_PATTERNS, default="pressure")
    parametric_pattern: str = v.choice(
        "drive.parametric_pattern", PARAMETRIC_PATTERNS, default="tension"
    )
    position: tuple[float, ...] | None = v.quantities("drive.position", "m", v.ANY, default=None)
    radius: float | None = v.quantity("drive.radius", "m", default=None)

    def __attrs_post_init__(self) -> None:
        for name, units in (("direct", DIRECT_PATTERNS), ("parametric", PARAMETRIC_PATTERNS)):
            unit = units[getattr(self, f"{name}_pattern")]
            levels = _levels(getattr(self, name), unit, f"drive.{name}")
            object.__setattr__(self, name, levels)
        self._check_aim()
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
        wanted = {"pressure": (), "spot": ("position", "radius"), "point": ("position",)}
        pattern = self.direct_pattern
        for name in ("position", "radius"):
            given = getattr(self, name) is not None
            if given != (name in wanted[pattern]):
                what = "missing" if not given else "not used"
                raise SceneError(f'drive.{name}: {what} with direct_pattern = "{pattern}"')
        if self.position is not None and len(self.position) != 2:
            raise wrong("drive.position", self.position, 'x and y such as ["1 um", "0 um"]')

    @property
    def levels(self) -> tuple[tuple[float, float], ...]:
        """(direct, parametric) of each level."""
        count = max(len(self.direct), len(self.parametric))
        direct = self.direct * (count if len(self.direct) == 1 else 1)
        parametric = self.parametric * (count if len(self.parametric) == 1 else 1)
        return tuple(zip(direct, parametric))

    @property
    def units(self) -> tuple[str, str]:
        """Units of the direct and of the parametric levels."""
        return (
            DIRECT_PATTERNS[self.direct_pattern],
            PARAMETRIC_PATTERNS[self.parametric_pattern],
        )
