"""Modulations of the stiffness."""

from __future__ import annotations

import attrs

from nanorom.scene.patterns.pattern import Proportional, Stretch


@attrs.frozen
class TensionModulation(Stretch):
    """An isotropic modulation of the tension; its level is the amplitude in N/m."""

    name = "tension"
    unit = "N/m"


@attrs.frozen
class PaperModulation(Proportional):
    """F_r = J_r q_r gamma cos(omega t) of Keskekler et al.; its level is gamma in Pa/m."""

    name = "paper"
    unit = "Pa/m"
