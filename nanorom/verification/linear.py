"""Linear dynamics of one class of symmetry: stiffness, mass, damping, gas, and its lowest modes.

The modes are those that are named, each with its own quality factor, and more that are not: as
many as have frequencies that harmonics of the drive may meet.  What is beyond them follows
statically.  All of it is damped: a mode outside the model by the quality factor of the model's
highest, what is beyond the last mode by a stiffness-proportional damping that gives that mode the
same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from nanorom.errors import SolverError
from nanorom.types import Array
from nanorom.verification.factors import Factors
from nanorom.verification.gas import ClassGas

Flexibility = Callable[[Array], Array]

DENSE = 900  # unknowns up to which all eigenvectors are computed at once faster than a few,
MANY = 0.2  # or share of the modes from which on they are
FIRST_BEYOND, MOST_MODES = 32, 500  # modes of a class that are computed: at first, and at most
EIGEN_TOLERANCE = 1e-10  # of a basis in which a preconditioner is written


@attrs.frozen(eq=False)
class ClassDynamics:
    """M w'' + C w' + K w of one class, film-scaled, on free degrees of freedom (n,).

    stiffness, mass : (n, n) of tension and bending, without linear stretching; static : solves
    with all linear stiffness; modes (n, m) of unit mass, values (m,) their squared frequencies,
    rates (m,) their damping rates; loss : rate of damping by stiffness of what is beyond them;
    viscous : (n, n) what a viscoelastic material adds to the damping, None if there is none; gas :
    what the film squeezes, None without a gap.
    """

    stiffness: Any
    mass: sp.csr_matrix
    static: Factors
    extra: int
    modes: Array
    values: Array
    rates: Array
    loss: float
    viscous: sp.csr_matrix | None = None
    gas: ClassGas | None = None
    momenta: Array = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        object.__setattr__(self, "momenta", self.mass @ self.modes)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.mass.shape[0])

    def flexibility(self, columns: Array) -> Array:
        """Static deflections (n, m) under forces (n, m), linear stretching included."""
        padded = np.zeros((self.size + self.extra, columns.shape[1]))
        padded[: self.size] = columns
        return self.static.solve(padded)[: self.size]

    def damping(self, columns: Array) -> Array:
        """C (n, m) of velocities (n, m)."""
        amplitudes = self.momenta.T @ columns
        force = self.momenta @ ((self.rates - self.loss * self.values)[:, None] * amplitudes)
        force += self.loss * (self.stiffness @ columns)
        if self.viscous is not None:
            force += self.viscous @ columns
        return np.asarray(force)

    def squeezed(self, columns: Array, rate: float) -> Array:
        """Force of the gas (n, 2H + 1) against coefficients of the film at a rate."""
        return np.zeros_like(columns) if self.gas is None else self.gas.force(columns, rate)

    def squeezed_by_rate(self, columns: Array, rate: float) -> Array:
        """Its derivative by the rate."""
        return np.zeros_like(columns) if self.gas is None else self.gas.by_rate(columns, rate)

    def rest(self, columns: Array) -> Array:
        """Static deflections (n, m) under forces (n, m) that have nothing of the modes."""
        if self.modes.shape[1] == self.size:
            return np.zeros_like(columns)
        found = self.flexibility(columns - self.momenta @ (self.modes.T @ columns))
        return np.asarray(found - self.modes @ (self.momenta.T @ found))


def lowest(
    mass: sp.csr_matrix, flexibility: Flexibility, count: int, stiffness: sp.csr_matrix | None
) -> tuple[Array, Array]:
    """The ``count`` lowest squared frequencies (m,) and modes (n, m) of unit mass, or all.

    ``flexibility`` undoes all linear stiffness; ``stiffness`` (n, n) where that is a matrix.
    """
    n = mass.shape[0]
    if stiffness is not None and (n <= DENSE or count > MANY * n):
        last = min(count, n) - 1
        found = sl.eigh(stiffness.toarray(), mass.toarray(), subset_by_index=(0, last))
        return found[0], found[1]
    inverse = spl.LinearOperator((n, n), matvec=lambda x: flexibility(x.reshape(n, 1))[:, 0])
    try:
        values, vectors = spl.eigsh(
            mass,  # of the stiffness the size alone is asked for
            k=min(count, n - 2),
            M=mass,
            sigma=0.0,
            OPinv=inverse,
            tol=EIGEN_TOLERANCE,
            v0=np.ones(n),
        )
    except spl.ArpackError as error:
        raise SolverError(f"modes outside the model were not found: {error}") from error
    order = np.argsort(values)
    return values[order], vectors[:, order]


def beyond(dynamics: ClassDynamics, values: Array, modes: Array) -> tuple[Array, Array]:
    """Squared frequencies and modes, of the lowest of a class, without the named ones.

    ``dynamics`` has the named modes alone.  Of modes that are near each other some may be named:
    the others are those orthogonal to them.
    """
    named = modes.T @ dynamics.momenta
    rest = sl.qr(named)[0][:, named.shape[1] :]
    found, turned = np.linalg.eigh(rest.T @ (values[:, None] * rest))
    return found, modes @ (rest @ turned)


def completed(
    dynamics: ClassDynamics, quality: float, highest: float, stiffness: sp.csr_matrix | None
) -> ClassDynamics:
    """The same with modes up to a frequency, and with the damping of what is beyond.

    ``dynamics`` has the named modes alone; ``stiffness`` (n, n) is all of it, where it is a matrix.
    """
    count = dynamics.modes.shape[1] + FIRST_BEYOND
    while True:
        values, modes = lowest(dynamics.mass, dynamics.flexibility, count, stiffness)
        if len(values) < count or values[-1] >= highest**2 or count >= MOST_MODES:
            break
        count *= 2
    values, modes = beyond(dynamics, values, modes)
    together = np.concatenate([dynamics.values, values])
    return attrs.evolve(
        dynamics,
        modes=np.column_stack([dynamics.modes, modes]),
        values=together,
        rates=np.concatenate([dynamics.rates, np.sqrt(values) / quality]),
        loss=1.0 / (quality * np.sqrt(together.max())),
    )
