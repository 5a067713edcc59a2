"""Taylor steps in time of the equations of motion and of their variational equation.

Source of the method: Jorba and Zou 2005, doi:10.1080/10586458.2005.10128904 (Taylor integration).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np

from nanorom.continuation.orbits.pairs import moving_modes
from nanorom.continuation.orbits.parts import Part, by_term
from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array

TIME_ORDER = 24
MAP_DOUBLES = 500_000  # of a batch of segments: larger arrays are faulted in at every use
TINY = 1e-300  # size of a motion at rest


class TaylorStepper:
    """One Taylor step of I q'' + C q' + G(q) q + W(q) q' = f(t) + P(t) q for a batch of states.

    Of states of first order (no inertia, damping 1) the rates at the start do not matter.
    """

    def __init__(self, system: ScaledSystem, order: int = TIME_ORDER) -> None:
        self.system, self.order = system, order
        size = system.size
        # matrices [l, r] of the force G(q) q, linear in q_j q_k of j <= k, or in q_j
        moving = moving_modes(system, np.arange(size))
        self.cubic, self.loss = moving.cubic, moving.loss
        self.quadratic = np.ascontiguousarray(system.quadratic.transpose(1, 2, 0)).reshape(
            size, size * size
        )
        self.has_quadratic, self.has_loss = bool(self.quadratic.any()), bool(self.loss.any())
        self.fastest = max(system.fastest, system.relaxation)
        self.inertia, self.massless = system.inertia, system.massless
        self.parametric = by_term(system.parametric.swapaxes(0, 1))
        self._whole: Part | None = None

    def step(
        self, states: Array, omega: Array, phase: Array, duration: Array, variation: bool = True
    ) -> tuple[Array, Array | None, float]:
        """States (n, 2L) after `duration` (n,), maps (n, 2L, 2L) and the size of the last Taylor
        terms.

        phase (n,) is the drive's phase at the start of the step.
        """
        flow = self.flow(states, omega, phase, duration)
        if not variation:
            return flow.ends, None, flow.error
        if self._whole is None:
            every = np.arange(self.system.size)
            self._whole = Part.of(self.system, every, every)
        return flow.ends, flow.maps(self._whole), flow.error

    def flow(self, states: Array, omega: Array, phase: Array, duration: Array) -> Flow:
        """The motion itself, as Taylor series."""
        system, order, size = self.system, self.order, self.system.size
        n = len(states)
        h = duration[:, None]
        q = np.zeros((n, order + 1, size))
        q[:, 0], q[:, 1] = states[:, :size], h * states[:, size:] * self.inertia
        # back[:, order - k] is q[:, k], so that a convolution is one product; forces are transposed
        back = np.zeros((n, order + 1, size))
        back[:, order], back[:, order - 1] = q[:, 0], q[:, 1]
        secant = np.empty((n, (order - 1) * size, size))
        friction = np.zeros((n, order - 1, size, size)) if self.has_loss else None
        drives = np.empty((n, order - 1, 2 * system.tones + 1))
        tones = np.arange(1, system.tones + 1)
        for k in range(order - 1):
            factor = np.multiply.outer(omega * duration, tones) ** k / float(factorial(k))
            angle = np.multiply.outer(phase, tones) + k * np.pi / 2
            drives[:, k, 0] = float(k == 0)
            drives[:, k, 1::2], drives[:, k, 2::2] = factor * np.cos(angle), factor * np.sin(angle)
            drive = drives[:, k]
            squares = np.matmul(q[:, : k + 1].transpose(0, 2, 1), back[:, order - k :])
            squares = squares.reshape(n, size * size)
            here = secant[:, k * size : (k + 1) * size]
            here[:] = self.cubic.of_squares(squares).reshape(n, size, size)
            here -= (drive @ self.parametric).reshape(n, size, size)
            if k == 0:
                here += system.stiffness.T
            if self.has_quadratic:
                here += (q[:, k] @ self.quadratic).reshape(n, size, size)
            past = back[:, order - k :].reshape(n, 1, (k + 1) * size)
            force = np.matmul(past, secant[:, : (k + 1) * size])[:, 0]
            force -= drive @ system.force.T
            speed = (k + 1) * q[:, k + 1] / h
            force += speed @ system.damping.T
            if friction is not None:
                friction[:, k] = self.loss.of_squares(squares).reshape(n, size, size)
                speeds = back[:, order - k - 1 : order] * np.arange(k + 1, 0, -1.0)[:, None]
                loss = friction[:, : k + 1].reshape(n, -1, size)
                force += np.matmul((speeds / h[:, :, None]).reshape(n, 1, -1), loss)[:, 0]
            if len(self.massless):
                rate = -h * force[:, self.massless] / (k + 1)
                q[:, k + 1, self.massless] = back[:, order - k - 1, self.massless] = rate
                force *= self.inertia
            q[:, k + 2] = back[:, order - k - 2] = -(h**2) * force / ((k + 1) * (k + 2))
        return Flow(q, back, h, drives)


@dataclass(frozen=True, eq=False)
class Flow:
    """Taylor coefficients (n, order + 1, m) of motions over steps of lengths h (n, 1), the same
    backwards, and those of the terms of the drive (n, order - 1, 2K + 1).
    """

    q: Array
    back: Array
    h: Array
    drives: Array

    @property
    def order(self) -> int:
        return self.q.shape[1] - 1

    @property
    def ends(self) -> Array:
        """States (n, 2m) at the end of the step."""
        speed = np.einsum("k,nkr->nr", np.arange(self.order + 1.0), self.q) / self.h
        return np.concatenate([self.q.sum(axis=1), speed], axis=1)

    @property
    def error(self) -> float:
        """Size of the last terms, relative to the largest."""
        last = np.abs(self.q[:, -2:]).max(initial=0.0)
        return float(last / max(np.abs(self.q).max(initial=0.0), TINY))

    def maps(self, part: Part) -> Array:
        """Maps (n, 2 Lp, 2 Lp) of the states of a part over the step, from the variational
        equation along the motion.
        """
        n, size = len(self.q), part.size
        batch = max(1, MAP_DOUBLES // (self.order * size * size))
        maps = np.empty((n, 2 * size, 2 * size))
        for first in range(0, n, batch):
            some = slice(first, first + batch)
            chosen = Flow(self.q[some], self.back[some], self.h[some], self.drives[some])
            maps[some] = chosen._maps(part)
        return maps

    def _maps(self, part: Part) -> Array:
        n, size, order, scale = len(self.q), part.size, self.order, self.h[:, :, None]
        by_row, friction = self._tangents(part)
        # y[:, order - k] holds the coefficient of order k, so that a convolution is one product
        y = np.empty((n, order + 1, size, 2 * size))
        y[:, order] = np.eye(size, 2 * size)
        y[:, order - 1] = np.eye(size, 2 * size, size)
        flat = y.reshape(n, (order + 1) * size, 2 * size)
        massless = np.flatnonzero(part.inertia == 0)
        y[:, :order, massless] = 0.0
        loss = scale * part.damping
        for k in range(order - 1):
            rows = by_row[:, :, : k + 1].reshape(n, size, -1)
            force = np.matmul(rows, flat[:, (order - k) * size :])
            force += (k + 1) * np.matmul(loss, y[:, order - k - 1])
            if friction is not None:
                speeds = y[:, order - k - 1 : order] * np.arange(k + 1, 0, -1.0)[:, None, None]
                force += scale * np.einsum("nirl,nilc->nrc", friction[:, : k + 1], speeds)
            if len(massless):
                y[:, order - k - 1, massless] = -force[:, massless] / scale / (k + 1)
                force *= part.inertia[:, None]
            y[:, order - k - 2] = -force / ((k + 1) * (k + 2))
        maps = np.empty((n, 2 * size, 2 * size))
        maps[:, :size] = y.sum(axis=1)
        maps[:, size:] = np.einsum("k,nkrc->nrc", np.arange(order, -1, -1.0), y) / scale
        maps[:, :, size:] *= scale
        return maps

    def _tangents(self, part: Part) -> tuple[Array, Array | None]:
        """Taylor coefficients of the tangent stiffness times h^2 (n, Lp, order - 1, Lp), and of the
        nonlinear part of the damping (n, order - 1, Lp, Lp).
        """
        n, size, order, moving = len(self.q), part.size, self.order, self.q.shape[2]
        tangents = np.empty((n, size, order - 1, size))
        friction = np.empty((n, order - 1, size, size)) if part.has_loss else None
        speeds = self.q[:, 1:] * np.arange(1.0, order + 1)[:, None] / self.h[:, :, None]
        for k in range(order - 1):
            squares = np.matmul(
                self.q[:, : k + 1].transpose(0, 2, 1), self.back[:, order - k :]
            ).reshape(n, moving * moving)
            tangent = part.cubic.of_squares(squares).reshape(n, size, size)
            tangent -= (self.drives[:, k] @ part.parametric).reshape(n, size, size)
            if k == 0:
                tangent += part.stiffness
            if part.quadratic.any():
                tangent += (self.q[:, k] @ part.quadratic).reshape(n, size, size)
            if friction is not None:
                friction[:, k] = part.loss.of_squares(squares).reshape(n, size, size)
                mixed = np.matmul(speeds[:, : k + 1].transpose(0, 2, 1), self.q[:, k::-1])
                tangent += np.einsum("rkjl,nkl->nrj", part.mixed, mixed, optimize=True)
            tangents[:, :, k] = tangent
        tangents *= self.h[:, :, None, None] ** 2
        return tangents, friction
