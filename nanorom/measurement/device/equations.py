"""The harmonic balance of many measured rows at once, and its derivatives by parameters.

    q_r'' + c_r q_r' + k_r q_r + (1 + 2/3 tau d/dt) sum B_rjkl q_j q_k q_l = f_r cos(wt)

With a cubic force of a potential that is what a viscous material adds: D = tau B.  The orbits are
those that continuation has found; here they are only corrected, on a few harmonics, and derived by
the implicit function theorem.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.types import Array, Numbers

STEP = 1e-3  # relative, of an orbit: differences of functions of third degree in it
CORRECTIONS = 4
FAR = 0.15  # relative, of an orbit: a correction that goes farther leads to another one
STEEPEST = 0.1  # of the least singular value at the top of a linear resonance
LOSS = 2 / 3  # of tau: the share of d(B qqq)/dt that D q d(qq)/dt is


@attrs.frozen(eq=False)
class Terms:
    """Arrays of the equations over the modal masses, or what they change by.

    damping, stiffness: (L,) 1/s, 1/s^2; cubic: (L, L, L, L) 1/(m s)^2; force: (L,) m/s^2 per unit
    of a level; time: tau in s.
    """

    damping: Array
    stiffness: Array
    cubic: Array
    force: Array
    time: float


@attrs.frozen(eq=False)
class Fold:
    """Derivatives of a fold by p parameters: omega (p,) in rad/s, coefficients (p, h, L) in m."""

    omega: Array
    coefficients: Array


class RowEquations:
    """Residuals of n rows; coefficients (n, h, L) of the terms 1, cos, sin, ... that are kept.

    harmonics: those of the drive's frequency, fractions for longer periods.  Time is counted in
    1/omega of the first mode and q in metres times `unit`, so that all numbers are of order one.
    """

    def __init__(self, terms: Terms, harmonics: tuple[float, ...], level: float) -> None:
        self.terms, self.level = terms, level
        self.frequency = float(np.sqrt(terms.stiffness[0]))
        hardest = np.einsum("rrrr->r", terms.cubic)
        self.unit = float(np.sqrt(terms.stiffness[0] / max(np.abs(hardest).max(), 1e-300)))
        self.size = len(terms.damping)
        self.harmonics = harmonics
        number = np.array([h for h in harmonics for _ in range(1 if h == 0 else 2)])
        sine = np.concatenate([[False] if h == 0 else [False, True] for h in harmonics])
        multiple = 1 if all(h == int(h) for h in harmonics) else 2
        samples = int(4 * multiple * max(harmonics)) + 2
        angle = 2 * np.pi * multiple * np.arange(samples) / samples
        phase = np.outer(angle, number)
        self.values = np.where(sine, np.sin(phase), np.cos(phase))  # (s, h)
        norm = np.where(number == 0, 1.0, 2.0)[:, None] / samples
        self.project = norm * self.values.T
        count = len(number)
        self.slope = np.zeros((count, count))  # of d/d(wt) on the terms
        for i in range(count - 1):
            if not sine[i] and sine[i + 1]:
                self.slope[i, i + 1], self.slope[i + 1, i] = number[i], -number[i]
        self.products = np.einsum("hs,sg->hgs", self.project, self.values).reshape(-1, samples)
        self.first = [i for i in range(count) if number[i] == 1]

    # -- residual ---------------------------------------------------------------------------------

    def residual(self, x: Array, rate: Array) -> Array:
        """(n, h, L) at scaled coefficients x (n, h, L) and rates (n,) by the frequency."""
        linear = self._linear(x, rate, *self._scaled(self.terms)[:2])
        force = self._lossy(self._cubic_force(x), rate, self._time)
        return np.asarray(linear + force - self._drive())

    def jacobian(self, x: Array, rate: Array) -> Array:
        """(n, h L, h L)."""
        count, size, n = x.shape[1], self.size, len(x)
        damping, stiffness, cubic, _ = self._scaled(self.terms)
        tangent = 3 * self._matrices(x, cubic)
        blocks = self.products @ tangent.reshape(n, -1, size * size)
        blocks = blocks.reshape(n, count, count, size, size)
        if self._time:
            turned = np.einsum("hk,nkgrj->nhgrj", self.slope, blocks)
            blocks = blocks + LOSS * self._time * rate[:, None, None, None, None] * turned
        twice, own = self.slope @ self.slope, np.arange(size)
        square = rate[:, None, None] ** 2 * twice
        for r in own:
            blocks[..., r, r] += square + stiffness[r] * np.eye(count)
            blocks[..., r, r] += rate[:, None, None] * damping[r] * self.slope
        return np.asarray(blocks.transpose(0, 1, 3, 2, 4).reshape(n, count * size, count * size))

    def by_rate(self, x: Array, rate: Array) -> Array:
        """Derivative (n, h, L) of the residual with the rate."""
        damping = self._scaled(self.terms)[0]
        found = 2 * rate[:, None, None] * (self.slope @ (self.slope @ x))
        found = found + (self.slope @ x) * damping
        if self._time:
            found = found + LOSS * self._time * (self.slope @ self._cubic_force(x))
        return np.asarray(found)

    def by_parameters(self, x: Array, rate: Array, changes: list[Terms]) -> Array:
        """Derivatives (n, h, L, p) of the residual by what changes the terms."""
        parts = []
        for change in changes:
            damping, stiffness, cubic, force = self._scaled(change)
            part = damping * rate[:, None, None] * (self.slope @ x) + stiffness * x
            if cubic.any():
                part = part + self._lossy(self._cubic_force(x, cubic), rate, self._time)
            if change.time:
                time = LOSS * change.time * self.frequency
                turned = self.slope @ self._cubic_force(x)
                part = part + time * rate[:, None, None] * turned
            part = part - self._drive(force)
            parts.append(part)
        return np.stack(parts, axis=-1)

    # -- orbits -----------------------------------------------------------------------------------

    def corrected(self, x: Array, rate: Array) -> Array:
        """Orbits (n, h, L) near given ones; a row that leads away keeps what it was given."""
        start, shape = x, x.shape
        for _ in range(CORRECTIONS):
            left = self.residual(x, rate).reshape(len(x), -1, 1)
            x = x - np.linalg.solve(self.jacobian(x, rate), left).reshape(shape)
        moved = np.abs(x - start).max(axis=(1, 2))
        size = np.abs(start).max(axis=(1, 2))
        good = np.isfinite(moved) & (moved < FAR * size)
        return np.asarray(np.where(good[:, None, None], x, start))

    def slopes(self, x: Array, rate: Array, changes: list[Terms]) -> tuple[Array, Array]:
        """Derivatives of orbits by parameters (n, h, L, p), and by the rate (n, h, L).

        Next to a fold, where they are infinite and no straight line holds, they are bounded.
        """
        n, count, size = x.shape
        right = np.concatenate(
            [self.by_parameters(x, rate, changes), self.by_rate(x, rate)[..., None]], axis=-1
        )
        left, sizes, turned = np.linalg.svd(self.jacobian(x, rate))
        # at the top of a linear resonance the least singular value is the damping by the rate
        least = STEEPEST * self._scaled(self.terms)[0].min() * rate[:, None]
        found = left.transpose(0, 2, 1) @ right.reshape(n, count * size, -1)
        found = -turned.transpose(0, 2, 1) @ (found / np.maximum(sizes, least)[..., None])
        found = found.reshape(n, count, size, -1)
        return found[..., :-1], found[..., -1]

    def fold_slopes(self, x: Array, rate: float, changes: list[Terms]) -> Fold:
        """Derivatives of a fold at x (h, L) and a rate: F = 0 and w.F_x v = 0 go on to hold."""
        rates = np.array([rate])
        left, _, right = np.linalg.svd(self.jacobian(x[None], rates)[0])
        w, v = left[:, -1], right[-1]
        step = STEP * np.abs(x).max()
        high, low = (x[None] + s * step * v.reshape(1, *x.shape) for s in (1, -1))
        bend = w @ (self.jacobian(high, rates) - self.jacobian(low, rates))[0] / (2 * step)
        length = len(v)

        def along(function: object) -> Array:
            ends = (function(at).reshape(length, -1) for at in (high, low))  # type: ignore[operator]
            up, down = ends
            return np.asarray(w @ (up - down) / (2 * step))

        by_rate = self.by_rate(x[None], rates).reshape(length, 1)
        by_all = self.by_parameters(x[None], rates, changes).reshape(length, -1)
        upper = np.hstack([self.jacobian(x[None], rates)[0], by_rate])
        lower = np.append(bend, along(lambda at: self.by_rate(at, rates)))
        last = along(lambda at: self.by_parameters(at, rates, changes))
        found = -np.linalg.solve(np.vstack([upper, lower]), np.vstack([by_all, last]))
        moved = found[:-1].T.reshape(-1, *x.shape)
        return Fold(found[-1] * self.frequency, moved)

    # -- parts ------------------------------------------------------------------------------------

    @property
    def _time(self) -> float:
        return self.terms.time * self.frequency

    def _scaled(self, terms: Terms) -> tuple[Array, Array, Array, Array]:
        by = self.frequency
        return (
            terms.damping / by,
            terms.stiffness / by**2,
            terms.cubic * (self.unit / by) ** 2,
            terms.force * self.level / (by**2 * self.unit),
        )

    def _linear(self, x: Array, rate: Array, damping: Array, stiffness: Array) -> Array:
        turned = self.slope @ x
        rates = rate[:, None, None]
        found = rates**2 * (self.slope @ turned) + rates * damping * turned + stiffness * x
        return np.asarray(found)

    def _drive(self, force: Array | None = None) -> Array:
        found = np.zeros((len(self.slope), self.size))
        found[self.first[0]] = self._scaled(self.terms)[3] if force is None else force
        return found

    def _matrices(self, x: Array, cubic: Array) -> Array:
        """sum_kl B_rjkl q_k q_l (n, s, L, L) at the samples."""
        q = self.values @ x
        pairs = (q[..., :, None] * q[..., None, :]).reshape(-1, self.size**2)
        found = pairs @ cubic.reshape(self.size**2, -1).T
        return found.reshape(*q.shape, self.size)

    def _cubic_force(self, x: Array, cubic: Array | None = None) -> Array:
        cubic = self._scaled(self.terms)[2] if cubic is None else cubic
        force = self._matrices(x, cubic) @ (self.values @ x)[..., None]
        return np.asarray(self.project @ force[..., 0])

    def _lossy(self, force: Array, rate: Array, time: float) -> Array:
        if not time:
            return force
        return np.asarray(force + LOSS * time * rate[:, None, None] * (self.slope @ force))

    def signal(self, x: Array, weights: Array) -> Numbers:
        """First harmonic (...,) of weights (L,) times the motion: Re signal exp(iwt)."""
        cosine, sine = (x[..., i, :] @ weights for i in self.first)
        return np.asarray(cosine - 1j * sine)
