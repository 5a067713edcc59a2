"""A clamped, tensioned disc under axisymmetric loads by a spectral Ritz method, no finite elements.

Unknowns are polynomials in r^2 (times the powers of r and 1 - r that regularity and the supports
ask for), integrals are Gauss-Legendre sums; everything converges exponentially.  Units: radius 1,
membrane stiffness E h = 1, mass per area 1.
"""

import numpy as np
from numpy.polynomial import polynomial

POINTS = 400


def legendre_in_r2(count, r):
    """Values and first two derivatives in r of P_n(2 r^2 - 1), n < count: (3, count, q)."""
    x = 2 * r**2 - 1
    values = np.zeros((3, count, len(r)))
    for n in range(count):
        c = np.eye(count)[n]
        for k in range(3):
            values[k, n] = np.polynomial.legendre.legval(
                x, np.polynomial.legendre.legder(c, k) if k else c
            )
    dx = 4 * r
    return np.stack([values[0], values[1] * dx, values[2] * dx**2 + 4 * values[1]])


def basis(count, r, power, edge):
    """r^power (1 - r^2)^edge P_n(2 r^2 - 1) with two derivatives."""
    factor = polynomial.polymul(
        polynomial.polypow([0.0, 1.0], power), polynomial.polypow([1.0, 0.0, -1.0], edge)
    )
    f, f1, f2 = (polynomial.polyval(r, polynomial.polyder(factor, k)) for k in range(3))
    p, p1, p2 = legendre_in_r2(count, r)
    return np.stack([f * p, f1 * p + f * p1, f2 * p + 2 * f1 * p1 + f * p2])


