"""Elastic laws of films in plane stress, as matrices on (xx, yy, 2 xy).

Reduced stiffnesses of orthotropic films and their turning: Jones, Mechanics of Composite Materials
(1999), sections 2.5 and 2.6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nanorom.types import Array

ALIGNED = 1e-12  # of the largest entry: what turning by right angles leaves by rounding

Law = tuple[tuple[float, float, float], ...]


class Engineering(NamedTuple):
    """Young's modulus along the first axis and Poisson's ratio from it to the second, shear's."""

    first: float
    second: float
    ratio: float
    shear: float


def isotropic(nu: float) -> Law:
    """Stress per E of a strain."""
    return scaled(isotropic_moments(nu), 1 / (1 - nu**2))


def isotropic_moments(nu: float) -> Law:
    """Moments per D of a curvature, linear in nu."""
    return as_law(np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]))


def orthotropic(known: Engineering, angle: float) -> Law:
    """Stress per unit of the moduli, the first axis at an angle (rad) from x."""
    e, f, nu, shear = known
    rest = 1 - nu**2 * f / e
    law = np.array([[e, nu * f, 0], [nu * f, f, 0], [0, 0, rest * shear]]) / rest
    return as_law(turned(law, angle))


def turned(law: Array, angle: float) -> Array:
    """The law (3, 3) along x and y of one along axes of which the first is at an angle from x."""
    c, s = np.cos(angle), np.sin(angle)
    strain = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, 0]])
    strain[2, 2] = c * c - s * s
    found = strain.T @ law @ strain
    found[np.abs(found) < ALIGNED * np.abs(found).max()] = 0.0
    return np.asarray(found)


def of_cubic(c11: float, c12: float, c44: float) -> Engineering:
    """Moduli of a cubic crystal's (001) film along its axes: stress across it is none."""
    along, between = c11 - c12**2 / c11, c12 - c12**2 / c11
    nu = between / along
    modulus = along * (1 - nu**2)
    return Engineering(modulus, modulus, nu, c44)


def is_aligned(law: Law) -> bool:
    """Strains along x and y make no shear: both axes are mirrors."""
    return law[0][2] == 0.0 == law[1][2]


def is_square(law: Law) -> bool:
    """The law stays as it is when x and y change places."""
    return is_aligned(law) and abs(law[0][0] - law[1][1]) <= ALIGNED * law[0][0]


def scaled(law: Law, factor: float) -> Law:
    """A law times a factor."""
    return as_law(factor * np.array(law))


def stiffest(law: Law) -> float:
    """Largest stress along a direction by the strain along it, the others held."""
    angle = np.linspace(0, np.pi, 181)
    c, s = np.cos(angle), np.sin(angle)
    along = np.stack([c * c, s * s, c * s])
    return float(np.einsum("in,ij,jn->n", along, np.array(law), along).max())


def as_law(law: Array) -> Law:
    """A matrix (3, 3) as a law."""
    return tuple((float(a), float(b), float(c)) for a, b, c in law)
