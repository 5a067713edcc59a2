"""Shapes of regions, and how a table [[region]] is read: the word of its shape decides."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units
from nanorom.scene.region import DrawnRegion, Region
from nanorom.scene.units import with_unit
from nanorom.types import Array

ON_CIRCLE = 256  # points that stand for a circle where regions are compared
ON_SIDE = 64  # the same of a straight side
MOST_CORNERS = 200


def _position(about: str) -> Any:
    return attrs.field(
        default=(0.0, 0.0),
        converter=v.as_quantities,
        metadata=v.place("region.position", about=about),
    )


def _length(key: str, about: str, **default: Any) -> Any:
    return attrs.field(
        **default, converter=v.as_quantity, metadata=v.quantity(f"region.{key}", "m", about=about)
    )


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class DiscRegion(DrawnRegion):
    """A disc of a radius about a position, in m.

    The film there, as of `Region`: thickness in m, youngs_modulus in
    Pa, poisson_ratio, density in kg/m^3, bending in N m, bending_ratio, tension in N/m, loss and
    offset in m.
    """

    shape: ClassVar[str] = "disc"
    position: tuple[float, float] = _position("x and y of its centre in m")
    radius: float = _length("radius", "of the disc")

    def depth(self, points: Array) -> Array:
        """Numbers (n,) of points (n, 2): positive in it, in m."""
        return self.radius - np.hypot(*(points - np.array(self.position)).T)

    def outline(self) -> Array:
        """Points (n, 2) in m on its edges."""
        return _circle(self.position, self.radius)

    @property
    def area(self) -> float:
        """In m^2."""
        return math.pi * self.radius**2

    @property
    def mirrored(self) -> tuple[bool, bool]:
        """Whether it is its own mirror image in x and in y."""
        return self.position[0] == 0, self.position[1] == 0

    @property
    def of_revolution(self) -> bool:
        """Every turn about the film's centre leaves it as it is."""
        return self.position == (0.0, 0.0) and self.pulls_alike

    @property
    def radii(self) -> tuple[float, ...]:
        """Of its circles, in m."""
        return (self.radius,)


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class RingRegion(DiscRegion):
    """Between two circles about a position, in m.

    radius, inner_radius : of the circles. The film there, as of `Region`: thickness in m,
    youngs_modulus in Pa, poisson_ratio, density in kg/m^3, bending in N m, bending_ratio, tension
    in N/m, loss and offset in m.
    """

    shape: ClassVar[str] = "ring"
    inner_radius: float = _length("inner_radius", "of the circle inside")

    def __attrs_post_init__(self) -> None:
        if not self.inner_radius < self.radius:
            raise SceneError(
                f"region.inner_radius: found {with_unit(self.inner_radius, 'm', 6)}; allowed: less "
                f"than region.radius, {with_unit(self.radius, 'm', 6)}"
            )

    def depth(self, points: Array) -> Array:
        """Numbers (n,) of points (n, 2): positive in it, in m."""
        outer = super().depth(points)
        return np.minimum(outer, self.radius - self.inner_radius - outer)

    def outline(self) -> Array:
        """Points (n, 2) in m on its edges."""
        return np.concatenate([super().outline(), _circle(self.position, self.inner_radius)])

    @property
    def area(self) -> float:
        """In m^2."""
        return math.pi * (self.radius**2 - self.inner_radius**2)

    @property
    def radii(self) -> tuple[float, ...]:
        """Of its circles, in m."""
        return self.inner_radius, self.radius


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class RectangleRegion(DrawnRegion):
    """A rectangle about a position, its sides along x and y, in m.

    length along x, width along y. The film there, as of `Region`: thickness in m, youngs_modulus in
    Pa, poisson_ratio, density in kg/m^3, bending in N m, bending_ratio, tension in N/m, loss and
    offset in m.
    """

    shape: ClassVar[str] = "rectangle"
    position: tuple[float, float] = _position("x and y of its centre in m")
    length: float = _length("length", "along x")
    width: float = _length("width", "along y")

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Of its outline, in m."""
        (x, y), a, b = self.position, self.length / 2, self.width / 2
        return (x - a, y - b), (x + a, y - b), (x + a, y + b), (x - a, y + b)

    def depth(self, points: Array) -> Array:
        """Numbers (n,) of points (n, 2): positive in it, in m."""
        away = np.abs(points - np.array(self.position))
        return np.min(np.array([self.length, self.width]) / 2 - away, axis=1)

    def outline(self) -> Array:
        """Points (n, 2) in m on its edges."""
        return _sides(self.corners)

    @property
    def area(self) -> float:
        """In m^2."""
        return self.length * self.width

    @property
    def mirrored(self) -> tuple[bool, bool]:
        """Whether it is its own mirror image in x and in y."""
        return self.position[0] == 0, self.position[1] == 0

    @property
    def is_square(self) -> bool:
        """It stays as it is when x and y change places."""
        return self.position == (0.0, 0.0) and self.length == self.width and self.pulls_alike


def _corners(value: Any) -> tuple[tuple[float, float], ...]:
    key = "region.points"
    if not v.is_list(value) or not 3 <= len(value) <= MOST_CORNERS:
        raise units.wrong(key, value, f"a list of 3 to {MOST_CORNERS} corners, each x and y")
    return tuple(v.read_place(each, f"{key}[{n}]") for n, each in enumerate(value, 1))


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class PolygonRegion(DrawnRegion):
    """Within straight sides between corners, in their order, in m.

    points : the corners (n, 2). The film there, as of `Region`: thickness in m, youngs_modulus in
    Pa, poisson_ratio, density in kg/m^3, bending in N m, bending_ratio, tension in N/m, loss and
    offset in m.
    """

    shape: ClassVar[str] = "polygon"
    points: tuple[tuple[float, float], ...] = attrs.field(
        converter=tuple,
        metadata=v.custom(
            "region.points",
            _corners,
            allowed=f"a list of 3 to {MOST_CORNERS} corners, each x and y",
            about="its corners in m, one after the other",
        ),
    )

    def __attrs_post_init__(self) -> None:
        if _crosses(np.array(self.points)) or not self.area > 0:
            raise SceneError(
                "region.points: found sides that meet; allowed: corners in their order around an "
                "area, each once"
            )

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Of its outline, in m."""
        return self.points

    def depth(self, points: Array) -> Array:
        """Numbers (n,) of points (n, 2): positive in it, in m."""
        a = np.array(self.points)
        b = np.roll(a, -1, axis=0)
        side, to = b - a, points[:, None] - a
        along = np.clip(np.einsum("nkd,kd->nk", to, side) / np.sum(side**2, axis=1), 0, 1)
        distance = np.hypot(*np.moveaxis(to - along[..., None] * side, 2, 0)).min(axis=1)
        y = points[:, None, 1]
        crossed = (a[:, 1] > y) != (b[:, 1] > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = a[:, 0] + (y - a[:, 1]) * side[:, 0] / side[:, 1]
        inside = (crossed & (points[:, None, 0] < at)).sum(axis=1) % 2 == 1
        return np.where(inside, distance, -distance)

    def outline(self) -> Array:
        """Points (n, 2) in m on its edges."""
        return _sides(self.points)

    @property
    def area(self) -> float:
        """In m^2."""
        x, y = np.array(self.points).T
        return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2)


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class SurfaceRegion(Region):
    """A physical surface of the mesh file.

    surface : its name. The film there, as of `Region`: thickness in m, youngs_modulus in
    Pa, poisson_ratio, density in kg/m^3, bending in N m, bending_ratio, tension in N/m, loss and
    offset in m.
    """

    shape: ClassVar[str] = "surface"
    surface: str = attrs.field(
        metadata=v.custom(
            "region.surface", str, allowed="a name", about="of a physical surface of the mesh file"
        )
    )


