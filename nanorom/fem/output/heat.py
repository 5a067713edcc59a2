"""The heat of a scene's laser for its reduced model: which thermal modes, and how they are fed."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from nanorom.fem.modes.eigen import Modes
from nanorom.fem.output.patterns import PolynomialWork
from nanorom.fem.scales import Scales
from nanorom.fem.tensors import heat as conduction
from nanorom.rom.heat import Heat
from nanorom.scene.patterns.laser import Laser
from nanorom.scene.patterns.pattern import Areal
from nanorom.scene.scene import Scene
from nanorom.types import Array

COUNT = 40  # slowest thermal modes that are looked at
KEPT = 12  # of them at most are states of the model
LEAST = 1e-3  # of the largest: what a state's share in the modulation has at least


@attrs.frozen
class _Absorbed(Areal):
    """Absorbed power per area of a laser of 1 W, which thermal modes are weighed with."""

    laser: Laser

    @property
    def centre(self) -> tuple[float, float]:
        return self.laser.centre

    @property
    def size(self) -> float:
        return self.laser.size

    @property
    def reach(self) -> float:
        return self.laser.reach

    def density(self, points: Array) -> Array:
        return self.laser.intensity(points)


def heat_of(scene: Scene, scales: Scales, modes: Modes, work: PolynomialWork) -> Heat | None:
    """Thermal modes of a scene's laser as states, slowest first; None without one. Collective."""
    if scene.drive is None or scene.drive.laser is None:
        return None
    laser: Any = scene.drive.pattern
    material, h = scene.material, scene.plate.thickness
    assert material.expansion is not None
    assert material.conductivity is not None and material.specific_heat is not None
    found = conduction.conduction(modes, COUNT)
    capacity = material.density * material.specific_heat * h  # per area and kelvin
    diffusivity = material.conductivity * h / capacity
    fed = attrs.evolve(work, modes=found.modes).areal(_Absorbed(laser))
    per_watt = 1 / (capacity * scales.length**2 * found.squares)
    feed, by_mode, by_pair = fed * per_watt, *work.weighed(_Absorbed(laser), found.modes)
    rate = diffusivity * found.modes.eigenvalues / scales.length**2
    unit = material.youngs_modulus * h * material.expansion
    stiffness, force = unit * found.stiffness, unit * work.deflection * found.force
    coupling = np.abs(stiffness).max(axis=(0, 1))
    # at the pace of the lowest mode, at which the tension is modulated or twice as fast
    pace = np.hypot(rate, 2 * np.pi * scales.frequency(modes.eigenvalues[:1]))
    shares = [np.abs(a * feed / pace) for a in (coupling, np.abs(force).max(axis=0))]
    share = sum(s / s.max() for s in shares if s.max() > 0)
    kept = np.sort(np.argsort(-share)[:KEPT])
    kept = kept[share[kept] > LEAST * share.max()]
    return Heat(
        rate=rate[kept],
        feed=feed[kept],
        stiffness=stiffness[..., kept],
        force=force[:, kept],
        feed_by_mode=(per_watt[:, None] * by_mode)[kept],
        feed_by_pair=(per_watt[:, None, None] * by_pair)[kept],
    )
