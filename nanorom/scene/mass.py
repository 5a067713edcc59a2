"""Masses that sit on the film: particles, pads, tips. Sections [[mass]]."""

from __future__ import annotations

import attrs

from nanorom.scene import fields as v


@attrs.frozen(field_transformer=v.readers)
class AddedMass:
    """A mass, its value in kg, that moves with the film and does not stiffen it.

    position : x and y in m from the film's centre, or in the mesh file's coordinates times its
    scale; radius : of the disc over which it is spread evenly, 0 for a point.
    """

    value: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("mass.value", "kg", about="the mass")
    )
    position: tuple[float, float] = attrs.field(
        default=(0.0, 0.0),
        converter=v.as_quantities,
        metadata=v.place("mass.position", about="x and y of its centre in m"),
    )
    radius: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "mass.radius",
            "m",
            v.NOT_NEGATIVE,
            about="of the disc over which it is spread evenly; 0: a point, on a film that bends",
        ),
    )

    @property
    def centred(self) -> bool:
        """It has every mirror that the film has."""
        return self.position == (0.0, 0.0)
