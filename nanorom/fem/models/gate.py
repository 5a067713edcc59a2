"""Electrostatic attraction by a gate below the film."""

from __future__ import annotations

from typing import Any

import attrs
from dolfinx import fem


@attrs.frozen
class Attraction:
    """Electrostatic attraction to a plane gate at a distance above the flat film.

    Parallel plates at height h per area: potential strength/2 / (gap - h), pressure its derivative;
    strength is eps0 V^2.
    """

    gap: Any
    strength: Any

    def on(self, mesh: Any) -> Attraction:
        """The same with constants that a compiled form can be given anew."""
        return Attraction(fem.Constant(mesh, self.gap), fem.Constant(mesh, self.strength))

    def potential(self, height: Any) -> Any:
        """Work done up to a height (UFL or number), but for a constant."""
        return 0.5 * self.strength / (self.gap - height)

    def stiffness(self, height: Any) -> Any:
        """Second derivative of the potential; it softens the film."""
        return self.strength / (self.gap - height) ** 3
