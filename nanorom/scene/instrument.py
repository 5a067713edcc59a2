"""What turns the film's motion into a voltage: section [readout]."""

from __future__ import annotations

import math

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.types import Array

MILLIWATT = 1e-3  # W, of which dBm are


@attrs.frozen(field_transformer=v.readers)
class Instrument:
    """A detector's voltage of a deflection w: along a fringe, or along its slope.

    Light that a film over a mirror throws back makes offset + contrast cos(phase + 4 pi (gap + w)/
    wavelength) V, gap being that of the film at rest (Dolleman et al. 2017, arXiv:1711.06056).
    Close to one working point it is slope x w.  position : of the spot in m; impedance : in V/A,
    across which the voltage makes a power.  Raises SceneError.
    """

    wavelength: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("readout.wavelength", "m", about="of the light"),
    )
    contrast: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "readout.contrast", "V", about="half of the voltage between dark and bright fringes"
        ),
    )
    gap: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "readout.gap", "m", v.ANY, about="of the film at rest from what reflects below it"
        ),
    )
    phase: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity("readout.phase", "rad", v.ANY, about="of the fringe at no gap"),
    )
    offset: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity("readout.offset", "V", v.ANY, about="mean voltage of the fringes"),
    )
    slope: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "readout.slope", "V/m", v.ANY, about="in the place of a fringe: volts per metre"
        ),
    )
    position: tuple[float, float] | None = attrs.field(
        default=None,
        converter=v.as_optional_quantities,
        metadata=v.place("readout.position", about="x and y of the spot in m"),
    )
    impedance: float = attrs.field(
        default=50.0,
        converter=v.as_quantity,
        metadata=v.quantity("readout.impedance", "ohm", about="across which dBm are counted"),
    )

    def __attrs_post_init__(self) -> None:
        fringe = (self.wavelength, self.contrast)
        if self.slope is not None and fringe != (None, None):
            raise SceneError("readout.slope: found beside wavelength or contrast; allowed: alone")
        if self.slope is None and None in fringe:
            missing = "wavelength" if self.wavelength is None else "contrast"
            raise SceneError(
                f"readout.{missing}: missing; allowed: wavelength and contrast, or slope"
            )

    @property
    def wave(self) -> float:
        """Fringe's phase by deflection, 4 pi by the wavelength, in 1/m; 0 of a slope."""
        return 0.0 if self.wavelength is None else 4 * math.pi / self.wavelength

    @property
    def responsivity(self) -> float:
        """Of small deflections in V/m."""
        if self.slope is not None:
            return self.slope
        assert self.contrast is not None
        return -self.contrast * self.wave * math.sin(self.wave * self.gap + self.phase)

    def volts(self, deflection: Array) -> Array:
        """Voltage (...) of deflections (...) in m."""
        if self.slope is not None:
            return self.slope * deflection + self.offset
        assert self.contrast is not None
        phase = self.wave * (self.gap + deflection) + self.phase
        return np.asarray(self.offset + self.contrast * np.cos(phase))

    def dbm(self, amplitude: Array) -> Array:
        """Power (...) in dB of 1 mW of a sine of an amplitude (...) in V."""
        power = np.maximum(np.asarray(amplitude) ** 2 / (2 * self.impedance), 1e-300)
        return np.asarray(10 * np.log10(power / MILLIWATT))
