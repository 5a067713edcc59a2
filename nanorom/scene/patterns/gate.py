"""What an alternating voltage on a gate does, about the state that the gate holds the film in.

Of eps0 (V + v cos omega t)^2/2 (g - h - w)^-2 the terms constant and linear in the motion w at the
static height h; those of V^2 alone are in the model's own force, of every order that it has.  A
level is v; `nanorom.rom.patterns.driven` puts the square's harmonics together.
"""

from __future__ import annotations

import attrs

from nanorom.scene import fields as v
from nanorom.scene.gate import MOST
from nanorom.scene.patterns.pattern import (
    DirectPattern,
    Force,
    Operator,
    ParametricPattern,
    VirtualWork,
)

NUMBER = v.integer("drive.gate", 1, MOST, about="which gate of [load] alternates, else 1")


@attrs.frozen
class GateForce(DirectPattern):
    """int eps0/(g - h)^2 phi_r dA, the force by half the square of the voltage."""

    name = "gate"
    unit = "V"
    gate: int = attrs.field(default=1, metadata=NUMBER)

    def force(self, work: VirtualWork[Force, Operator]) -> Force:
        return work.attraction(self.gate)


@attrs.frozen
class GateStiffness(ParametricPattern):
    """int 2 eps0/(g - h)^3 phi_r phi_s dA, by which half the square of the voltage softens."""

    name = "gate"
    unit = "V"
    gate: int = attrs.field(default=1, metadata=NUMBER)

    def stiffness(self, work: VirtualWork[Force, Operator], force: Force) -> Operator:
        return work.softening(self.gate)
