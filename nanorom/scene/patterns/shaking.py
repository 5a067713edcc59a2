"""A frame that is shaken: piezo actuators, vibration, an accelerometer's own signal."""

from __future__ import annotations

import attrs

from nanorom.scene.patterns.pattern import DirectPattern, Force, Operator, VirtualWork


@attrs.frozen
class Shaking(DirectPattern):
    """The acceleration of all supports along z, its level in m/s^2.

    In the frame that moves with them every mass is pushed the other way: J_r = -int m phi_r dA,
    with masses that sit on the film; deflections are relative to the frame.
    """

    name = "acceleration"
    unit = "m/s^2"

    def force(self, work: VirtualWork[Force, Operator]) -> Force:
        return work.inertia()
