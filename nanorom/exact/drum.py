"""Clamped drums without finite elements: what the benchmark's errors are measured against.

Lengths are in units of the radius, tensions in D/R^2, tensors in E h/R^2.  Under isotropic tension
the shapes are the exact ones, J_p and I_p; under unequal tensions they are found by Ritz' method in
(1 - r^2)^2 r^p P_n^(2,p)(2 r^2 - 1) times cos or sin(p theta), which diagonalises the bending
energy.  The in-plane displacement of every pair of modes is condensed harmonic by harmonic in
(1 - r^2) r^q P_n^(1,q)(2 r^2 - 1).  Both bases converge exponentially.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.ndimage import maximum_filter
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ive, jn_zeros, jv, jvp

from nanorom.types import Array

HIGHEST = 40  # nodal diameters that are searched for modes
ANGLES = 128  # points around the drum: exact for products of four modes with p < 32
RITZ = 26  # radial functions per harmonic
ZOOMS = 7  # by 12 each, into the top of a shape
NEGLIGIBLE = 1e-10  # of a membrane force: rounding, where a harmonic is absent
HARMONICS = 22  # of the Ritz basis


@attrs.frozen(eq=False)
class Drum:
    """Exact modes of a clamped drum.

    omega: (L,) in sqrt(D/(rho h))/R^2, of a membrane in sqrt(T/(rho h))/R;
    slopes: (2, L, nr, ANGLES) phi_r and phi_theta/r at the points of `Radial`, max |phi| = 1.
    """

    omega: Array
    slopes: Array
    radial: Radial

    def tensor(self, nu: float) -> Array:
        """Cubic tensor (L, L, L, L) in E h/R^2, the in-plane displacement free."""
        return _condensed(self.slopes, self.radial, nu)


@attrs.frozen(eq=False)
class Radial:
    """Quadrature in r: points and weights (of r dr), and how many in-plane functions to use."""

    r: Array
    weights: Array
    functions: int

    @classmethod
    def resolving(cls, layer: float) -> Radial:
        """Enough for layers of a width at the edge, in which polynomials take 1/sqrt(layer)."""
        functions = 36 + int(7 / np.sqrt(layer))
        x, weights = np.polynomial.legendre.leggauss(2 * functions + 20)
        return cls(np.sqrt(0.5 * (x + 1)), 0.25 * weights, functions)


# -- modes ----------------------------------------------------------------------------------------


def plate_roots(kappa: float, count: int) -> list[tuple[float, int, float]]:
    """(omega R^2 sqrt(rho h/D), p, b) of the lowest modes of a plate with T R^2/D = kappa.

    b J_p'(b)/J_p(b) = g I_p'(g)/I_p(g), g^2 - b^2 = kappa, omega = b g; pairs are listed once.
    Compression (kappa < 0) is allowed up to buckling.
    """

    def wavenumbers(smaller: float) -> tuple[float, float]:
        larger = float(np.sqrt(smaller**2 + abs(kappa)))  # of the smaller one: nothing cancels
        return (smaller, larger) if kappa >= 0 else (larger, smaller)

    def characteristic(smaller: float, p: int) -> float:
        b, g = wavenumbers(smaller)
        ratio = 0.5 * (ive(p - 1, g) + ive(p + 1, g)) / ive(p, g)
        return float(b * jvp(p, b) - g * ratio * jv(p, b))

    found: list[tuple[float, int, float]] = []
    highest = 2.5 * np.sqrt(count) + 6  # beyond the wavenumber of mode ``count``
    for p in range(HIGHEST):
        grid = np.arange(0.5 + 0.8 * p, highest, 0.05)
        if kappa < 0:  # near buckling g is small
            grid = np.concatenate([np.geomspace(1e-6, 0.05, 40), np.arange(0.1, highest, 0.05)])
        values = [characteristic(x, p) for x in grid]
        for low, high, f, g in zip(grid, grid[1:], values, values[1:]):
            if f * g < 0:
                root = brentq(characteristic, low, high, args=(p,), xtol=1e-15, rtol=1e-14)
                b, g = wavenumbers(float(root))
                found.append((b * g, p, b))
    return sorted(found)


def isotropic(kappa: float, count: int) -> Drum:
    """The lowest modes of a drum with T R^2/D = kappa; infinite for a membrane."""
    if np.isinf(kappa):
        zeros = [(float(b), p, float(b)) for p in range(HIGHEST) for b in jn_zeros(p, 12)]
        roots, layer = sorted(zeros), 1.0
    else:
        roots, layer = plate_roots(kappa, count), 1 / np.sqrt(1 + abs(kappa))
    radial = Radial.resolving(layer)
    theta = _angles()
    omega, slopes = [], []
    for value, p, b in roots:
        first, over_r = _exact_shape(kappa, p, b, radial.r)
        for turn in (np.cos, np.sin)[: 1 if p == 0 else 2]:
            across = -p * np.sin(p * theta) if turn is np.cos else p * np.cos(p * theta)
            omega.append(value)
            slopes.append([np.outer(first, turn(p * theta)), np.outer(over_r, across)])
    chosen = np.array(slopes[:count]).swapaxes(0, 1)
    return Drum(np.array(omega[:count]), chosen, radial)


def _exact_shape(kappa: float, p: int, b: float, r: Array) -> tuple[Array, Array]:
    """W'(r) and W(r)/r of J_p(b r) - J_p(b) I_p(g r)/I_p(g), scaled to max |W| = 1."""
    plate = bool(np.isfinite(kappa))
    g = np.sqrt(b**2 + kappa) if plate else 0.0

    def growing(q: int, x: Array) -> Array:
        return np.asarray(ive(q, g * x) / ive(p, g) * np.exp(g * (x - 1)))

    def value(x: Array) -> Array:
        shape = jv(p, b * x)
        return np.asarray(shape - jv(p, b) * growing(p, x) if plate else shape)

    derivative = b * jvp(p, b * r)
    if plate:
        derivative = derivative - jv(p, b) * 0.5 * g * (growing(p - 1, r) + growing(p + 1, r))
    grid = np.linspace(0, 1, 400)
    top = grid[np.abs(value(grid)).argmax()]
    inside = minimize_scalar(
        lambda x: -abs(float(value(np.array(x)))),
        bounds=(max(top - 0.01, 0), min(top + 0.01, 1)),
        method="bounded",
        options={"xatol": 1e-12},
    )
    peak = float(value(np.array(0.0 if p == 0 else inside.x)))
    return derivative / peak, value(r) / r / peak


