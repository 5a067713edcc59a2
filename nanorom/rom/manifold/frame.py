"""Driven motions on a manifold in a frame that turns with the drive: rest states of slow equations.

z_r = p_r exp(i turns_r omega t): p' = f(p) - i turns omega p + g(p), where no term depends on time,
as all that is kept turns alike. Rest states are periodic motions; where a real eigenvalue vanishes
is a fold or a branch point, where a complex pair does, a Neimark-Sacker point. Source: Jain and
Haller 2022, doi:10.1007/s11071-021-06957-4.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.rom.manifold.drive import driven
from nanorom.rom.manifold.equations import Equations
from nanorom.rom.manifold.invariance import Expansion
from nanorom.rom.manifold.piecewise import Piecewise
from nanorom.types import Array, Numbers

ALIKE = 1e-9  # turns that are the same
INSTANTS = 64  # per turn of the fastest master, at which a motion is told


@attrs.define(eq=False)
class Frame:
    """The slow equations of y = (Re p, Im p) (2m,) at given levels of the drive.

    turns (m,): phases of the masters by the drive's; period: turns of the drive in one of the
    motion; degree: of what the drive adds, in z; limits: of the frequency; share: of the levels
    that acts.  Raises ModelError where a term of the dynamics does not turn with the others.
    """

    equations: Equations
    expansion: Expansion
    turns: Array
    period: int
    levels: tuple[float, float]
    degree: int
    limits: tuple[float, float]
    share: float = 1.0
    _added: Piecewise = attrs.field(init=False)
    _swap: list[int] = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        signed, monomials = self._signed, self.expansion.monomials
        turning = np.abs(monomials.powers @ signed[:, None] - signed) < ALIKE
        if np.any(self.expansion.dynamics[~turning]):
            raise ModelError(
                "masters: a resonance among them is none with the drive in this range; allowed: "
                'others, another period, and style="normal"'
            )
        rows = np.roll(monomials.powers, len(self.turns), axis=1)
        self._swap = [monomials.place(row) for row in rows.tolist()]
        self._added = Piecewise(self._driven, self.limits)

    @property
    def _signed(self) -> Array:
        """Turns (2m,) of the masters and of their conjugates."""
        return np.concatenate([self.turns, -self.turns])

    def _driven(self, omega: float) -> Numbers:
        """What the drive adds at a frequency: to the dynamics, and to q, (P, 2m + L)."""
        found = driven(
            self.equations, self.expansion, omega, self.levels, self._signed, self.degree
        )
        return np.concatenate([found.dynamics, found.shape @ self.equations.basis.shapes.T], axis=1)

    def _flow(self, omega: float) -> tuple[Numbers, Numbers]:
        """Polynomials (P, m) of p' but for the turning, and their change with the frequency: f and
        what both exp(+-i omega t) add.
        """
        half = len(self.turns)
        both = []
        for added in self._added(omega):
            both.append(self.share * (added[:, :half] + added[self._swap, half : 2 * half].conj()))
        return self.expansion.dynamics[:, :half] + both[0], both[1]

    def equations_at(self, y: Array, omega: float) -> tuple[Array, Array, Array]:
        """dy/dt (2m,), and its derivatives by y (2m, 2m) and by the frequency (2m,)."""
        p, monomials, half = self.masters(y), self.expansion.monomials, len(self.turns)
        values = monomials.values(np.concatenate([p, p.conj()]))
        flow, change = self._flow(omega)
        rate = values @ flow - 1j * omega * self.turns * p
        by_omega = values @ change - 1j * self.turns * p
        table = np.array([values @ monomials.slope(flow, v) for v in range(2 * half)]).T
        own = table[:, :half] - 1j * omega * np.diag(self.turns)
        real, imag = own + table[:, half:], 1j * (own - table[:, half:])
        jacobian = np.block([[real.real, imag.real], [real.imag, imag.imag]])
        return _parts(rate), jacobian, _parts(by_omega)

    def masters(self, y: Array) -> Numbers:
        """p (m,) of y (2m,)."""
        half = len(self.turns)
        return np.asarray(y[:half] + 1j * y[half:])

    def motion(self, y: Array, omega: float) -> Array:
        """q (n, L) at equal instants of a period of the motion, in units of the equations."""
        p, added = self.masters(y), self._added(omega)[0][:, 2 * len(self.turns) :]
        fastest = max(1.0, float(np.abs(self.turns).max())) * self.period
        count = INSTANTS * max(int(np.ceil(fastest)), 1)
        angle = 2 * np.pi * self.period / count * np.arange(count)
        path = p * np.exp(1j * angle[:, None] * self.turns)
        values = self.expansion.monomials.values(np.concatenate([path, path.conj()], axis=1))
        q = values @ (self.expansion.shape @ self.equations.basis.shapes.T)
        # exp(-i omega t) adds the complex conjugate of what exp(i omega t) adds to the real q
        return np.asarray(q.real + 2 * (values @ added * np.exp(1j * angle)[:, None]).real)


def _parts(p: Numbers) -> Array:
    return np.concatenate([p.real, p.imag])
