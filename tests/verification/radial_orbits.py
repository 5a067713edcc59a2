"""Periodic orbits of an axisymmetric drum by a spectral Galerkin method, no finite elements.

Deflection and in-plane displacement are polynomials in r (`radial.basis`), harmonic balance is
collocated in time and solved by MINPACK.  Units: radius 1, membrane stiffness E h = 1, mass per
area 1; every mode has one quality factor.
"""

import numpy as np
import scipy.linalg
from scipy.optimize import root

from tests.fem.radial import basis

CENTRE = np.array([1e-9])  # where the angular strain u / r still is a number
EQUATIONS_SOLVED = 1e-9  # residual by the drive


class Drum:
    """A disc of tension T, bending stiffness D (0: a membrane) and Poisson's ratio nu."""

    def __init__(self, tension, bending, nu, quality, size=12):
        x, w = np.polynomial.legendre.leggauss(4 * size)
        r, weight = (x + 1) / 2, (x + 1) / 4 * w  # of r dr
        edge = 2 if bending else 1
        values, slopes, bends = basis(size, r, 0, edge)
        u, u_slope, _ = basis(size, r, 1, 1)
        law = np.array([[1, nu], [nu, 1]])
        self.strain = np.stack([u_slope, u / r])
        self.weight, self.slopes, self.law = weight, slopes, law / (1 - nu**2)
        product = "q,ab,aiq,bjq->ij"
        stretched = np.einsum(product, weight, self.law, self.strain, self.strain)
        self.in_plane = scipy.linalg.cho_factor(stretched)
        bent = np.stack([bends, slopes / r])
        self.stiffness = tension * np.einsum("q,iq,jq->ij", weight, slopes, slopes)
        self.stiffness += bending * np.einsum(product, weight, law, bent, bent)
        self.mass = np.einsum("q,iq,jq->ij", weight, values, values)
        squares, modes = scipy.linalg.eigh(self.stiffness, self.mass)
        rates = np.sqrt(squares) / quality
        self.damping = self.mass @ modes * rates @ modes.T @ self.mass
        self.push = values @ weight
        self.modes = modes / (basis(size, CENTRE, 0, edge)[0][:, 0] @ modes)  # 1 at the centre

    def force(self, a):
        """Nonlinear force (t, n) of coefficients (t, n)."""
        slope = a @ self.slopes
        strain = np.stack([0.5 * slope**2, np.zeros_like(slope)])
        load = np.einsum("q,ab,aiq,btq->it", self.weight, self.law, self.strain, strain)
        u = -scipy.linalg.cho_solve(self.in_plane, load)
        strain += np.einsum("aiq,it->atq", self.strain, u)
        stress = np.einsum("b,btq->tq", self.law[0], strain)
        return (stress * slope * self.weight) @ self.slopes.T

    def orbit(self, omega, pressure, start):
        """Amplitudes max |q| (n,) of all modes under pressure cos(omega t).

        start : Fourier coefficients (2H + 1, k) of the first k modes, in the order 1, cos, sin, ...
        """
        rows = len(start)
        number = (np.arange(rows) + 1) // 2
        table = fourier(2 * rows, number)
        slope = np.zeros((rows, rows))
        slope[2::2, 1::2] = -np.diag(number[1::2])
        slope[1::2, 2::2] = np.diag(number[2::2])
        analysis = np.linalg.pinv(table)
        drive = np.outer(table[:, 1], pressure * self.push)

        def residual(flat):
            x = flat.reshape(rows, -1) @ self.modes.T
            inertia = -((omega * number) ** 2)[:, None] * x
            linear = inertia @ self.mass + omega * slope @ x @ self.damping + x @ self.stiffness
            total = linear + analysis @ (self.force(table @ x) - drive)
            return (total @ self.modes).ravel() / (pressure * self.push @ self.modes[:, 0])

        x = np.zeros((rows, self.modes.shape[1]))
        x[:, : start.shape[1]] = start
        scale = np.abs(start).max()
        found = root(lambda y: residual(scale * y), x.ravel() / scale, options={"xtol": 1e-13})
        assert np.abs(found.fun).max() < EQUATIONS_SOLVED, found.message
        return np.abs(fourier(4000, number) @ (scale * found.x.reshape(x.shape))).max(axis=0)


def fourier(samples, number):
    """1, cos, sin, cos 2, ... at samples of a period, (samples, 2H + 1)."""
    angle = 2 * np.pi * np.arange(samples)[:, None] / samples
    place = np.arange(len(number))
    even = np.where(place, np.sin(number * angle), 1.0)
    return np.where(place % 2 == 1, np.cos(number * angle), even)
