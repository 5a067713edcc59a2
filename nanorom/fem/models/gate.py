"""Electrostatic attraction by gates below and above the film."""

from __future__ import annotations

from collections.abc import Callable
from math import factorial
from typing import Any

import attrs
import numpy as np
from dolfinx import fem

from nanorom.fem.solvers import compat


@attrs.frozen(eq=False)
class Gate:
    """A plane gate in parallel to the flat film, at a distance from it: negative on its other side.

    Parallel plates at height h per area: potential strength/2 / (gap - h), pressure its derivative;
    strength is eps0 V^2, on the other side -eps0 V^2.  inside : (local cells,) 1 where the gate
    lies and 0 elsewhere, None for all of the film.
    """

    gap: Any
    strength: Any
    inside: Any = None

    @property
    def side(self) -> float:
        """1 towards positive w, else -1."""
        return float(np.sign(self.gap))

    def derivative(self, order: int, height: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Of the potential by the height (c, q) in local cells (c,), per strength; the same."""
        value = factorial(order) / 2 / (self.gap - height) ** (order + 1)
        return value if self.inside is None else value * self.inside[cells][:, None]


@attrs.frozen(eq=False)
class Attraction:
    """What all gates together do; `on` a mesh its numbers and patches are coefficients of forms."""

    gates: tuple[Gate, ...]

    def on(self, mesh: Any) -> Attraction:
        """The same with constants that a compiled form can be given anew."""
        space, found = compat.lagrange_space(mesh, 0), []
        for gate in self.gates:
            inside = gate.inside
            if inside is not None:
                inside = fem.Function(space)
                inside.x.array[compat.cell_dofs(space)[:, 0]] = gate.inside
            gap, strength = (fem.Constant(mesh, float(x)) for x in (gate.gap, gate.strength))
            found.append(Gate(gap, strength, inside))
        return Attraction(tuple(found))

    def scaled(self, magnitude: float) -> Attraction:
        """With all strengths in proportion."""
        return Attraction(
            tuple(attrs.evolve(gate, strength=magnitude * gate.strength) for gate in self.gates)
        )

    def potential(self, height: Any) -> Any:
        """Work done up to a height (UFL), but for a constant."""
        return self._sum(lambda gate: 0.5 * gate.strength / (gate.gap - height))

    def pressure(self, height: Any) -> Any:
        """First derivative of the potential."""
        return self._sum(lambda gate: 0.5 * gate.strength / (gate.gap - height) ** 2)

    def stiffness(self, height: Any) -> Any:
        """Second derivative of the potential; it softens the film."""
        return self._sum(lambda gate: gate.strength / (gate.gap - height) ** 3)

    def _sum(self, of_one: Callable[[Gate], Any]) -> Any:
        return sum(
            of_one(gate) if gate.inside is None else gate.inside * of_one(gate)
            for gate in self.gates
        )

    def derivative(self, order: int, height: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Of the potential by the height (c, q) in local cells (c,), the same."""
        return sum(
            (gate.strength * gate.derivative(order, height, cells) for gate in self.gates),
            np.zeros_like(height),
        )
