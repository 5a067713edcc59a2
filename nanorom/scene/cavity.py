"""Light between a film and a mirror: how much of it the film absorbs depends on where it is."""

from __future__ import annotations

import math
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v

KEY = "drive.cavity"
ALLOWED = 'a table such as { wavelength = "633 nm", gap = "300 nm", contrast = 0.5 }'
DARK = 1e-6  # of the mean of a standing wave: a film that absorbs no more has no share to refer to


@attrs.frozen(field_transformer=v.readers)
class Cavity:
    """A standing wave that a film absorbs from: by what it absorbs at rest,

        (1 + contrast cos(phase + 4 pi (gap + w)/wavelength)) / (the same at w = 0)

    of a deflection w in m from the state under the light's mean power (Metzger and Karrai, Nature
    432, 2004, doi:10.1038/nature03118). Raises SceneError for a film at rest in the dark.
    """

    wavelength: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(f"{KEY}.wavelength", "m", about="of the light"),
    )
    contrast: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(
            f"{KEY}.contrast",
            "1",
            ("greater than 0 and at most 1", lambda x: 0 < x <= 1),
            about="of the standing wave: 1 where its nodes are dark",
        ),
    )
    gap: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(f"{KEY}.gap", "m", v.ANY, about="of the film at rest from the mirror"),
    )
    phase: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(f"{KEY}.phase", "rad", v.ANY, about="of the standing wave at no gap"),
    )

    def __attrs_post_init__(self) -> None:
        if self._wave[0] < DARK:
            raise SceneError(
                f"{KEY}: the film rests in a dark node of the light and absorbs nothing; allowed: "
                "another gap or phase, or less contrast"
            )

    @property
    def _wave(self) -> tuple[float, float, float]:
        """Intensity by its mean where the film is at rest, and its first two derivatives."""
        k = 4 * math.pi / self.wavelength
        at_rest = k * self.gap + self.phase
        real, imaginary = (self.contrast * f(at_rest) for f in (math.cos, math.sin))
        return 1 + real, -k * imaginary, -(k**2) * real

    @property
    def slopes(self) -> tuple[float, float]:
        """First and second derivative, in 1/m and 1/m^2, of what is absorbed by that at rest."""
        value, first, second = self._wave
        return first / value, second / value


def read_cavity(value: Any) -> Cavity:
    """A cavity from a table of a file, or as it is; raises SceneError."""
    return value if isinstance(value, Cavity) else v.from_table(Cavity, KEY, value)
