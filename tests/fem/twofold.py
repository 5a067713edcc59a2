"""Round membranes and plates of two parts, without finite elements.

A disc of radius 1 that is one film up to r = a and another beyond: piecewise Bessel functions, and
Chebyshev collocation in each part where its tension is not constant.
"""

import numpy as np
from scipy.linalg import eig
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp, kv, kvp, yv, yvp

POINTS = 40  # of collocation in a part
STEPS = 1500  # of the scan for roots


def roots(function, low, high):
    """Zeros between low and high of a function that changes sign at each."""
    x = np.linspace(low, high, STEPS)
    values = np.array([function(each) for each in x])
    change = np.flatnonzero(values[:-1] * values[1:] < 0)
    return np.array([brentq(function, x[i], x[i + 1], xtol=1e-15, rtol=1e-14) for i in change])


def membrane(a, inner, outer, n, low, high):
    """Angular frequencies of n nodal diameters, tension 1, masses per area inner and outer."""

    def condition(omega):
        k, q = omega * np.sqrt(inner), omega * np.sqrt(outer)
        w = jv(n, q * a) * yv(n, q) - yv(n, q * a) * jv(n, q)
        slope = q * (jvp(n, q * a) * yv(n, q) - yvp(n, q * a) * jv(n, q))
        return jv(n, k * a) * slope - k * jvp(n, k * a) * w

    return roots(condition, low, high)


def membrane_shape(a, inner, outer, omega):
    """Slope of the axisymmetric mode of a frequency, 1 at its centre, as a function of r."""
    k, q = omega * np.sqrt(inner), omega * np.sqrt(outer)
    beyond = jv(0, q * a) * yv(0, q) - yv(0, q * a) * jv(0, q)
    scale = jv(0, k * a) / beyond

    def slope(r):
        outside = scale * q * (-jv(1, q * r) * yv(0, q) + yv(1, q * r) * jv(0, q))
        return np.where(r < a, -k * jv(1, k * r), outside)

    return slope


def plate(a, inner, outer, tension, nu, n, low, high):
    """Angular frequencies of a clamped plate; inner, outer: bending stiffness and mass per area."""

    def part(known, omega, kinds):
        bending, mass = known
        s = np.sqrt((tension / 2 / bending) ** 2 + mass * omega**2 / bending)
        waves = {"J": s - tension / 2 / bending, "I": s + tension / 2 / bending}
        waves |= {"Y": waves["J"], "K": waves["I"]}
        return [_bessel(kind, n, np.sqrt(waves[kind]), bending, tension, nu) for kind in kinds]

    def condition(omega):
        inside, outside = part(inner, omega, "JI"), part(outer, omega, "JYIK")
        matrix = np.zeros((6, 6))
        matrix[:4, :2] = np.transpose([at(a) for at in inside])
        matrix[:4, 2:] = -np.transpose([at(a) for at in outside])
        matrix[4:, 2:] = np.transpose([at(1.0)[:2] for at in outside])
        matrix /= np.abs(matrix).max(axis=1, keepdims=True)
        return np.linalg.det(matrix / np.abs(matrix).max(axis=0))

    return roots(condition, low, high)


def _bessel(kind, n, k, bending, tension, nu):
    """Deflection, slope, radial moment and Kirchhoff's shear of a Bessel function at r."""
    f, derivative = {"J": (jv, jvp), "Y": (yv, yvp), "I": (iv, ivp), "K": (kv, kvp)}[kind]
    sign = -1 if kind in "JY" else 1

    def at(r):
        w, slope = f(n, k * r), k * derivative(n, k * r)
        curvature = k * k * derivative(n, k * r, 2)
        moment = bending * (curvature + nu * (slope / r - n * n * w / r**2))
        twist = (1 - nu) * n * n / r * (slope / r - w / r**2)
        shear = bending * (sign * k * k * slope - twist) - tension * slope
        return np.array([w, slope, moment, shear])

    return at


def _chebyshev(low, high):
    """Points from low to high, and the matrix that differentiates values there."""
    i = np.arange(POINTS + 1)
    x = -np.cos(np.pi * i / POINTS)
    c = np.where((i == 0) | (i == POINTS), 2.0, 1.0) * (-1.0) ** i
    apart = x[:, None] - x + np.eye(len(x))
    d = np.outer(c, 1 / c) / apart
    d -= np.diag(d.sum(axis=1))
    return low + (high - low) * (x + 1) / 2, 2 / (high - low) * d


def _parts(a):
    return _chebyshev(0.0, a), _chebyshev(a, 1.0)


