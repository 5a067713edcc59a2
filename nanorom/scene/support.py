"""How the edge of a film is held, out of its plane and in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.units import wrong

KINDS = ("clamped", "simply_supported", "free")
IN_PLANE = ("fixed", "normal", "tangential", "free")
SPRING_KEYS = {"spring", "rotational"}
EDGE_KEYS = {"w", "in_plane"}


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


def _deflection(value: Any) -> str | Spring:
    return _transverse(value, "support.w")


def _transverse(value: Any, key: str) -> str | Spring:
    if isinstance(value, Spring):
        return value
    if isinstance(value, Mapping) and len(value) > 0:
        return v.from_table(Spring, key, value)
    return v.read_choice(value, key, KINDS)


@attrs.frozen(field_transformer=v.readers)
class PlaneSpring:
    """Stiffness of an edge against displacements in the plane, normal and tangential to it.

    In N/m^2: force per length of the edge and displacement; 0: free.
    """

    normal: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "support.in_plane.normal",
            "N/m^2",
            v.NOT_NEGATIVE,
            about="stiffness in the plane across the edge, per length of the edge",
        ),
    )
    tangential: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "support.in_plane.tangential",
            "N/m^2",
            v.NOT_NEGATIVE,
            about="stiffness in the plane along the edge, per length of the edge",
        ),
    )


def _in_plane(value: Any) -> str | PlaneSpring:
    key = "support.in_plane"
    if isinstance(value, PlaneSpring):
        return value
    if isinstance(value, Mapping) and len(value) > 0:
        return v.from_table(PlaneSpring, key, value)
    if isinstance(value, str) and value in IN_PLANE:
        return value
    if isinstance(value, str):
        return v.read_choice(value, key, IN_PLANE)
    raise wrong(key, value, f"{' | '.join(IN_PLANE)}, or a table of normal and tangential")


@attrs.frozen(field_transformer=v.readers)
class Edge:
    """An edge whose in-plane support is stated beside the one of its deflection.

    w : clamped, simply_supported, free or a `Spring`; in_plane : which displacements in the plane
    are held: both (fixed), the one across the edge (normal) or along it (tangential), none (free),
    or a `PlaneSpring`.
    """

    w: str | Spring = attrs.field(
        metadata=v.custom(
            "support.w",
            _deflection,
            allowed="clamped | simply_supported | free, or a table of springs",
            about="how the deflection is held, where in_plane stands beside it",
        ),
    )
    in_plane: str | PlaneSpring = attrs.field(
        metadata=v.custom(
            "support.in_plane",
            _in_plane,
            allowed="fixed | normal | tangential | free, or a table of normal and tangential",
            about="which displacements in the plane are held: both, across the edge, along it, "
            "none, or elastically",
        ),
    )

    @property
    def kind(self) -> Kind:
        """The same in one word, where there is one."""
        if self.in_plane == "fixed" and self.w != "free" or self.in_plane == self.w == "free":
            return self.w
        return self


Kind = str | Spring | Edge


def deflection_of(kind: Kind) -> str | Spring:
    """How a kind of support holds the deflection."""
    return kind.w if isinstance(kind, Edge) else kind


def in_plane_of(kind: Kind) -> str | PlaneSpring:
    """How a kind of support holds the film in its plane; what holds the deflection holds it too."""
    if isinstance(kind, Edge):
        return kind.in_plane
    return "free" if kind == "free" else "fixed"


def _kind(value: Any, key: str) -> Kind:
    if isinstance(value, Edge):
        return value.kind
    if isinstance(value, Mapping) and EDGE_KEYS & set(value):
        return v.from_table(Edge, key, value).kind
    return _transverse(value, key)


def _sides(value: Any) -> Kind | dict[str, Kind]:
    one = isinstance(value, Mapping) and bool(value) and set(value) <= SPRING_KEYS | EDGE_KEYS
    if isinstance(value, (str, Spring, Edge)) or one:
        return _kind(value, "support.edge")
    if not isinstance(value, Mapping) or len(value) == 0:
        allowed = f"{' | '.join(KINDS)}, a table of springs, or a table of sides"
        raise wrong("support.edge", value, allowed)
    return {str(name): _kind(kind, f"support.{name}") for name, kind in value.items()}


@attrs.frozen(field_transformer=v.readers)
class Support:
    """How the film is held: one kind all around, or a table of kinds by side or tagged boundary.

    A kind is clamped, simply_supported, free, a `Spring` or an `Edge` (in a scene file a table with
    their keys).  All but an `Edge` hold the film in its plane wherever they hold its deflection.
    Sides that a table does not name get its ``default``, and are free without one.  impedance : of
    what holds them, in N s/m^2 (force per length of the edge and velocity); None: it does not move.
    """

    edge: Kind | Mapping[str, Kind] = attrs.field(
        default="clamped",
        metadata=v.custom(
            "support.edge",
            _sides,
            allowed="clamped | simply_supported | free, a table of springs or of w and in_plane, "
            "or a table of sides",
            about="how the edge is held: one kind all around, or a table of kinds by side"
            " or physical curve, with a `default` for the rest",
        ),
    )
    impedance: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "support.impedance",
            "N*s/m^2",
            about="of the frame, per length of the edge: force by the velocity at which it gives "
            "way, which takes energy out of the film",
        ),
    )

    @classmethod
    def from_table(cls, table: Mapping[str, Any], shape: str) -> Support:
        """Read [support] of a shape; raises SceneError, and says how to write a side's name."""
        known = [each.name for each in attrs.fields(cls)]
        beside = [key for key in table if key not in known]
        if not beside:
            usual = {"edge": STRING_ENDS.edge} if shape == "string" else {}
            return v.from_table(cls, "support", usual | table)
        key = v.did_you_mean(beside[0], known) or f"; write edge = {{ {beside[0]} = ... }}"
        raise SceneError(f"support.{beside[0]}: unknown key{key}; allowed: {', '.join(known)}")

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
        return [kind for kind in map(deflection_of, self.kinds) if isinstance(kind, Spring)]

    @property
    def kinds(self) -> list[Kind]:
        """Every kind that it names."""
        return [self.default, *self.named.values()]

    @property
    def free(self) -> bool:
        """Nothing holds the film."""
        return all(kind == "free" for kind in self.kinds)

    def kind(self, side: str) -> Kind:
        """clamped | simply_supported | free | Spring | Edge, of a side or tagged boundary."""
        return self.named.get(side, self.default)


STRING_ENDS = Support({"left": "clamped", "right": "clamped"})
