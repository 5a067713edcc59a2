"""Multiple shooting with Taylor series in time: a discretisation independent of harmonic balance.

The period is cut into segments; each is crossed by one Taylor step of high order of the equations
of motion together with their variational equation, all segments of all orbits at once. It confirms
orbits, multipliers and special points, and corrects orbits by Newton's method. Source of the
method: Jorba and Zou 2005, doi:10.1080/10586458.2005.10128904 (Taylor integration).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np
from scipy.sparse import block_diag, eye, kron
from scipy.sparse.linalg import splu

from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.orbits.pairs import moving_modes
from nanorom.continuation.orbits.product import product_eigenvalues
from nanorom.continuation.system import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

TIME_ORDER = 24
SMALL = 1e-14  # last terms of a segment, relative to the orbit
MOST_SEGMENTS = 7000
STEP_ANGLE = 1.5  # of the fastest mode within a segment
CONVERGED = 1e-12  # of an orbit: the last change of Newton's method
REST, TINY = 1e-9, 1e-300  # sizes of an orbit at rest, and of none


@dataclass(frozen=True, eq=False)
class Shot:
    """What shooting says about an orbit: the largest gap between segments, and their maps (M, 2L,
    2L).
    """

    defect: float
    maps: Array

    @property
    def monodromy(self) -> Array:
        result = self.maps[0]
        for step in self.maps[1:]:
            result = step @ result
        return np.asarray(result)

    @property
    def multipliers(self) -> Array:
        return product_eigenvalues(self.maps)


class TaylorStepper:
    """One Taylor step of q'' + C q' + G(q) q + W(q) q' = (f + P q) cos(omega t) for a batch of
    states.
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
        frequencies = np.sqrt(np.abs(np.linalg.eigvals(system.stiffness)))
        self.fastest = float(frequencies.max())

    def step(
        self, states: Array, omega: Array, phase: Array, duration: Array, variation: bool = True
    ) -> tuple[Array, Array | None, float]:
        """States (n, 2L) after `duration` (n,), maps (n, 2L, 2L) and the size of the last Taylor
        terms.

        phase (n,) is the drive's phase at the start of the step.
        """
        system, order, size = self.system, self.order, self.system.size
        n = len(states)
        h = duration[:, None]
        q = np.zeros((n, order + 1, size))
        q[:, 0], q[:, 1] = states[:, :size], h * states[:, size:]
        # back[:, order - k] is q[:, k], so that a convolution is one product; forces are transposed
        back = np.zeros((n, order + 1, size))
        back[:, order], back[:, order - 1] = q[:, 0], q[:, 1]
        secant = np.empty((n, (order - 1) * size, size))
        tangent = np.empty((n, order - 1, size, size)) if variation else None
        friction = np.zeros((n, order - 1, size, size)) if self.has_loss else None
        parametric, stiffness = system.parametric.T, system.stiffness.T
        for k in range(order - 1):
            factor = (omega * duration) ** k / float(factorial(k))
            drive = factor * np.cos(phase + k * np.pi / 2)
            squares = np.matmul(q[:, : k + 1].transpose(0, 2, 1), back[:, order - k :])
            squares = squares.reshape(n, -1)
            cubic = self.cubic.of_squares(squares).reshape(n, size, size)
            linear = -drive[:, None, None] * parametric
            if k == 0:
                linear = linear + stiffness
            here = secant[:, k * size : (k + 1) * size]
            np.add(cubic, linear, out=here)
            if tangent is not None:
                tangent[:, k] = here + 2 * cubic
            if self.has_quadratic:
                quadratic = (q[:, k] @ self.quadratic).reshape(n, size, size)
                here += quadratic
                if tangent is not None:
                    tangent[:, k] += 2 * quadratic
            past = back[:, order - k :].reshape(n, 1, -1)
            force = np.matmul(past, secant[:, : (k + 1) * size])[:, 0]
            force -= drive[:, None] * system.force
            speed = (k + 1) * q[:, k + 1] / h
            force += speed @ system.damping.T
            if friction is not None:
                friction[:, k] = self.loss.of_squares(squares).reshape(n, size, size)
                speeds = back[:, order - k - 1 : order] * np.arange(k + 1, 0, -1.0)[:, None]
                loss = friction[:, : k + 1].reshape(n, -1, size)
                force += np.matmul((speeds / h[:, :, None]).reshape(n, 1, -1), loss)[:, 0]
            q[:, k + 2] = back[:, order - k - 2] = -(h**2) * force / ((k + 1) * (k + 2))
        weights = np.arange(order + 1.0)
        ends = np.concatenate([q.sum(axis=1), np.einsum("k,nkr->nr", weights, q) / h], axis=1)
        error = float(np.abs(q[:, -2:]).max() / max(np.abs(q).max(), TINY))
        if tangent is None:
            return ends, None, error
        if friction is not None:
            self._add_friction_tangent(tangent, q, h)
        return ends, self._variation(tangent, friction, h), error

    def _add_friction_tangent(self, tangent: Array, q: Array, h: Array) -> None:
        """Derivative of W(q, q) q' with respect to q: needs all orders of q."""
        n, count, size, _ = tangent.shape
        mixed = 2 * self.system.loss.transpose(1, 3, 2, 0).reshape(size * size, size * size)
        speeds = q[:, 1:] * np.arange(1, q.shape[1])[:, None] / h[:, :, None]
        for k in range(count):
            pairs = np.matmul(speeds[:, : k + 1].transpose(0, 2, 1), q[:, k::-1])
            tangent[:, k] += (pairs.reshape(n, -1) @ mixed).reshape(n, size, size)

    def _variation(self, tangent: Array, friction: Array | None, h: Array) -> Array:
        """Maps (n, 2L, 2L) of the state over the step from Taylor coefficients (n, k, L, L),
        transposed.
        """
        n, count, size, _ = tangent.shape
        order, scale = self.order, h[:, :, None]
        by_row = np.ascontiguousarray((tangent * scale[..., None] ** 2).transpose(0, 3, 1, 2))
        # y[:, order - k] holds the coefficient of order k, so that a convolution is one product
        y = np.empty((n, order + 1, size, 2 * size))
        y[:, order] = np.eye(size, 2 * size)
        y[:, order - 1] = np.eye(size, 2 * size, size)
        flat = y.reshape(n, (order + 1) * size, 2 * size)
        loss = scale * self.system.damping
        for k in range(count):
            rows = by_row[:, :, : k + 1].reshape(n, size, -1)
            force = np.matmul(rows, flat[:, (order - k) * size :])
            force += (k + 1) * np.matmul(loss, y[:, order - k - 1])
            if friction is not None:
                speeds = y[:, order - k - 1 : order] * np.arange(k + 1, 0, -1.0)[:, None, None]
                force += scale * np.einsum("nilr,nilc->nrc", friction[:, : k + 1], speeds)
            y[:, order - k - 2] = -force / ((k + 1) * (k + 2))
        maps = np.empty((n, 2 * size, 2 * size))
        maps[:, :size] = y.sum(axis=1)
        maps[:, size:] = np.einsum("k,nkrc->nrc", np.arange(order, -1, -1.0), y) / scale
        maps[:, :, size:] *= scale
        return maps


