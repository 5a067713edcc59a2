"""The response of one mode with cubic stiffness and nonlinear damping, in closed form.

    q'' + g q' + e q^2 q' + w0^2 q + b q^3 = F cos(wt),   q = Re a exp(iwt),   x = |a|^2

By one harmonic and what the third adds to the frequency (Nayfeh and Mook, Nonlinear Oscillations,
1979, sec. 2.3: w^2 = w0^2 + 3/4 b x + 3/128 b^2 x^2/w0^2),

    a (K(x) - u + i sqrt(u) G(x)) = F,   u = w^2,   G = g + e x/4

so that every x has two u, left and right of the largest x, and the curve is known without a search.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.types import Array, Numbers

POINTS = 160  # on each side of the largest amplitude
FINE = 31  # points of a second grid about a fold, whose parabola is then right to 1e-9
REACH = 1e4  # half widths from the largest amplitude that the curve goes
NEWTON = 2
STEEPEST = 0.1  # of the derivative without nonlinearity: next to a fold steps are no straight ones
LEAST_STIFFNESS = 1e-3  # of that at rest: softer, and the expansion says nothing
TRUSTED = 0.05  # relative, of x: a larger step of Newton's is not one to the branch's own root


@attrs.frozen
class Resonance:
    """w0^2, g, b and e of the equation, in one set of units."""

    square: float
    loss: float
    cubic: float
    damping: float

    def stiffness(self, x: Array) -> Array:
        """K (n,) at squared amplitudes x (n,)."""
        shift = self.cubic * x / self.square
        return np.asarray(self.square * (1 + 0.75 * shift + 3 / 128 * shift**2))

    def losses(self, x: Array) -> Array:
        """G (n,) at squared amplitudes x (n,)."""
        return np.asarray(self.loss + 0.25 * self.damping * x)

    def slopes(self, x: Array) -> tuple[Array, Array, Array]:
        """Derivatives (n,) of K with w0^2, b and x."""
        shift = self.cubic * x / self.square
        by_cubic = 0.75 + 3 / 64 * shift
        return 1 - 3 / 128 * shift**2, x * by_cubic, self.cubic * by_cubic

    def amplitude(self, force: float, u: Array, x: Array) -> Numbers:
        """The complex amplitude (n,) at u (n,) where |a|^2 is x (n,)."""
        found = force / (self.stiffness(x) - u + 1j * np.sqrt(u) * self.losses(x))
        return np.asarray(found)

    def curve(self, force: float) -> Curve:
        """All of the response to a force amplitude."""
        largest = self._largest(force)
        away = np.sinh(np.linspace(0, np.arcsinh(REACH), POINTS))
        left = _Side(self, force, largest, -1.0)
        right = _Side(self, force, largest, 1.0)
        u = np.concatenate([left.at(away[::-1]), right.at(away[1:])])
        x = np.concatenate([left.square(away[::-1]), right.square(away[1:])])
        place = np.concatenate([-away[::-1], away[1:]])
        falls = np.flatnonzero(np.diff(u) < 0)
        if len(falls) == 0:
            return Curve(self, force, (u, x), (u, x), None, None)
        first, last = int(falls[0]), int(falls[-1]) + 1
        upper, lower = (self._fold(left, right, place, n, s) for n, s in ((first, 1), (last, -1)))
        low = np.append(u[:first], upper[0]), np.append(x[:first], upper[1])
        high = np.append(lower[0], u[last + 1 :]), np.append(lower[1], x[last + 1 :])
        return Curve(self, force, low, high, upper, lower)

    def _largest(self, force: float) -> float:
        """Largest x: where the two u meet."""

        def miss(logarithm: float) -> float:
            x = np.exp(logarithm)
            stiffness, losses = float(self.stiffness(x)), float(self.losses(x))
            return float(
                np.log(max(stiffness, LEAST_STIFFNESS * self.square) * x * losses**2 / force**2)
            )

        guess = np.log(force**2 / (self.square * self.loss**2))
        return float(np.exp(brentq(miss, guess - 40, guess + 12)))

    def _fold(
        self, left: _Side, right: _Side, place: Array, n: int, sign: int
    ) -> tuple[float, float]:
        """u and x of the fold near the n-th point; sign: 1 if u is largest there, -1 if least."""
        near = np.linspace(place[max(n - 1, 0)], place[min(n + 1, len(place) - 1)], FINE)
        u = np.where(near < 0, left.at(-near), right.at(near))
        x = np.where(near < 0, left.square(-near), right.square(near))
        k = int(np.clip((sign * u).argmax(), 1, FINE - 2))
        before, here, after = u[k - 1 : k + 2]
        bend = before - 2 * here + after
        shift = 0.0 if bend == 0 else 0.5 * (before - after) / bend
        slope, second = 0.5 * (x[k + 1] - x[k - 1]), x[k + 1] - 2 * x[k] + x[k - 1]
        at = here - 0.25 * (before - after) * shift, x[k] + slope * shift + 0.5 * second * shift**2
        return float(at[0]), float(at[1])


@attrs.frozen
class _Side:
    """One of the two u as a function of the distance from the largest x, in half widths."""

    resonance: Resonance
    force: float
    largest: float
    sign: float

    def square(self, away: Array) -> Array:
        """x (n,); a Lorentzian's if the film is linear."""
        return np.asarray(self.largest / (1 + away**2))

    def at(self, away: Array) -> Array:
        """u (n,)."""
        x = self.square(away)
        stiffness, losses = self.resonance.stiffness(x), self.resonance.losses(x)
        inside = self.force**2 / x - stiffness * losses**2 + 0.25 * losses**4
        # at the largest x it is 0 but for losses^4/4, which it keeps from x on
        inside -= 0.25 * self.resonance.losses(np.asarray(self.largest)) ** 4
        found = stiffness - 0.5 * losses**2 + self.sign * np.sqrt(np.maximum(inside, 0))
        return np.asarray(found)