def anisotropic(kappa_x: float, kappa_y: float, count: int) -> Drum:
    """The lowest modes of a drum under unequal tensions T_x R^2/D and T_y R^2/D."""
    radial = Radial.resolving(1 / np.sqrt(1 + max(kappa_x, kappa_y)))
    classes = [_Class(parity, radial) for parity in ((0, 0), (0, 1), (1, 0), (1, 1))]
    modes = []
    for own in classes:
        values, vectors = own.modes(kappa_x, kappa_y, count)
        modes += [(value, own, vector) for value, vector in zip(values, vectors.T)]
    modes = sorted(modes, key=lambda mode: mode[0])[:count]
    slopes = np.array([own.slopes(vector) for _, own, vector in modes]).swapaxes(0, 1)
    return Drum(np.array([omega for omega, _, _ in modes]), slopes, radial)


class _Class:
    """Ritz basis of one parity in x and y: cos(p theta) is even in y, sin(p theta) odd."""

    def __init__(self, parity: tuple[int, int], radial: Radial) -> None:
        self.odd_y = parity[1]
        lowest = {(0, 0): 0, (1, 0): 1, (0, 1): 1, (1, 1): 2}[parity]  # in x, p decides
        self.harmonics = range(lowest, HARMONICS, 2)
        theta = _angles()
        weights = 4 * 2 * np.pi / ANGLES * radial.weights  # over the first quadrant, four times
        self.weights = np.repeat(weights, ANGLES // 4)
        parts = []
        for p in self.harmonics:
            turn, across = np.cos(p * theta), -p * np.sin(p * theta)
            if self.odd_y:
                turn, across = np.sin(p * theta), p * np.cos(p * theta)
            value, first, over_r, laplace = _ritz(p, radial.r)[..., None]
            parts.append(np.stack([value * turn, first * turn, over_r * across, laplace * turn]))
        self.value, self.first, self.over_r, self.laplace = np.concatenate(parts, axis=1)

    def modes(self, kappa_x: float, kappa_y: float, count: int) -> tuple[Array, Array]:
        """Frequencies and coefficients of the lowest modes."""
        cos, sin = np.cos(_angles()), np.sin(_angles())
        stiffness = self._gram(self.laplace)
        stiffness += kappa_x * self._gram(self.first * cos - self.over_r * sin)
        stiffness += kappa_y * self._gram(self.first * sin + self.over_r * cos)
        scale = 1 / np.sqrt(np.diag(stiffness))
        scales = np.outer(scale, scale)
        inverse, vectors = eigh(self._gram(self.value) * scales, stiffness * scales)
        return inverse[: -count - 1 : -1] ** -0.5, scale[:, None] * vectors[:, : -count - 1 : -1]

    def slopes(self, coefficients: Array) -> list[Array]:
        """phi_r and phi_theta/r of a mode scaled to max |phi| = 1."""
        scaled = coefficients / self._peak(coefficients)
        return [np.tensordot(scaled, part, 1) for part in (self.first, self.over_r)]

    def _gram(self, functions: Array) -> Array:
        """Integrals of products: of one parity, so that one quadrant tells all."""
        flat = functions[..., : ANGLES // 4].reshape(len(functions), -1)
        return np.asarray((flat * self.weights) @ flat.T)

    def _peak(self, coefficients: Array) -> float:
        """Signed value at the largest |phi| of the first quadrant."""

        def value(r: Array, theta: Array) -> Array:
            total = np.zeros((len(r), len(theta)))
            for p, part in zip(self.harmonics, coefficients.reshape(-1, RITZ)):
                radial = part @ jacobi(RITZ, 2, p, 2 * r**2 - 1) * (1 - r**2) ** 2 * r**p
                turn = np.sin(p * theta) if self.odd_y else np.cos(p * theta)
                total += np.outer(radial, turn)
            return total

        r, theta = np.linspace(0, 1, 120), np.linspace(0, np.pi / 2, 61)
        size = np.abs(value(r, theta))
        tops = (size == maximum_filter(size, 3)) & (size > 0.999 * size.max())
        # the centre is a whole column of equal values
        j, i = np.nonzero(tops.T)  # sorted by angle
        start = np.column_stack([r[i], theta[j]])[np.append(True, (i[1:] > 0))]
        values = np.array([self._climbed(value, top) for top in start])
        return float(np.sign(values[0]) * np.abs(values).max())

    @staticmethod
    def _climbed(value: Callable[[Array, Array], Array], top: Array) -> float:
        """Value at the extremum near a point of a grid of 120 x 61."""
        width = 1.5 * np.array([1 / 119, np.pi / 120])
        for _ in range(ZOOMS):
            grids = [t + w * np.linspace(-1, 1, 41) for t, w in zip(top, width)]
            values = value(*grids)
            best = np.unravel_index(np.abs(values).argmax(), values.shape)
            top = np.array([grid[i] for grid, i in zip(grids, best)])
            width = width / 12
        return float(values[best])


def _ritz(p: int, r: Array) -> Array:
    """W, W', W/r and the Laplacian of W cos(p theta), (4, RITZ, nr)."""
    s, x = r**2, 2 * r**2 - 1
    q, dq, d2q = (jacobi(RITZ, 2, p, x, k) * 2.0**k for k in range(3))  # derivatives in s = r^2
    f, df, d2f = (1 - s) ** 2, -2 * (1 - s), 2.0
    g, dg, d2g = f * q, df * q + f * dq, d2f * q + 2 * df * dq + f * d2q
    power = r**p
    first = power * 2 * r * dg + p * power / r * g
    # r^-p Delta(r^p g(s) cos) = 4 s g'' + 4 (p + 1) g'
    laplace = power * (4 * s * d2g + 4 * (p + 1) * dg)
    return np.stack([power * g, first, power / r * g, laplace])


def jacobi(size: int, a: float, b: float, x: Array, order: int = 0) -> Array:
    """Derivatives of the Jacobi polynomials P_n^(a,b)(x), n < size: (size, *x.shape)."""
    n = np.arange(size, dtype=float)
    factor = np.ones(size)
    for k in range(order):
        factor *= 0.5 * (n + a + b + 1 + k)
    a, b = a + order, b + order
    values = np.ones((size + 2, *x.shape))
    values[1] = 0.5 * (a + b + 2) * x + 0.5 * (a - b)
    for m in range(2, size):
        c = 2 * m + a + b
        values[m] = (c - 1) * (c * (c - 2) * x + a**2 - b**2) * values[m - 1]
        values[m] -= 2 * (m + a - 1) * (m + b - 1) * c * values[m - 2]
        values[m] /= 2 * m * (m + a + b) * (c - 2)
    shifted = np.concatenate([np.zeros((order, *x.shape)), values])[:size]
    return factor.reshape(-1, *(1,) * x.ndim) * shifted


def _angles() -> Array:
    """Midpoints: a quarter of them is a quadrant."""
    return 2 * np.pi * (np.arange(ANGLES) + 0.5) / ANGLES


# -- cubic tensor ---------------------------------------------------------------------------------


def _condensed(slopes: Array, radial: Radial, nu: float) -> Array:
    """Cubic tensor of deflections with slopes (2, L, nr, ANGLES)."""
    n_modes = slopes.shape[1]
    j, k = np.triu_indices(n_modes)
    along, across = slopes
    strain = np.stack(
        [
            along[j] * along[k],
            across[j] * across[k],
            0.5 * (along[j] * across[k] + across[j] * along[k]),
        ]
    )
    xx, yy, xy = strain
    force = np.stack([xx + nu * yy, yy + nu * xx, (1 - nu) * xy]) / (1 - nu**2)
    weights = radial.weights[:, None] * (2 * np.pi / ANGLES)
    energy = np.einsum(
        "apx,aqx->pq",
        (strain * np.array([1, 1, 2])[:, None, None, None]).reshape(3, len(j), -1),
        (force * weights).reshape(3, len(j), -1),
        optimize=True,
    )
    harmonics = np.fft.rfft(force, axis=-1)[..., : ANGLES // 2] / ANGLES
    harmonics[..., 1:] *= 2
    largest = np.abs(harmonics).max()
    for m in range(ANGLES // 2):
        amplitude = harmonics[..., m]
        if np.abs(amplitude).max() > NEGLIGIBLE * largest:  # its energy is the square
            energy -= _relaxed(m, amplitude, radial, nu)
    products = np.zeros((n_modes,) * 4)
    for a, b in ((j, k), (k, j)):
        for c, d in ((j, k), (k, j)):
            products[a[:, None], b[:, None], c, d] = energy
    swapped = products.transpose(0, 2, 1, 3) + products.transpose(0, 3, 2, 1)
    return np.asarray((products + swapped) / 6)


def _relaxed(m: int, force: NDArray[np.complex128], radial: Radial, nu: float) -> Array:
    """f K^-1 f (pairs, pairs) of the m-th harmonic of membrane forces (3, pairs, nr).

    u_r = Re (A + B) e^(i m theta), u_theta = Re -i (A - B) e^(i m theta): A and B are then regular
    at the centre as r^(m+1) and r^|m-1|.
    """
    r = radial.r
    (a, da), (b, db) = (_in_plane(q, radial) for q in (m + 1, abs(m - 1)))
    along = np.concatenate([da, db])
    around = np.concatenate([(1 + m) * a / r, (1 - m) * b / r])
    shear = 0.5 * np.concatenate([m * a / r - da + a / r, m * b / r + db - b / r])  # times i
    weighted = radial.weights / (1 - nu**2)
    mixed = (along * weighted) @ around.T
    stiffness = (along * weighted) @ along.T + (around * weighted) @ around.T
    stiffness += nu * (mixed + mixed.T) + 2 * (1 - nu) * (shear * weighted) @ shear.T
    rr, tt, rt = force * radial.weights
    load = along @ rr.T + around @ tt.T - 2j * shear @ rt.T
    scale = 1 / np.sqrt(np.diag(stiffness))
    load = load * scale[:, None]
    factor = cho_factor(stiffness * np.outer(scale, scale))
    solved = cho_solve(factor, load.real), cho_solve(factor, load.imag)
    turns = 2 * np.pi if m == 0 else np.pi
    return np.asarray(turns * (load.real.T @ solved[0] + load.imag.T @ solved[1]))


def _in_plane(q: int, radial: Radial) -> tuple[Array, Array]:
    """(1 - r^2) r^q P_n^(1,q)(2 r^2 - 1) and its derivative in r, (functions, nr) each."""
    r = radial.r
    s, x = r**2, 2 * r**2 - 1
    poly, slope = (jacobi(radial.functions, 1, q, x, k) * 2.0**k for k in (0, 1))
    g, dg = (1 - s) * poly, (1 - s) * slope - poly
    return r**q * g, r**q * 2 * r * dg + q * r ** (q - 1.0) * g