REGIONS: dict[str, type[Region]] = {
    "disc": DiscRegion,
    "ring": RingRegion,
    "rectangle": RectangleRegion,
    "polygon": PolygonRegion,
    "surface": SurfaceRegion,
}


def _circle(centre: tuple[float, float], radius: float) -> Array:
    angle = 2 * np.pi * np.arange(ON_CIRCLE) / ON_CIRCLE
    return np.array(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _sides(corners: tuple[tuple[float, float], ...]) -> Array:
    a = np.array(corners)
    side = np.roll(a, -1, axis=0) - a
    share = np.arange(ON_SIDE) / ON_SIDE
    return (a[:, None] + share[:, None] * side[:, None]).reshape(-1, 2)


def _crosses(corners: Array) -> bool:
    """Whether two sides of a polygon meet elsewhere than at the corner between them."""
    a, b, n = corners, np.roll(corners, -1, axis=0), len(corners)

    def left(p: Array, q: Array, r: Array) -> Any:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    for i in range(n):
        for j in range(i + 2, n - (i == 0)):
            first = left(a[i], b[i], a[j]) * left(a[i], b[i], b[j])
            second = left(a[j], b[j], a[i]) * left(a[j], b[j], b[i])
            if first <= 0 and second <= 0:
                return True
    return False
