"""How the edge of a film is held."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.units import wrong

KINDS = ("clamped", "simply_supported", "free")
SPRING_KEYS = {"spring", "rotational"}


@attrs.frozen(field_transformer=v.readers)
class Spring:
    """An edge that cannot move in the plane and is held elastically out of it.

    spring : transverse, in N/m^2 (force per length of the edge and displacement), None: held;
    rotational : in N (moment per length and angle), 0: free to rotate.
    """

    spring: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "support.spring",
            "N/m^2",
            about="stiffness against deflection per length of the edge; without it the "
            "edge cannot deflect",
        ),
    )
    rotational: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "support.rotational",
            "N",
            v.NOT_NEGATIVE,
            about="stiffness against turning per length of the edge",
        ),
    )


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
        raise wrong("support.edge", value, allowed)
    sides = {str(name): _kind(kind, f"support.{name}") for name, kind in value.items()}
    if all(kind == "free" for kind in sides.values()):
        raise SceneError("support.edge: every side is free; hold at least one side")
    return sides


@attrs.frozen(field_transformer=v.readers)
class Support:
    """How the film is held: one kind all around, or a table of kinds by side or tagged boundary.

    A kind is clamped, simply_supported, free or a `Spring` (in a scene file a table with its keys).
    Sides that a table does not name get its ``default``, and are free without one.
    """

    edge: Kind | Mapping[str, Kind] = attrs.field(
        default="clamped",
        metadata=v.custom(
            "support.edge",
            _sides,
            allowed="clamped | simply_supported | free, a table of springs, or a table of sides",
            about="how the edge is held: one kind all around, or a table of kinds by side"
            " or physical curve, with a `default` for the rest",
        ),
    )

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Support:
        """Read [support]; raises SceneError, with what to write for a side beside ``edge``."""
        beside = [key for key in table if key != "edge"]
        if not beside:
            return v.from_table(cls, "support", table)
        key = v.did_you_mean(beside[0], ["edge"]) or f"; write edge = {{ {beside[0]} = ... }}"
        raise SceneError(f"support.{beside[0]}: unknown key{key}; allowed: edge")

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
