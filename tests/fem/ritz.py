"""Rectangles held in any way by Ritz' method, no finite elements.

Products of Legendre polynomials, times the powers of 1 + s and 1 - s that supports ask for, in the
deflection and in both displacements in the plane.  Corners limit what they converge to: the last
two sizes of the basis tell.
"""

import numpy as np
from numpy.polynomial import legendre, polynomial
from scipy.linalg import eigh, solve
from scipy.optimize import minimize

DEFLECTION = {"c": 2, "s": 1, "f": 0}
IN_PLANE = {"c": 1, "s": 1, "f": 0}


class Axis:
    """Functions (n, q) of one coordinate on (-1, 1) and their first two derivatives."""

    def __init__(self, low, high, n, points):
        factor = polynomial.polymul(
            polynomial.polypow([1.0, 1.0], low), polynomial.polypow([1.0, -1.0], high)
        )
        g = [
            polynomial.polyval(points, polynomial.polyder(factor, d) if d else factor)
            for d in range(3)
        ]
        size = np.sqrt(np.arange(n) + 0.5)[:, None]
        p = [
            size
            * np.array(
                [legendre.legval(points, legendre.legder(c, d) if d else c) for c in np.eye(n)]
            )
            for d in range(3)
        ]
        self.at = [
            g[0] * p[0],
            g[1] * p[0] + g[0] * p[1],
            g[2] * p[0] + 2 * g[1] * p[1] + g[0] * p[2],
        ]


def rectangle(sides, width, nu, bending, tension=(0.0, 0.0), n=20):
    """Angular frequency (rho h = 1) and B_1111 (E h = 1) of the lowest mode, largest value 1.

    sides: kinds of left, right, bottom, top; length 1.
    """
    points, weight = legendre.leggauss(n + 14)
    a, b = 2.0, 2.0 / width  # d/dx by d/ds
    area = width / 4
    kinds = (sides[:2], sides[2:])
    x, y = (Axis(DEFLECTION[low], DEFLECTION[high], n, points) for low, high in kinds)

    def gram(one, other, i, j):
        return (one.at[i] * weight) @ other.at[j].T

    def pair(i, j, k, l):
        """int d_x^i d_y^k f d_x^j d_y^l g."""
        scale = a ** (i + j) * b ** (k + l) * area
        return scale * np.kron(gram(x, x, i, j), gram(y, y, k, l))

    mixed = pair(2, 0, 0, 2)
    stiff = pair(2, 2, 0, 0) + pair(0, 0, 2, 2) + nu * (mixed + mixed.T)
    stiff = bending * (stiff + 2 * (1 - nu) * pair(1, 1, 1, 1))
    stiff += tension[0] * pair(1, 1, 0, 0) + tension[1] * pair(0, 0, 1, 1)
    value, vector = eigh(stiff, pair(0, 0, 0, 0), subset_by_index=(0, 0))
    shape = vector[:, 0].reshape(n, n)

    def at(s, t):
        one = Axis(DEFLECTION[sides[0]], DEFLECTION[sides[1]], n, np.array([s])).at[0][:, 0]
        other = Axis(DEFLECTION[sides[2]], DEFLECTION[sides[3]], n, np.array([t])).at[0][:, 0]
        return abs(one @ shape @ other)

    grid = np.linspace(-1, 1, 41)
    rows = Axis(DEFLECTION[sides[0]], DEFLECTION[sides[1]], n, grid).at[0]
    columns = Axis(DEFLECTION[sides[2]], DEFLECTION[sides[3]], n, grid).at[0]
    place = np.unravel_index(np.abs(rows.T @ shape @ columns).argmax(), (41, 41))
    peak = minimize(
        lambda p: -at(*p),
        [grid[place[0]], grid[place[1]]],
        bounds=[(-1, 1)] * 2,
        method="Powell",
        options={"xtol": 1e-9, "ftol": 1e-15},
    )
    shape = shape / -peak.fun
    # displacements in the plane in equilibrium with the slopes
    u, v = (Axis(IN_PLANE[low], IN_PLANE[high], n, points) for low, high in kinds)
    wx = a * x.at[1].T @ shape @ y.at[0]
    wy = b * x.at[0].T @ shape @ y.at[1]
    c = 1 / (1 - nu**2)
    slopes = np.array([wx**2 / 2, wy**2 / 2, wx * wy])  # xx, yy, 2 xy
    law = c * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    stress = np.einsum("ij,jst->ist", law, slopes)

    def inner(i, j, k, l):
        scale = a ** (i + j) * b ** (k + l) * area
        return scale * np.kron(gram(u, u, i, j), gram(v, v, k, l))

    xx, yy, xy = inner(1, 1, 0, 0), inner(0, 0, 1, 1), inner(1, 0, 0, 1)
    shear = law[2, 2]
    off = law[0, 1] * xy + shear * xy.T
    matrix = np.block([[c * xx + shear * yy, off], [off.T, c * yy + shear * xx]])

    def load(field, i, k):
        weighted = field * np.outer(weight, weight) * area * a**i * b**k
        return (u.at[i] @ weighted @ v.at[k].T).ravel()

    force = np.concatenate(
        [
            load(stress[0], 1, 0) + load(stress[2], 0, 1),
            load(stress[1], 0, 1) + load(stress[2], 1, 0),
        ]
    )
    moved = solve(matrix, force, assume_a="pos")
    whole = area * np.einsum("ist,ist,s,t->", stress, slopes, weight, weight)
    return float(np.sqrt(value[0])), float(2 * (whole - force @ moved))