class Shooting:
    """Multiple shooting for the periodic orbits of one system."""

    def __init__(self, system: ScaledSystem) -> None:
        self.system = system
        self.stepper = TaylorStepper(system)

    def check(self, orbit: Orbit) -> Shot:
        """Defect and monodromy matrix along an orbit given by its Fourier coefficients."""
        for nodes, phases, duration in self._segments(orbit):
            defects, maps, error = self._gaps(nodes, phases, duration, orbit.omega)
            if error < SMALL:
                break
        return Shot(float(np.abs(defects).max()), maps)

    def correct(
        self, orbit: Orbit, tolerance: float = CONVERGED, iterations: int = 10
    ) -> tuple[Array, Shot]:
        """Newton's method at fixed frequency: the state (2L,) at phase 0 and what shooting says of
        the orbit.
        """
        nodes, phases, duration = self._nodes(orbit)
        for _ in range(iterations):
            gaps, maps, _ = self._gaps(nodes, phases, duration, orbit.omega)
            change = _cyclic_solve(maps, gaps)
            nodes = nodes + change
            if np.abs(change).max() < tolerance * max(np.abs(nodes).max(), REST):
                gaps, maps, _ = self._gaps(nodes, phases, duration, orbit.omega)
                return nodes[0], Shot(float(np.abs(gaps).max()), maps)
        raise ContinuationError("shooting does not converge to a periodic orbit")

    def _nodes(self, orbit: Orbit) -> tuple[Array, Array, float]:
        """States at the starts of the segments (M, 2L), drive phases (M,) and the duration of a
        segment, at which the Taylor series converge.
        """
        for nodes, phases, duration in self._segments(orbit):
            omega, durations = np.full(len(nodes), orbit.omega), np.full(len(nodes), duration)
            if self.stepper.step(nodes, omega, phases, durations, variation=False)[2] < SMALL:
                break
        return nodes, phases, duration

    def _segments(self, orbit: Orbit) -> Iterator[tuple[Array, Array, float]]:
        """As `_nodes`, for more and more segments."""
        period = 2 * np.pi / orbit.rate
        harmonics = (len(orbit.coefficients) - 1) // 2
        # local frequency at the largest excursion: hardening makes it higher than the linear ones
        fastest = self.stepper.fastest + float(np.abs(orbit.coefficients).sum(axis=0).max())
        count = max(8, int(np.ceil(period * fastest / STEP_ANGLE)))
        while count < MOST_SEGMENTS:
            angles = 2 * np.pi / count * np.arange(count)
            table = fourier_matrix(angles, harmonics)
            speed = orbit.rate * (table @ differentiate(orbit.coefficients))
            nodes = np.concatenate([table @ orbit.coefficients, speed], axis=1)
            yield nodes, orbit.period_multiple * angles, period / count
            count = int(1.4 * count) + 1

    def _gaps(
        self, nodes: Array, phases: Array, duration: float, omega: float
    ) -> tuple[Array, Array, float]:
        count = len(nodes)
        ends, maps, error = self.stepper.step(
            nodes, np.full(count, omega), phases, np.full(count, duration)
        )
        assert maps is not None
        return ends - np.roll(nodes, -1, axis=0), maps, error


def _cyclic_solve(maps: Array, gaps: Array) -> Array:
    """Changes d_m of the nodes with maps_m d_m - d_(m+1) = -gaps_m, cyclic."""
    count, size = gaps.shape
    # not condensed to one segment: the product of all maps may be beyond round-off
    matrix = block_diag(list(maps), format="csc") - kron(
        eye(count, format="csc").tocsc()[:, np.arange(count) - 1], eye(size), format="csc"
    )
    return np.asarray(splu(matrix).solve(-gaps.ravel()).reshape(count, size))


