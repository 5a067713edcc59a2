"""What undoes the harmonic balance of a film nearly, and at little cost.

Named modes are coupled to each other in all harmonics, by the modal model's own Jacobian.  Each
mode beyond them has its own equation of Hill, with the membrane force that it feels along the
orbit: its mean makes the mode stiffer, and the part that varies in time couples its harmonics.
The first alone lets Krylov's method stall where a harmonic is near a mode's resonance.  What is
beyond these modes follows statically.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
import scipy.linalg as sl

from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.harmonics import basis_for, full_support
from nanorom.continuation.system import ModalSystem
from nanorom.types import Array
from nanorom.verification.equations import OrbitEquations


@attrs.frozen(eq=False)
class Border:
    """The last equation: <direction, change of the named modes> + slope x change of the rate = 0.

    direction (2H + 1, L) in modal coordinates.
    """

    direction: Array
    slope: float

    @classmethod
    def fixed(cls, harmonics: int, modes: int) -> Border:
        """The rate stays as it is."""
        return cls(np.zeros((2 * harmonics + 1, modes)), 1.0)


class Model:
    """Named modes of the classes that take part: coordinates of unit mass, and their equations.

    named : number of named modes in each class, the first of its modes; system : their modal
    equations at the levels that act, in the order class by class.
    """

    def __init__(
        self, equations: OrbitEquations, named: Sequence[int], system: ModalSystem
    ) -> None:
        self.equations, self.named = equations, named
        self.scaled = system.scaled(1.0, 1.0)
        p = equations.period_multiple
        basis = basis_for(full_support(self.scaled, p), equations.harmonics, p)
        self.balance = HarmonicBalance(self.scaled, basis)
        self.offsets = np.cumsum([0, *named])

    @property
    def size(self) -> int:
        """Number of modes."""
        return int(self.offsets[-1])

    def project(self, columns: Array, momenta: bool) -> Array:
        """Modal coordinates (L, m) of deflections, or with ``momenta`` modal forces of forces."""
        found = []
        parts = self.equations.parts(columns)
        for d, count, part in zip(self.equations.dynamics, self.named, parts):
            found.append((d.momenta if momenta else d.modes)[:, :count].T @ part)
        return np.concatenate(found)

    def expand(self, amplitudes: Array, momenta: bool = False) -> Array:
        """Deflections (n, m) of modal coordinates (L, m), or forces of modal forces."""
        found = []
        for d, first, count in zip(self.equations.dynamics, self.offsets, self.named):
            own = amplitudes[first : first + count]
            found.append((d.momenta if momenta else d.modes)[:, :count] @ own)
        return np.concatenate(found)

    def orbit(self, amplitudes: Array) -> Array:
        """The film's coefficients (n, 2H + 1) of modal ones (L, 2H + 1), what follows included."""
        return self.equations.settled(self.expand(amplitudes))

    def jacobian(self, x: Array, rate: float) -> Array:
        """dR/dX of the modal equations about a film's coefficients, harmonic by harmonic."""
        amplitude, frequency = self.scaled.amplitude, self.scaled.frequency
        modal = self.project(x, momenta=True).T / amplitude
        jacobian = self.balance.jacobian_t(modal, rate / frequency).T
        return np.asarray(jacobian * frequency**2)

    def corrected(
        self, x: Array, rate: float, border: Border, tolerance: float
    ) -> tuple[Array, float]:
        """The modal equations' own orbit next to a film's coefficients, and its rate.

        Raises NewtonFailure where there is none on the border's hyperplane.
        """
        amplitude, frequency = self.scaled.amplitude, self.scaled.frequency
        modal = self.project(x, momenta=True).T / amplitude
        across = np.append((border.direction * amplitude).ravel(), border.slope * frequency)
        found, turn, _ = self.balance.correct(modal, rate / frequency, across, tolerance)
        return self.orbit(amplitude * found.T), float(turn * frequency)

    def direction(self, x: Array, rate: float) -> tuple[Array, float]:
        """Tangent of the modal branch: of the coefficients (2H + 1, L) and of the rate.

        About a film's coefficients that solve the modal equations.  It is of unit length where the
        orbit's size and the rate are one, so that the unit of deflection makes no difference.
        """
        by_rate = self.project(self.equations.by_rate(x, rate), momenta=False).T
        slope = np.linalg.solve(self.jacobian(x, rate), -by_rate.ravel())
        unit = float(np.linalg.norm(self.project(x, momenta=True))) / rate
        length = float(np.sqrt(1.0 + slope @ slope / unit**2))
        return slope.reshape(by_rate.shape) / (unit**2 * length), 1.0 / length


