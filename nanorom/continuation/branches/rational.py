"""Rational functions from the Taylor series of a branch: steps beyond its radius of convergence.

A resonance is a pole of the branch as close to the real axis as its damping is small, and ends the
convergence of a series there. A common denominator of all unknowns takes the nearest poles away:
D(a) X(a) is a series that reaches on to the next singularity, two to four times as far. Sources:
Najah, Cochelin, Damil and Potier-Ferry 1998, Archives of Computational Methods in Engineering 5
(Pade approximants of branches); Gonnet, Guettel and Trefethen 2013, doi:10.1137/110853236 (least
squares and small coefficients against spurious poles).
"""

from __future__ import annotations

from functools import lru_cache
from math import comb

import numpy as np
from numpy.polynomial.polynomial import polyval

from nanorom.types import Array

POLES = 8  # degree of the denominator, at most
FITTED = 6  # orders it is fitted to
JUDGES = 2  # last orders, not fitted to, that tell how far the quotient reaches
FEW = 64  # unknowns below which another step costs no more than a quotient
HUGE = 1e100  # terms of a series that hardly converges at all
NOISE = 1e-12  # relative to the terms: round-off is no pole
AXIS = 0.005  # least angle between a pole and the real axis, seen from the start
FAR = 2.0  # radii of convergence beyond which a pole, true or not, does no harm
CANCELLED = 1e4  # factor by which terms of the denominator may exceed its value
GRID = 64  # points of a step at which the denominator is looked at
NEGLIGIBLE = 1e-17  # of the largest term at the end of an interval
REAL = 1e-7  # of the interval: imaginary part of a real root of a companion matrix
MOST_POLISH, POLISHES = 1e-3, 3  # of the interval: changes by Newton's method; how many


def denominator(terms: Array) -> Array:
    """D, D(0) = 1, for which the last terms of D(a) sum terms_k a^k are least.

    terms (order + 1, n); D is 1 where it would not pay, as of order up to POLES + FITTED + JUDGES.
    """
    last = len(terms) - 1 - JUDGES
    sizes = np.abs(terms).max(axis=1)
    few = last <= POLES + FITTED or terms.shape[1] < FEW
    if few or not sizes[[1, last]].all() or not sizes.max() < HUGE:
        return np.ones(1)
    radius = (sizes[1] / sizes[last]) ** (1.0 / (last - 1))
    scaled = terms * (radius ** np.arange(len(terms)) / sizes[1])[:, None]
    # the same lengths and angles in at most order + 1 coordinates
    compact = np.asarray(np.linalg.qr(scaled.T, mode="r")).T
    orders = np.arange(last - FITTED + 1, last + 1)
    past = compact[orders[:, None] - np.arange(1, POLES + 1)]  # (orders, poles, coordinates)
    matrix = past.transpose(0, 2, 1).reshape(-1, POLES)
    found = np.linalg.lstsq(matrix, -compact[orders].ravel(), rcond=NOISE)[0]
    # no resonance is so close to the axis: round-off, or a branch that crosses at this place
    inverse = np.roots(np.append(1.0, found))
    kept = (np.abs(inverse.imag) > AXIS * np.abs(inverse)) | (np.abs(inverse) < 1 / FAR)
    return np.atleast_1d(np.poly(inverse[kept] / radius)).real


def multiplied(polynomial: Array, terms: Array) -> Array:
    """Terms of polynomial(a) times sum terms_k a^k, as many as there were."""
    result = terms.copy()
    for j in range(1, len(polynomial)):
        result[j:] += polynomial[j] * terms[:-j]
    return result


def reach(terms: Array, polynomial: Array, bound: float) -> float:
    """The largest |a| up to which the last terms, over the denominator, stay below a bound, and the
    denominator away from zero.
    """
    orders = np.arange(len(terms) - JUDGES, len(terms))
    sizes = np.abs(terms[orders]).max(axis=1)
    if not sizes.any():
        return np.inf
    longest = min((bound / size) ** (1.0 / k) for size, k in zip(sizes, orders) if size > 0)
    if len(polynomial) == 1:
        return float(longest)
    a = np.linspace(0.0, longest, GRID + 1)
    lower = np.minimum(polyval(a, polynomial), polyval(-a, polynomial))
    lower = np.minimum.accumulate(lower)
    cancelled = polyval(a, np.abs(polynomial)) > CANCELLED * lower
    bad = cancelled | ((sizes * a[:, None] ** orders).max(axis=1) > bound * lower)
    return float(a[max(int(np.argmax(bad)) - 1, 0)] if bad.any() else longest)


@lru_cache(maxsize=64)
def _bernstein(count: int) -> Array:
    """Bernstein coefficients on [0, 1] of the powers below `count`, (count, count)."""
    return np.array([[comb(i, k) / comb(count - 1, k) for k in range(count)] for i in range(count)])


def real_roots(coefficients: Array, high: float) -> list[float]:
    """Real roots of a polynomial in (0, high], polished by Newton's method."""
    scaled = coefficients * high ** np.arange(len(coefficients))
    top = np.abs(scaled).max()
    if top == 0 or not np.isfinite(top):  # of a series that does not converge: no place is known
        return []
    significant = np.flatnonzero(np.abs(scaled) > NEGLIGIBLE * top)
    scaled = scaled[: significant[-1] + 1]
    # cheap test first: without a change of sign among its Bernstein coefficients it has none
    bernstein = _bernstein(len(scaled)) @ scaled
    if bernstein.min() > 0 or bernstein.max() < 0:
        return []
    roots = np.roots(scaled[::-1])
    real = roots.real[(np.abs(roots.imag) < REAL) & (roots.real > 0) & (roots.real <= 1)]
    derivative = scaled[1:] * np.arange(1, len(scaled))
    polished = []
    for root in np.sort(real):
        for _ in range(POLISHES):
            slope = polyval(root, derivative)
            if slope == 0:
                break
            change = float(polyval(root, scaled) / slope)
            root -= min(max(change, -MOST_POLISH), MOST_POLISH)
        polished.append(float(root * high))
    return polished
