"""A laser of modulated power, whose absorbed part heats the film and strains it."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.scene import fields as v
from nanorom.scene.cavity import ALLOWED, KEY, Cavity, read_cavity
from nanorom.scene.patterns.spot import Spot
from nanorom.types import Array

SPEED_OF_LIGHT = 299792458.0  # m/s


@attrs.frozen
class Laser(Spot):
    """Light of power P0 + P1 cos(omega t) in a Gaussian spot, P1 its level in W.

    What is absorbed heats the film: `nanorom.rom.heat`.  The pressure is that of absorbed photons.
    power : P0 in W; absorption : share of the light that the film takes; cavity : how that share
    changes with the film's deflection, which makes P0 a feedback on the film's motion.
    """

    name = "laser"
    unit = "W"

    power: float = attrs.field(
        eq=False,  # what light of a watt does is the same
        metadata=v.quantity("drive.power", "W", about="mean power of a laser"),
    )
    absorption: float = attrs.field(
        metadata=v.quantity(
            "drive.absorption",
            "1",
            ("greater than 0 and at most 1", lambda x: 0 < x <= 1),
            about="share of the light that the film absorbs",
        )
    )
    cavity: Cavity | None = attrs.field(
        default=None,
        eq=False,  # heat is known for any
        metadata=v.custom(
            KEY,
            read_cavity,
            allowed=ALLOWED,
            about="mirror below the film, if what it absorbs depends on where it is",
        ),
    )

    def intensity(self, points: Array) -> Array:
        """Absorbed power per area (n,) in 1/m^2 of the laser's at points (n, 2) in m."""
        peak = 2 * self.absorption / (np.pi * self.radius**2)
        return np.asarray(peak * super().density(points))

    def density(self, points: Array) -> Array:
        return self.intensity(points) / SPEED_OF_LIGHT