def stretched(a, stiffness, nu, slope):
    """Cubic coefficient B of w = q phi(r): eta = B q^3; stiffness: E h inside and outside.

    The in-plane displacement is in equilibrium with phi'^2/2, held at r = 1.
    """
    size, rows, right = POINTS + 1, [], []
    law = [e / (1 - nu**2) for e in stiffness]
    known = []
    for number, (r, d) in enumerate(_parts(a)):
        own = np.zeros((size, 2 * size))
        own[:, number * size : (number + 1) * size] = np.eye(size)
        half = slope(r) ** 2 / 2
        if number == 0:
            half[-1] = slope(np.array(a - 1e-15)) ** 2 / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            hoop = np.where(r[:, None] > 0, np.eye(size) / r[:, None], d)
        radial = law[number] * (d + nu * hoop) @ own
        given = law[number] * half
        ring = law[number] * (hoop + nu * d) @ own
        known.append((r, d, own, half, hoop, radial, given, ring))
        force = r[:, None] * (d @ radial) + radial - ring  # (r N_r)' - N_t = 0
        load = r * (d @ given) + (1 - nu) * given
        rows.append(force[1:-1])
        right.append(-load[1:-1])
    inner, outer = known
    rows += [inner[2][:1], outer[2][-1:], inner[2][-1:] - outer[2][:1]]
    right += [[0.0], [0.0], [0.0]]
    rows.append(inner[5][-1:] - outer[5][:1])
    right.append([outer[6][0] - inner[6][-1]])
    u = np.linalg.solve(np.vstack(rows), np.concatenate(right))
    total = 0.0
    for (r, d, own, half, hoop, *_), c in zip(known, law):
        e, t = d @ (own @ u) + half, hoop @ (own @ u)
        density = c * (e * e + t * t + 2 * nu * e * t) * np.pi * r
        total += _integral(density, r)
    return 4 * total


def _integral(values, r):
    """Of values at Chebyshev points of an interval (Clenshaw and Curtis)."""
    fit = np.polynomial.Chebyshev.fit(r, values, len(r) - 1, domain=(r[0], r[-1]))
    whole = fit.integ()
    return float(whole(r[-1]) - whole(r[0]))


def relaxed(a, stiffness, tension, nu):
    """Membrane forces (radial, hoop) as functions of r: tension before, (inside, outside).

    u = c r inside, d (r - 1/r) outside.
    """
    bulk, inside = [e / (1 - nu) for e in stiffness], tension[0]
    shear = stiffness[1] / (1 + nu)
    # u: c a = d (a - 1/a); force: inside + bulk c = outside + d (bulk + shear/a^2)
    ratio = 1 - 1 / a**2
    d = (inside - tension[1]) / (bulk[1] + shear / a**2 - bulk[0] * ratio)
    even, varied = tension[1] + bulk[1] * d, shear * d
    flat = inside + bulk[0] * d * ratio

    def forces(r):
        within = r < a
        radial = np.where(within, flat, even + varied / np.maximum(r, a / 2) ** 2)
        hoop = np.where(within, flat, even - varied / np.maximum(r, a / 2) ** 2)
        return radial, hoop

    return forces


def membrane_under(a, mass, forces, n, count):
    """Angular frequencies (count,) of a membrane of two masses under forces of r."""
    size = POINTS + 1
    k, m, joints = [], [], []
    for number, (r, d) in enumerate(_parts(a)):
        own = np.zeros((size, 2 * size))
        own[:, number * size : (number + 1) * size] = np.eye(size)
        at = np.where(r == a, a * (1 - 1e-15) if number == 0 else a, r)
        radial, hoop = forces(at)
        operator = d @ np.diag(r * radial) @ d * r[:, None] - np.diag(n * n * hoop)
        k.append((-operator @ own)[1:-1])
        m.append((np.diag(mass[number] * r**2) @ own)[1:-1])
        joints.append((own, radial[:, None] * (d @ own), d @ own))
    (inner, pull, turned), (outer, pulled, _) = joints
    centre = turned[:1] if n == 0 else inner[:1]
    k += [centre, outer[-1:], inner[-1:] - outer[:1], pull[-1:] - pulled[:1]]
    m.append(np.zeros((4, 2 * size)))
    values = eig(np.vstack(k), np.vstack(m), right=False)
    real = values[np.isfinite(values) & (np.abs(values.imag) < 1e-6 * np.abs(values))].real
    return np.sqrt(np.sort(real[real > 0])[:count])
