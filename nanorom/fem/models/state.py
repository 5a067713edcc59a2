"""What a film resists with, and the state that its forms are made for: values, never changed.

A film under load or of an initial shape is the model of a flat film about another state: whoever
has found one makes a `State` of it, and asks the plate for the plate about that.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from nanorom.fem.models.gate import Attraction
from nanorom.scene import elasticity

Spring = tuple[float | None, float]  # transverse (None: rigid) and rotational, per length


@attrs.frozen
class Stiffness:
    """What a plate resists with, in the film's units.

    bending : D; stretching : E h; springs : of the elastic edges, by boundary curve; in_plane : of
    those that are elastic in the plane, normal and tangential per length and E h; strain : the unit
    of the tension by that of the stretching, as a tension stiffens motions in the plane; crystal
    : stress by E of (xx, yy, 2 xy) where it is not that of an isotropic film with the
    poisson_ratio; moments : by D, in the same way.
    """

    bending: float = 0.0
    stretching: float = 1.0
    poisson_ratio: float = 0.0
    springs: Mapping[str, Spring] = attrs.field(factory=dict)
    in_plane: Mapping[str, tuple[float, float]] = attrs.field(factory=dict)
    strain: float = 0.0
    crystal: elasticity.Law | None = None
    moments: elasticity.Law | None = None

    @property
    def law(self) -> elasticity.Law:
        """Stress by E of (xx, yy, 2 xy)."""
        return self.crystal or elasticity.isotropic(self.poisson_ratio)

    @property
    def bending_law(self) -> elasticity.Law:
        """Moments by D, which is of bending along the first axis with the second held."""
        return self.moments or elasticity.isotropic_moments(self.poisson_ratio)


@attrs.frozen(eq=False)
class State:
    """An equilibrium that the displacement of a plate is measured from.

    tension, shear : constant membrane force along x and y, and between them; shape : deflection
    from the plane (Function), None where the film is flat; prestress : membrane force (UFL tensor)
    beside the tension, None where there is none; attraction : to gates, None where there are none.
    """

    tension: tuple[float, float] = (1.0, 1.0)
    shape: Any = None
    prestress: Any = None
    attraction: Attraction | None = None
    shear: float = 0.0

    @property
    def tensor(self) -> np.ndarray:
        """(2, 2) of the constant membrane force."""
        (x, y), xy = self.tension, self.shear
        return np.array([[x, xy], [xy, y]])

    @property
    def odd(self) -> bool:
        """The film does not tell its sides: it is flat, and nothing attracts it to one of them."""
        return self.shape is None and self.attraction is None

    @property
    def uniform(self) -> bool:
        """The film obeys one equation everywhere: flat, under a constant tension."""
        return self.odd and self.prestress is None

    def moved(self, shape: Any, force: Any, attraction: Attraction | None) -> State:
        """The state after a displacement from this one.

        shape : the new one; force : membrane force (UFL) that the displacement adds; attraction :
        that acts there, None for that of this state.
        """
        return attrs.evolve(
            self,
            shape=shape,
            prestress=force if self.prestress is None else self.prestress + force,
            attraction=attraction or self.attraction,
        )