class Disc:
    """A disc of tension T, bending stiffness D and Poisson's ratio nu under a load.

    gap: of a gate of strength eps0 V^2 (``voltage2``); pressure: uniform.
    """

    def __init__(self, tension, bending, nu, count=40):
        x, w = np.polynomial.legendre.leggauss(POINTS)
        # points crowded towards the edge, where a bending layer may be
        s = (x + 1) / 2
        self.r = 1 - (1 - s) ** 2
        self.weights = w * (1 - s) * self.r * 2 * np.pi
        self.tension, self.bending, self.nu, self.count = tension, bending, nu, count
        self.edge = 2 if bending else 1
        self.w_basis = basis(count, self.r, 0, self.edge)
        self.u_basis = basis(count, self.r, 1, 1)
        self.a, self.b = np.zeros(count), np.zeros(count)

    def fields(self):
        return self._sum(self.a, self.w_basis), self._sum(self.b, self.u_basis)

    @staticmethod
    def _sum(coefficients, functions):
        return np.tensordot(coefficients, functions, (0, 1))

    def strain(self):
        (_, w1, _), (u, u1, _) = self.fields()
        return u1 + w1**2 / 2, u / self.r

    def force(self):
        e_r, e_t = self.strain()
        c = 1 / (1 - self.nu**2)
        return self.tension + c * (e_r + self.nu * e_t), self.tension + c * (e_t + self.nu * e_r)

    def _bend(self, f):
        """Laplacian of an axisymmetric basis."""
        return f[2] + f[1] / self.r

    def solve(self, pressure=0.0, gap=None, voltage2=0.0, point=0.0):
        """Newton's method from the current state."""
        c, nu, q, r = 1 / (1 - self.nu**2), self.nu, self.weights, self.r
        n = self.count
        for _ in range(60):
            (w, w1, _), _ = self.fields()
            n_r, n_t = self.force()
            d_r = np.concatenate([w1 * self.w_basis[1], self.u_basis[1]])
            d_t = np.concatenate([0 * self.w_basis[0], self.u_basis[0] / r])
            residual = (n_r * q) @ d_r.T + ((n_t) * q) @ d_t.T
            stiff = c * ((d_r * q) @ d_r.T + (d_t * q) @ d_t.T)
            stiff += c * nu * ((d_r * q) @ d_t.T + (d_t * q) @ d_r.T)
            stiff[:n, :n] += (self.w_basis[1] * q * n_r) @ self.w_basis[1].T
            if self.bending:
                lap = self._bend(self.w_basis)
                bend = self.bending * (lap * q) @ lap.T
                residual[:n] += bend @ self.a
                stiff[:n, :n] += bend
            load, slope = pressure + 0 * r, 0 * r
            if gap is not None:
                load = load + voltage2 / 2 / (gap - w) ** 2
                slope = slope + voltage2 / (gap - w) ** 3
            residual[:n] -= (load * q) @ self.w_basis[0].T
            stiff[:n, :n] -= (self.w_basis[0] * q * slope) @ self.w_basis[0].T
            if point:
                residual[:n] -= point * self.centre_values()
            # scale the basis: its functions differ by orders of magnitude
            d = 1 / np.sqrt(np.abs(np.diag(stiff)))
            step = -d * np.linalg.solve(stiff * np.outer(d, d), d * residual)
            self.a += step[:n]
            self.b += step[n:]
            size = np.abs(step[:n] @ self.w_basis[0]).max()
            if size < 1e-13 * max(1.0, np.abs(self.a @ self.w_basis[0]).max()):
                break
        else:
            raise RuntimeError(f"no equilibrium: last step {size}")
        self.load_slope = slope
        return self

    def centre_values(self):
        return basis(self.count, np.zeros(1), 0, self.edge)[0, :, 0]

    def centre(self):
        return self.a @ self.centre_values()

    def eigenvalues(self, m, number, vectors=False):
        """Lowest squared frequencies of the modes with m nodal diameters about the state."""
        c, nu, q, r, n = 1 / (1 - self.nu**2), self.nu, self.weights, self.r, self.count
        (_, w1, _), _ = self.fields()
        n_r, n_t = self.force()
        phi = basis(n, r, m, self.edge)
        if m == 0:
            f = self.u_basis
            ur, ur1, ut, ut1 = f[0], f[1], 0 * f[0], 0 * f[0]
        else:
            low, high = basis(n, r, m - 1, 1), basis(n, r, m + 1, 1)
            ur, ur1 = (np.concatenate([low[k], high[k]]) for k in (0, 1))
            ut, ut1 = (np.concatenate([-low[k], high[k]]) for k in (0, 1))
        # the factor pi or 2 pi of the angle is common to all terms
        rr = np.concatenate([w1 * phi[1], ur1])
        tt = np.concatenate([0 * phi[0], (ur + m * ut) / r])
        rt = np.concatenate([-0.5 * m * w1 * phi[0] / r, 0.5 * (-m * ur / r + ut1 - ut / r)])
        k = c * ((rr * q) @ rr.T + (tt * q) @ tt.T + nu * ((rr * q) @ tt.T + (tt * q) @ rr.T))
        k += 2 * c * (1 - nu) * (rt * q) @ rt.T
        kw = (phi[1] * q * n_r) @ phi[1].T + (phi[0] * q * n_t * m**2 / r**2) @ phi[0].T
        if self.bending:
            lap = phi[2] + phi[1] / r - m**2 * phi[0] / r**2
            kw += self.bending * (lap * q) @ lap.T
        kw -= (phi[0] * q * self.load_slope) @ phi[0].T
        k[:n, :n] += kw
        d = 1 / np.sqrt(np.diag(k))
        k = k * np.outer(d, d)
        condensed = k[:n, :n] - k[:n, n:] @ np.linalg.solve(k[n:, n:], k[n:, :n])
        mass = (phi[0] * q) @ phi[0].T * np.outer(d[:n], d[:n])
        from scipy.linalg import eigh

        values, shapes = eigh(mass, condensed)
        order = np.argsort(-values)[:number]
        if vectors:
            return 1 / values[order], (d[:n, None] * shapes[:, order]), phi
        return 1 / values[order]
