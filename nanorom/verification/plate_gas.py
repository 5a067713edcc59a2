"""The gas between a plate and a wall, on the plate's own mesh."""

from __future__ import annotations

import attrs
import numpy as np
import scipy.sparse as sp

from nanorom.fem.models import operators
from nanorom.fem.models.plate import Plate
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import algebra
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors import squeeze
from nanorom.scene.material import Gas
from nanorom.types import Array
from nanorom.verification.gas import ClassGas


@attrs.frozen(eq=False)
class FilmGas:
    """Gas below a plate: mass of pressures on all nodes; strength, squeeze as in `ClassGas`."""

    film: squeeze.Film
    mass: sp.csr_matrix
    strength: float
    squeeze: float
    vented: bool

    @classmethod
    def of(cls, plate: Plate, gas: Gas, scales: Scales) -> FilmGas:
        """Of a scene's gas in its gap, film-scaled."""
        assert gas.gap is not None
        film = squeeze.Film.of(plate, gas.vented)
        time = float(np.sqrt(scales.mass / scales.tension))
        return cls(
            film=film,
            mass=algebra.as_csr(film.mass),
            strength=gas.pressure * scales.length**2 / (gas.gap * scales.tension),
            squeeze=gas.squeeze_number(1.0 / time, scales.length),
            vented=gas.vented,
        )

    def of_class(self, parity: Parity, deflections: np.ndarray) -> ClassGas:
        """What answers deflections whose free rows these are."""
        free = operators.free_deflections(self.film.plate, parity).local
        own = self.mass[free]
        return ClassGas(
            laplacian=algebra.as_csr(self.film.stiffness[parity])[free][:, free],
            mass=own[:, free],
            onto=own[:, deflections],
            strength=self.strength,
            squeeze=self.squeeze,
            still=self._still(parity, free),
        )

    def _still(self, parity: Parity, free: np.ndarray) -> Array | None:
        """Pressure that is the same everywhere, where gas cannot flow out and does not cancel."""
        if self.vented or any(parity):
            return None
        return np.full(len(free), 1.0 / np.sqrt(self.mass.sum()))