@attrs.frozen(eq=False)
class Placed:
    """Coefficients (n, 2H + 1), the residual that they leave, its norm, and the film's state.

    evaluations : of the force that it took.
    """

    coefficients: Array
    residual: Array
    state: Any
    size: float
    evaluations: int


class Preconditioner:
    """An approximate inverse of the bordered Jacobian about a state. Cheap to make."""

    def __init__(self, model: Model, x: Array, rate: float, state: Any, border: Border) -> None:
        self.model, self.equations = model, model.equations
        self.by_rate = self.equations.by_rate(x, rate)
        jacobian = model.jacobian(x, rate)
        size = len(jacobian)
        bordered = np.zeros((size + 1, size + 1))
        bordered[:size, :size] = jacobian
        bordered[:size, size] = model.project(self.by_rate, momenta=False).T.ravel()
        bordered[size, :size] = border.direction.ravel()
        bordered[size, size] = border.slope
        self._modal = sl.lu_factor(bordered, overwrite_a=True, check_finite=False)
        self._beyond = [
            _Beyond.of(self.equations, number, model.named[number], rate, state)
            for number in range(len(self.equations.dynamics))
        ]

    def __call__(self, forces: Array, last: float) -> tuple[Array, float]:
        """Changes of the coefficients and of the rate for a right-hand side."""
        amplitudes, rate = self.modal(forces, last)
        return self.beyond(forces - rate * self.by_rate) + self.model.expand(amplitudes), rate

    def placed(self, x: Array, rate: float) -> Placed:
        """The residual that coefficients leave, these moved where that is cheap."""
        residual, state = self.equations.residual(x, rate)
        return Placed(x, residual, state, self.equations.norm(residual), 1)

    def modal(self, forces: Array, last: float) -> tuple[Array, float]:
        """Change of the named modes (L, 2H + 1) and of the rate, all else at rest."""
        model = self.model
        modal = np.append(model.project(forces, momenta=False).T.ravel(), last)
        solved = sl.lu_solve(self._modal, modal, check_finite=False)
        return solved[:-1].reshape(-1, model.size).T, float(solved[-1])

    def beyond(self, forces: Array) -> Array:
        """Change (n, 2H + 1) of what is not named, the named modes at rest."""
        model = self.model
        outside = forces - model.expand(model.project(forces, momenta=False), momenta=True)
        found = [b(part) for b, part in zip(self._beyond, self.equations.parts(outside))]
        change = np.concatenate(found)
        return np.asarray(change - model.expand(model.project(change, momenta=True)))


@attrs.frozen(eq=False)
class _Beyond:
    """The modes of one class beyond the named ones, each with its equation of Hill.

    modes (n, m); inverses (m, 2H + 1, 2H + 1); dynamics, number: of the class.
    """

    equations: OrbitEquations
    number: int
    modes: Array
    inverses: Array

    @classmethod
    def of(
        cls, equations: OrbitEquations, number: int, named: int, rate: float, state: Any
    ) -> _Beyond:
        dynamics = equations.dynamics[number]
        modes, values = dynamics.modes[:, named:], dynamics.values[named:]
        if not len(values):
            return cls(equations, number, modes, np.empty((0, 1, 1)))
        film, parity = equations.film, equations.classes.deflections[number]
        stiffer = film.stiffening(parity, state, modes)
        values, turned = np.linalg.eigh(np.diag(values) + stiffer)
        modes = modes @ turned
        felt = film.varying(parity, state, modes)
        rates = turned.T**2 @ dynamics.rates[named:]
        return cls(equations, number, modes, _inverses(equations, values, rates, felt, rate))

    def __call__(self, forces: Array) -> Array:
        """Deflections (n, 2H + 1) under forces without named modes."""
        dynamics = self.equations.dynamics[self.number]
        amplitudes = np.matmul(self.inverses, (self.modes.T @ forces)[..., None])[..., 0]
        return np.asarray(self.modes @ amplitudes + dynamics.rest(forces))


def _inverses(
    equations: OrbitEquations, values: Array, rates: Array, felt: Array, rate: float
) -> Array:
    """Inverses (m, 2H + 1, 2H + 1) of Hill's equations y'' + c y' + (lambda + kappa(t)) y.

    values (m,): lambda; rates (m,): c; felt (m, samples): kappa.
    """
    rows = len(equations.numbers)
    products = equations.analysis[:, :, None] * equations.synthesis.T[:, None, :]
    blocks = (felt @ products.reshape(len(products), -1)).reshape(-1, rows, rows)
    turn = rate * equations.derivative(np.eye(rows)).T
    blocks += rates[:, None, None] * turn
    diagonal = np.arange(rows)
    blocks[:, diagonal, diagonal] += values[:, None] - (rate * equations.numbers) ** 2
    return np.linalg.inv(blocks)
