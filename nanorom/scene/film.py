"""The film: thickness, model, shape and tension."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units
from nanorom.scene.wrinkles import TENSION_KEY, Unevenness, Wrinkles

UNEVENNESS = '{ amplitude = "0.01 N/m", correlation = "0.5 um", seed = 1 }'
WRINKLES = '{ amplitude = "1 nm", correlation = "0.5 um", seed = 1 }'


@attrs.frozen
class Model:
    """What a model of the film means for the rest of a scene.

    bends: with bending stiffness; None: where it makes a difference.  Without it the film is held
    by its tension alone, and nothing turns at a rotational spring; lowest_degree: of the deflection
    on a mesh; springs: an edge may be elastic; planar: what is in its plane is known apart: tension
    along xy, supports of the displacement there, a film that nothing holds; shallow: slopes of the
    deflection are small; thin: the film is, beside its width; larger: a model of more modes can be
    had beside one, at no great cost.
    """

    bends: bool | None
    lowest_degree: int = 1
    springs: bool = True
    planar: bool = True
    shallow: bool = True
    thin: bool = True
    larger: bool = True


MODELS = {
    "auto": Model(bends=None),
    "membrane": Model(bends=False),
    "plate": Model(bends=True, lowest_degree=2),
    "shell": Model(bends=True, springs=False, planar=False, shallow=False, larger=False),
    "beam": Model(bends=True, planar=False),
    "solid": Model(
        bends=True, lowest_degree=2, springs=False, planar=False, thin=False, larger=False
    ),
}


def _as_shape(value: str | Path | Mapping[str, Any] | Wrinkles | None) -> Path | Wrinkles | None:
    """What an initial shape may be given as, for type checkers."""
    return _shape(value)


def _shape(value: Any) -> Path | Wrinkles | None:
    key = "plate.initial_shape"
    if value is None or isinstance(value, Wrinkles):
        return value
    if isinstance(value, Mapping):
        return v.from_table(Wrinkles, key, value)
    if not isinstance(value, (str, Path)) or str(value) == "":
        raise units.wrong(key, value, f"the name of a table of x, y, z in m, or {WRINKLES}")
    if not Path(value).is_file():
        raise SceneError(f"{key}: found '{value}'; there is no such file")
    return Path(value)


@attrs.frozen(field_transformer=v.readers)
class Plate:
    """The film's thickness, model and shape.

    model: membrane (no bending), plate (Kirchhoff), shell (rotations of any size, any surface in
    space), beam (one dimension), solid (three dimensions: the film made thick, or the volumes of a
    mesh file) or auto (membrane or plate); initial_shape: table with columns x, y
    and height z in m of the film before tension and load act, on any points, or `Wrinkles`.
    """

    thickness: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("plate.thickness", "m", about="thickness h")
    )
    model: str = attrs.field(
        default="auto",
        metadata=v.choice(
            "plate.model",
            tuple(MODELS),
            about="without bending, Kirchhoff's, of any rotations, in one dimension, or in three; "
            "auto takes one of the first two",
        ),
    )
    initial_shape: Path | Wrinkles | None = attrs.field(
        default=None,
        converter=_as_shape,
        metadata=v.custom(
            "plate.initial_shape",
            _shape,
            allowed=f"a file or {WRINKLES}",
            about="table of x, y and height z in m of a film that is not flat, or random wrinkles",
        ),
    )

    @property
    def shape_file(self) -> Path | None:
        """The table of its initial shape, if that comes from one."""
        return self.initial_shape if isinstance(self.initial_shape, Path) else None

    @property
    def bends(self) -> bool | None:
        """With bending stiffness or without; None: where it makes a difference."""
        return self.rules.bends

    @property
    def rules(self) -> Model:
        """What the model means for the rest of a scene."""
        return MODELS[self.model]


def _as_variation(
    value: str | Path | Mapping[str, Any] | Unevenness | None,
) -> Path | Unevenness | None:
    """What a variation of the tension may be given as, for type checkers."""
    return _variation(value)


def _variation(value: Any) -> Path | Unevenness | None:
    if value is None or isinstance(value, Unevenness):
        return value
    if isinstance(value, Mapping):
        return v.from_table(Unevenness, TENSION_KEY, value)
    if not isinstance(value, (str, Path)) or str(value) == "":
        raise units.wrong(
            TENSION_KEY, value, f"the name of a table of x, y in m and N/m, or {UNEVENNESS}"
        )
    if not Path(value).is_file():
        raise SceneError(f"{TENSION_KEY}: found '{value}'; there is no such file")
    return Path(value)


@attrs.frozen(field_transformer=v.readers)
class Tension:
    """Film tension along x and y and its shear xy in N/m; negative is compression.

    With one value it is the same in every direction.  variation : what it has beside that from
    place to place, alike in all directions, before it relaxes in the plane: a table of x, y in m
    and N/m on any points, or an `Unevenness`.
    """

    x: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(
            "tension.x", "N/m", v.ANY, about="tension along x; negative is compression"
        ),
    )
    y: float = attrs.field(
        default=attrs.Factory(lambda self: self.x, takes_self=True),
        converter=v.as_quantity,
        metadata=v.quantity("tension.y", "N/m", v.ANY, about="tension along y"),
    )
    xy: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "tension.xy", "N/m", v.ANY, about="shear of the tension between x and y"
        ),
    )
    variation: Path | Unevenness | None = attrs.field(
        default=None,
        converter=_as_variation,
        metadata=v.custom(
            TENSION_KEY,
            _variation,
            allowed=f"a file or {UNEVENNESS}",
            about="table of x, y and what the tension has there beside x and y before it relaxes, "
            "or a random one",
        ),
    )

    @property
    def principal(self) -> tuple[float, float]:
        """The smallest and the largest tension (N/m) of all directions."""
        middle, radius = (self.x + self.y) / 2, math.hypot((self.x - self.y) / 2, self.xy)
        return middle - radius, middle + radius

    @property
    def smallest(self) -> float:
        """The tension (N/m) of the direction that has the least."""
        return self.principal[0] if self.xy else min(self.x, self.y)

    @property
    def largest(self) -> float:
        """The tension (N/m) of the direction that has the most."""
        return self.principal[1] if self.xy else max(self.x, self.y)

    @property
    def is_isotropic(self) -> bool:
        """The same in every direction."""
        return self.x == self.y and self.xy == 0.0 and self.variation is None

    @classmethod
    def isotropic(cls, value: v.Quantity) -> Tension:
        """The same tension in every direction."""
        tension = v.read_quantity(value, "N/m", "tension.value")
        return cls(tension, tension)

    @classmethod
    def from_stress(cls, stress: v.Quantity, thickness: v.Quantity) -> Tension:
        """Isotropic film stress (Pa) times thickness (m)."""
        tension = v.read_quantity(stress, "Pa", "tension.stress") * v.read_quantity(
            thickness, "m", "plate.thickness", v.POSITIVE
        )
        return cls(tension, tension)

    @classmethod
    def from_table(cls, table: Any, plate: Plate) -> Tension:
        """Read [tension]: value, or x, y and xy, in N/m, or stress in Pa, and a variation.

        Raises SceneError.
        """
        v.check_keys("tension", table, ("value", "x", "y", "xy", "stress", "variation"))
        variation = _variation(table.get("variation"))
        match sorted(set(table) - {"variation"}):
            case ["x", "y"]:
                return cls(table["x"], table["y"], variation=variation)
            case ["x", "xy", "y"]:
                return cls(table["x"], table["y"], table["xy"], variation)
            case ["value"]:
                return attrs.evolve(cls.isotropic(table["value"]), variation=variation)
            case ["stress"]:
                even = cls.from_stress(table["stress"], plate.thickness)
                return attrs.evolve(even, variation=variation)
        found = " and ".join(sorted(table)) or "no key"
        raise SceneError(f"tension: found {found}; allowed: value, or x and y (and xy), or stress")