def relaxed(sides, width, nu, tension, n=14, m=18):
    """Factor of a tension at which a film with free sides buckles, tension and result by D.

    The tension relaxes at the free sides: what it leaves is found from m functions per direction,
    its buckling from n.
    """
    points, weight = legendre.leggauss(max(n, m) + 20)
    a, b = 2.0, 2.0 / width
    weight = (np.outer(weight, weight) * width / 4).ravel()

    def fields(powers, count, *orders):
        x, y = (
            Axis(powers[low], powers[high], count, points) for low, high in (sides[:2], sides[2:])
        )
        products = (np.einsum("is,jt->ijst", x.at[i], y.at[j]) * a**i * b**j for i, j in orders)
        return [product.reshape(count**2, -1) for product in products]

    def inner(one, other, by=1.0):
        return (one * weight * by) @ other.T

    ux, uy = fields(IN_PLANE, m, (1, 0), (0, 1))
    c, shear = 1 / (1 - nu**2), 1 / (2 * (1 + nu))
    mixed = c * nu * inner(ux, uy) + shear * inner(uy, ux)
    matrix = np.block(
        [
            [c * inner(ux, ux) + shear * inner(uy, uy), mixed],
            [mixed.T, c * inner(uy, uy) + shear * inner(ux, ux)],
        ]
    )
    force = -np.concatenate([tension[0] * ux @ weight, tension[1] * uy @ weight])
    u, v = np.split(solve(matrix, force, assume_a="pos"), 2)
    along, across = u @ ux, v @ uy
    nx = tension[0] + c * (along + nu * across)
    ny = tension[1] + c * (across + nu * along)
    nxy = shear * (u @ uy + v @ ux)
    wx, wy, wxx, wyy, wxy = fields(DEFLECTION, n, (1, 0), (0, 1), (2, 0), (0, 2), (1, 1))
    mixed = inner(wxx, wyy)
    bending = inner(wxx, wxx) + inner(wyy, wyy) + nu * (mixed + mixed.T)
    bending += 2 * (1 - nu) * inner(wxy, wxy)
    mixed = inner(wx, wy, nxy)
    pulled = inner(wx, wx, nx) + inner(wy, wy, ny) + mixed + mixed.T
    return float(1 / eigh(-pulled, bending, eigvals_only=True)[-1])