@attrs.frozen
class Curve:
    """A response: its branches from low and from high frequencies, and where they fold.

    low, high: u and x (n,), u rising, in the square of the units of frequency and amplitude;
    upper, lower: u and x of the folds where a sweep up, and one down, falls off its branch; None
    where it does not.
    """

    resonance: Resonance
    force: float
    low: tuple[Array, Array]
    high: tuple[Array, Array]
    upper: tuple[float, float] | None
    lower: tuple[float, float] | None

    @property
    def top(self) -> tuple[float, float]:
        """u and x where x is largest: what is nearest to a fold where there is none."""
        n = int(self.low[1].argmax())
        return float(self.low[0][n]), float(self.low[1][n])

    def amplitude(self, u: Array, rising: bool) -> Numbers:
        """Complex amplitude (n,) at u (n,) on the branch from low frequencies, or from high ones.

        Beyond its fold it has the size that it has there.
        """
        places, squares = self.low if rising else self.high
        x = np.exp(np.interp(u, places, np.log(squares)))
        inside = (u < places[-1]) if rising else (u > places[0])
        better = x.copy()
        for _ in range(NEWTON):
            better = np.where(inside, better - self._newton(u, better), x)
        x = np.where(np.abs(better / x - 1) < TRUSTED, better, x)
        found = self.resonance.amplitude(self.force, u, x)
        return np.asarray(found * np.sqrt(x) / np.abs(found))

    def gradient(self, u: Array, x: Array) -> tuple[Array, Numbers, Array]:
        """Derivatives (5, n) with w0^2, g, b, e and F of a branch at u (n,) and x (n,).

        Those of x, of the complex amplitude, and of a fold's u if it is at u and x: there the
        residual R = x |K - u + i sqrt(u) G|^2 - F^2 has no derivative with x.
        """
        own, force, root = self.resonance, self.force, np.sqrt(u)
        by_square, by_cubic, by_x = own.slopes(x)
        inverse = 1 / (own.stiffness(x) - u + 1j * root * own.losses(x))
        change = np.array([by_square + 0j, 1j * root, by_cubic + 0j, 0.25j * root * x, 0 * u])
        shift = by_x + 0.25j * root * own.damping
        by = 2 * x * np.real(change / inverse.conj())
        by[4] = -2 * force
        by_u = 2 * x * np.real((-1 + 0.5j * own.losses(x) / root) / inverse.conj())
        size = 1 / np.abs(inverse) ** 2
        along = size + 2 * x * np.real(shift / inverse.conj())
        squares = -by * np.sign(along) / np.maximum(np.abs(along), STEEPEST * size)
        complex_ones = -force * inverse**2 * (change + shift * squares)
        complex_ones[4] += inverse
        return squares, complex_ones, np.asarray(-by / by_u)

    def fold_slopes(self, fold: tuple[float, float]) -> Array:
        """Derivatives (5,) of |a| at a fold, at u and x, with w0^2, g, b, e and F."""
        at = np.array(fold)
        moves = self.gradient(at[:1], at[1:])[2][:, 0]

        def slope(resonance: Resonance, u: float, x: float) -> float:
            """Derivative of R with x."""
            detuning = float(resonance.stiffness(np.asarray(x))) - u
            losses = float(resonance.losses(np.asarray(x)))
            shift = float(resonance.slopes(np.asarray(x))[2])
            own = 2 * detuning * shift + 0.5 * u * losses * resonance.damping
            return detuning**2 + u * losses**2 + x * own

        def by(name: str, scale: float) -> float:
            step = 1e-5 * scale
            high, low = (
                attrs.evolve(self.resonance, **{name: getattr(self.resonance, name) + s * step})
                for s in (1, -1)
            )
            return (slope(high, *fold) - slope(low, *fold)) / (2 * step)

        own, (u, x) = self.resonance, fold
        sizes = own.square, own.loss, own.square * own.loss / x, own.loss / x
        direct = [by(n, s) for n, s in zip(("square", "loss", "cubic", "damping"), sizes)]
        du, dx = 1e-5 * own.loss * own.square, 1e-4 * x
        by_u = (slope(own, u + du, x) - slope(own, u - du, x)) / (2 * du)
        by_x = (slope(own, u, x + dx) - slope(own, u, x - dx)) / (2 * dx)
        return np.asarray(-(by_u * moves + np.array([*direct, 0.0])) / by_x / (2 * np.sqrt(x)))

    def _newton(self, u: Array, x: Array) -> Array:
        """Step (n,) of Newton's to x |K - u + i sqrt(u) G|^2 = F^2."""
        own = self.resonance
        detuning, losses = own.stiffness(x) - u, own.losses(x)
        hardening = own.slopes(x)[2]
        size = detuning**2 + u * losses**2
        slope = size + x * (2 * detuning * hardening + 0.5 * u * losses * own.damping)
        slope = np.where(np.abs(slope) > 1e-3 * size, slope, np.inf)  # next to a fold
        return np.asarray((x * size - self.force**2) / slope)
