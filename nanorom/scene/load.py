"""The static load about whose equilibrium a scene is expanded: section [load]."""

from __future__ import annotations

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.gate import KEY, Gate, as_gates, read_gates
from nanorom.scene.region import Region

VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018


@attrs.frozen(field_transformer=v.readers)
class Load:
    """Loads that act together; all but gates are dead loads, positive towards positive w.

    pressure : uniform, in Pa; voltage and gap : of a plane gate at a distance from the flat film,
    which it attracts; gates : several, or below a part of the film, instead; force : in N, at
    ``position`` (from the film's centre, or in the mesh file's coordinates times its scale), spread
    over a disc of ``radius`` or concentrated in a point; stress : isotropic change of the film's
    stress in Pa, of a temperature change dT by -E alpha dT/(1 - nu) with alpha the expansion of the
    film relative to its frame's; moment : of the film's stress about its neutral plane, in N, which
    bows it where edges may turn: upwards at them where it is stretched above.
    """

    pressure: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("load.pressure", "Pa", v.ANY, about="uniform pressure"),
    )
    voltage: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("load.voltage", "V", v.ANY, about="of a plane gate"),
    )
    gap: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("load.gap", "m", about="of the gate from the flat film"),
    )
    gates: tuple[Gate, ...] | None = attrs.field(
        default=None,
        converter=as_gates,
        metadata=v.custom(
            KEY,
            read_gates,
            allowed=f"tables [[{KEY}]]",
            about="gates below parts of the film, or on both sides, instead of voltage and gap",
        ),
    )
    force: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("load.force", "N", v.ANY, about="a force"),
    )
    position: tuple[float, float] = attrs.field(
        default=(0.0, 0.0),
        converter=v.as_quantities,
        metadata=v.place("load.position", about="x and y of the force in m"),
    )
    radius: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "load.radius",
            "m",
            v.NOT_NEGATIVE,
            about="of the disc over which the force is spread; 0: a point",
        ),
    )

    stress: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "load.stress", "Pa", v.ANY, about="change of the film's stress, as by temperature"
        ),
    )

    moment: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "load.moment", "N", v.ANY, about="of the stress about the neutral plane, per length"
        ),
    )

    def __attrs_post_init__(self) -> None:
        loads = (self.pressure, self.voltage, self.force, self.stress, self.moment)
        if all(load is None for load in loads) and self.gap is None and self.gates is None:
            raise SceneError(
                "load: no load in it; allowed: pressure, voltage with gap, gates, force, stress, "
                "moment"
            )
        if self.gates is not None and (self.gap, self.voltage) != (None, None):
            raise SceneError(
                f"{KEY}: found beside load.voltage and load.gap, which are a gate below all of the "
                "film; allowed: one of the two"
            )
        if (self.voltage is None) != (self.gap is None):
            missing = "gap" if self.gap is None else "voltage"
            raise SceneError(f"load.{missing}: missing; a gate needs voltage and gap")
        if self.force is None and (self.position != (0.0, 0.0) or self.radius > 0):
            raise SceneError("load.force: missing; position and radius are those of a force")

    @property
    def deflects(self) -> bool:
        """It acts across the film; else it changes the stress in its plane alone."""
        across = (self.pressure, self.voltage, self.gates, self.force, self.moment)
        return any(load is not None for load in across)

    @property
    def electrodes(self) -> tuple[Gate, ...]:
        """All gates; that of voltage and gap is one."""
        if self.gap is not None and self.voltage is not None:
            return (Gate(self.gap, self.voltage),)
        return self.gates or ()

    def level(self, quantity: str) -> float | None:
        """What a key says in SI, by which all loads rise; of gates the first voltage not 0."""
        if quantity == "voltage" and self.gates is not None:
            return next((gate.voltage for gate in self.gates if gate.voltage), None)
        found: float | None = getattr(self, quantity)
        return found

    def risen(self, quantity: str, value: float) -> Load:
        """With another value of a key in SI; all gates in proportion to the one of `level`."""
        if quantity != "voltage" or self.gates is None:
            return attrs.evolve(self, **{quantity: value})
        share = value / (self.level(quantity) or 1.0)
        gates = [attrs.evolve(gate, voltage=share * gate.voltage) for gate in self.gates]
        return attrs.evolve(self, gates=gates)

    @property
    def patches(self) -> tuple[Region, ...]:
        """Outlines of the gates that lie below a part of the film."""
        return tuple(gate.patch for gate in self.electrodes if gate.patch is not None)

    @property
    def centred(self) -> bool:
        """The load has every mirror that the film and the patches have."""
        return self.force is None or self.position == (0.0, 0.0)
