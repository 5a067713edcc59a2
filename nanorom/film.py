"""The film: thickness, material, tension and how its edge is held."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from nanorom import validation as v
from nanorom.errors import SceneError

KINDS = ("clamped", "simply_supported", "free")
SPRING_KEYS = {"spring", "rotational"}
MODELS = ("auto", "membrane", "plate", "shell", "beam")


def _shape_file(value: Any) -> Path | None:
    key = "plate.initial_shape"
    if value is None:
        return None
    if not isinstance(value, (str, Path)) or str(value) == "":
        raise v.wrong(key, value, "the name of a table of x, y, z in m")
    if not Path(value).is_file():
        raise SceneError(f"{key}: found '{value}'; there is no such file")
    return Path(value)


@attrs.frozen
class Plate:
    """The film's thickness, model and shape.

    model: membrane (no bending), plate (Kirchhoff), shell (rotations of any size, any surface in
    space), beam (one dimension) or auto (membrane or plate); initial_shape: table with columns x, y
    and height z in m of the film before tension and load act, on any points.
    """

    thickness: float = v.quantity("plate.thickness", "m")
    model: str = v.choice("plate.model", MODELS, default="auto")
    initial_shape: Path | None = v.custom("plate.initial_shape", _shape_file, default=None)


@attrs.frozen
class Material:
    """Isotropic linear elastic material."""

    youngs_modulus: float = v.quantity("material.youngs_modulus", "Pa")
    poisson_ratio: float = v.quantity("material.poisson_ratio", "1", v.within(-1, 0.5))
    density: float = v.quantity("material.density", "kg/m^3")


@attrs.frozen
class Tension:
    """Film tension along x and y in N/m; negative is compression."""

    x: float = v.quantity("tension.x", "N/m", v.ANY)
    y: float = v.quantity("tension.y", "N/m", v.ANY)

    @classmethod
    def isotropic(cls, value: Any) -> Tension:
        """The same tension in every direction."""
        tension = v.read_quantity(value, "N/m", "tension.value")
        return cls(tension, tension)

    @classmethod
    def from_stress(cls, stress: Any, thickness: Any) -> Tension:
        """Isotropic film stress (Pa) times thickness (m)."""
        tension = v.read_quantity(stress, "Pa", "tension.stress") * v.read_quantity(
            thickness, "m", "plate.thickness", v.POSITIVE
        )
        return cls(tension, tension)

    @classmethod
    def from_table(cls, table: Any, plate: Plate) -> Tension:
        """Read [tension]: value, or x and y, or stress."""
        v.check_keys("tension", table, ("value", "x", "y", "stress"))
        match sorted(table):
            case ["x", "y"]:
                return cls(table["x"], table["y"])
            case ["value"]:
                return cls.isotropic(table["value"])
            case ["stress"]:
                return cls.from_stress(table["stress"], plate.thickness)
        found = " and ".join(sorted(table)) or "no key"
        raise SceneError(f"tension: found {found}; allowed: value, or x and y, or stress")


@attrs.frozen
class Spring:
    """An edge that cannot move in the plane and is held elastically out of it.

    spring : transverse, in N/m^2 (force per length of the edge and displacement), None: held;
    rotational : in N (moment per length and angle), 0: free to rotate.
    """

    spring: float | None = v.quantity("support.spring", "N/m^2", default=None)
    rotational: float = v.quantity("support.rotational", "N", v.NOT_NEGATIVE, default=0.0)


Kind = str | Spring


def _kind(value: Any, key: str) -> Kind:
    if isinstance(value, Spring):
        return value
    if isinstance(value, Mapping) and len(value) > 0:
        return v.from_table(Spring, key, value)
    return v.read_choice(value, key, KINDS)


def _sides(value: Any) -> Kind | dict[str, Kind]:
    springs = isinstance(value, Mapping) and len(value) > 0 and set(value) <= SPRING_KEYS
    if isinstance(value, (str, Spring)) or springs:
        kind = _kind(value, "support.edge")
        if kind == "free":
            raise SceneError("support.edge: every side is free; hold at least one side")
        return kind
    if not isinstance(value, Mapping) or len(value) == 0:
        allowed = f"{' | '.join(KINDS)}, a table of springs, or a table of sides"
        raise v.wrong("support.edge", value, allowed)
    sides = {str(name): _kind(kind, f"support.{name}") for name, kind in value.items()}
    if all(kind == "free" for kind in sides.values()):
        raise SceneError("support.edge: every side is free; hold at least one side")
    return sides


@attrs.frozen
class Support:
    """How the film is held: one kind all around, or a table of kinds by side or tagged boundary.

    A kind is clamped, simply_supported, free or a `Spring` (in a scene file a table with its keys).
    Sides that a table does not name get its ``default``, and are free without one.
    """

    edge: Kind | Mapping[str, Kind] = v.custom("support.edge", _sides, default="clamped")

    @property
    def default(self) -> Kind:
        """Kind of the boundaries that have no entry of their own."""
        return self.edge.get("default", "free") if isinstance(self.edge, Mapping) else self.edge

    @property
    def named(self) -> dict[str, Kind]:
        """Kinds of the sides and tags that have an entry of their own."""
        sides = self.edge if isinstance(self.edge, Mapping) else {}
        return {name: kind for name, kind in sides.items() if name != "default"}

    @property
    def springs(self) -> list[Spring]:
        """Every elastic edge."""
        kinds = [self.default, *self.named.values()]
        return [kind for kind in kinds if isinstance(kind, Spring)]

    def kind(self, side: str) -> Kind:
        """clamped | simply_supported | free | Spring, of a side or tagged boundary."""
        return self.named.get(side, self.default)


STRING_ENDS = Support({"left": "clamped", "right": "clamped"})
