"""Parts of a film where it is another one: pads, thinned rings, electrodes. Sections [[region]].

A region is a uniform film of its own: thickness, stiffness, mass and tension in place of the
film's.  Layers added to the film there, or taken from it, are one way to say so.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import attrs
import numpy as np

from nanorom.scene import elasticity, units
from nanorom.scene import fields as v
from nanorom.scene.film import Plate, Tension
from nanorom.scene.material import Material
from nanorom.types import Array


def _tension(value: Any) -> tuple[float, ...]:
    found = v.read_quantities(value, "N/m", "region.tension")
    if len(found) > 3:
        raise units.wrong("region.tension", value, "one value, or x and y, or x, y and xy")
    return found


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class Region:
    """What the film is in a part of it; what is left out is that of the film.

    thickness in m (of the film's own material about its own middle plane, unless more is said);
    youngs_modulus in Pa, poisson_ratio, density in kg/m^3; bending : stiffness in N m, and
    bending_ratio : Poisson's ratio of it, where they do not follow from these; tension : in N/m,
    one value, or x and y, or x, y and xy, by default the film's stress times the thickness here;
    loss : E''/E' of the bent film; offset : height in m of the neutral plane above the film's.
    """

    shape: ClassVar[str]
    thickness: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("region.thickness", "m", about="of the film there"),
    )
    youngs_modulus: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("region.youngs_modulus", "Pa", about="of the film there"),
    )
    poisson_ratio: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "region.poisson_ratio", "1", v.within(-1, 0.5), about="of the film there"
        ),
    )
    density: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("region.density", "kg/m^3", about="of the film there"),
    )
    bending: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("region.bending", "J", about="bending stiffness D there"),
    )
    bending_ratio: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "region.bending_ratio", "1", v.within(-1, 0.5), about="Poisson's ratio of bending there"
        ),
    )
    tension: tuple[float, ...] | None = attrs.field(
        default=None,
        converter=v.as_optional_quantities,
        metadata=v.custom(
            "region.tension",
            _tension,
            allowed="one value, or x and y, or x, y and xy",
            about="before it relaxes; by default the film's stress times the thickness there",
            unit="N/m",
        ),
    )
    loss: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("region.loss", "1", v.SHARE, about="E''/E' of the film there"),
    )
    offset: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "region.offset", "m", v.ANY, about="of its neutral plane above the film's"
        ),
    )

    @property
    def area(self) -> float | None:
        """In m^2; None where a file has it."""
        return None

    @property
    def radii(self) -> tuple[float, ...]:
        """Of its circles, in m."""
        return ()

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Of its outline, in m."""
        return ()

    @property
    def mirrored(self) -> tuple[bool, bool]:
        """Whether it is its own mirror image in x and in y."""
        return False, False

    @property
    def of_revolution(self) -> bool:
        """Every turn about the film's centre leaves it as it is."""
        return False

    @property
    def is_square(self) -> bool:
        """It stays as it is when x and y change places."""
        return self.of_revolution

    @property
    def pulls_alike(self) -> bool:
        """Its own tension, if it has one, is the same along x and y."""
        return self.tension is None or len(self.tension) == 1 or self.tension[0] == self.tension[1]

    @property
    def sheared(self) -> bool:
        """Its own tension has no mirrors."""
        return self.tension is not None and len(self.tension) == 3 and self.tension[2] != 0

    def pull(self, film: Tension, thickness: float) -> Array:
        """Tension (x, y, xy) in N/m before it relaxes, in a film of a tension and thickness."""
        if self.tension is None:
            share = (self.thickness or thickness) / thickness
            return share * np.array([film.x, film.y, film.xy])
        x, y, xy = (*self.tension, *(self.tension[0], 0.0)[len(self.tension) - 1 :])
        return np.array([x, y, xy])


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class DrawnRegion(Region, ABC):
    """A region whose outline the scene has, not the mesh file."""

    @abstractmethod
    def depth(self, points: Array) -> Array:
        """Distance-like numbers (n,) of points (n, 2): positive in it, negative outside, in m."""

    @abstractmethod
    def outline(self) -> Array:
        """Points (n, 2) in m on its edges, its corners among them."""


@attrs.frozen(eq=False)
class Section:
    """The film in a region, by the film elsewhere.

    law, moments : (3, 3) stress and moments of strain and curvature (xx, yy, 2 xy), by E h and D of
    the film; mass : per area by its; tension : (x, y, xy) in N/m; loss : E''/E' of the bent film.
    """

    law: Array
    moments: Array
    mass: float
    tension: Array
    loss: float

    @classmethod
    def of(cls, region: Region, plate: Plate, material: Material, tension: Tension) -> Section:
        """Of a region in a film."""
        h = plate.thickness
        thick = region.thickness or h
        nu = material.poisson_ratio if region.poisson_ratio is None else region.poisson_ratio
        e, density = region.youngs_modulus or material.youngs_modulus, region.density
        there = attrs.evolve(material, youngs_modulus=e, poisson_ratio=nu, bending=None)
        law = np.array(there.law) * (e * thick / (material.youngs_modulus * h))
        ratio = nu if region.bending_ratio is None else region.bending_ratio
        shape = elasticity.isotropic_moments(ratio)
        if material.crystalline:
            shape = elasticity.scaled(material.law, material.held_ratio)
        alone = attrs.evolve(material, bending=None).bending_stiffness(h)
        bending = there.bending_stiffness(thick) / alone  # a film whose D is given grows as a plate
        if region.bending is not None:
            bending = region.bending / material.bending_stiffness(h)
        return cls(
            law=law,
            moments=np.array(shape) * bending,
            mass=(density or material.density) * thick / (material.density * h),
            tension=region.pull(tension, h),
            loss=material.loss if region.loss is None else region.loss,
        )


def overlap(first: Region, second: Region, close: float) -> bool:
    """Whether two regions have an area in common, as far as points on their outlines tell."""
    if not (isinstance(first, DrawnRegion) and isinstance(second, DrawnRegion)):
        return False  # the mesh tells
    for one, other in ((first, second), (second, first)):
        outline = one.outline()
        if (other.depth(outline) > close).any():
            return True
        # outlines that are the same: a point just inside one of them tells
        inner = outline + 1e3 * close * _inwards(one, outline, 1e3 * close)
        if (np.minimum(one.depth(inner), other.depth(inner)) > close).any():
            return True
    return False


def _inwards(region: DrawnRegion, outline: Array, step: float) -> Array:
    """Unit vectors (n, 2) from an outline into its region, zero where none of eight is."""
    found = np.zeros_like(outline)
    for angle in np.pi / 4 * np.arange(8):
        way = np.array([np.cos(angle), np.sin(angle)])
        inside = region.depth(outline + step * way) > 0.3 * step
        found[inside] = way
    return found
