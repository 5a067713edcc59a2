"""Functions of one coordinate on element lines that shrink towards ends: for `tests.fem.hp`."""

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from scipy.sparse import coo_matrix
from scipy.special import eval_jacobi

SHRINK = 0.13  # of neighbouring elements towards a side
FEWEST, WIDEST = 3, 0.16  # elements between them, at least; largest of these


def lines(length, steps, layers):
    """Element lines from 0 to a length, shrinking towards its ends and both sides of steps."""
    fixed = [0.0, *steps, length]
    found = []
    for low, high in zip(fixed, fixed[1:]):
        begin, end = (layers if at in (0.0, length) else 1 for at in (low, high))
        half = 0.5 * (high - low)
        grown = [half * SHRINK**k for k in range(max(begin, end), 0, -1)]
        count = max(FEWEST, int(np.ceil((high - low) / WIDEST)))
        inside = np.linspace(low + grown[-1], high - grown[-1], count + 1)[1:-1]
        found += [low, *(low + d for d in grown[-begin:]), *inside]
        found += [high - d for d in reversed(grown[-end:])]
    return np.array([*found, length])


def shape_functions(s, p, smooth):
    """Values (3, functions, points) on (-1, 1) with two derivatives; the ends' come first."""
    if smooth:
        ends = [[2, -3, 0, 1], [1, -1, -1, 1], [2, 3, 0, -1], [-1, -1, 1, 1]]  # value and slope
        ends = [np.array(c) / 4 for c in ends]
        square, weight = np.array([1.0, 0, -2, 0, 1]), 4
    else:
        ends = [np.array([0.5, -0.5]), np.array([0.5, 0.5])]
        square, weight = np.array([1.0, 0, -1]), 2
    count = p + 1 - len(ends)
    polynomials = [np.polynomial.Polynomial(c) for c in ends]
    found = [[q.deriv(d)(s) if d else q(s) for d in range(3)] for q in polynomials]
    bubble = np.polynomial.Polynomial(square)
    for k in range(count):
        j = [eval_jacobi(k, weight, weight, s)]
        for d in (1, 2):
            factor = np.prod([(k + 2 * weight + 1 + i) / 2 for i in range(d)])
            lower = eval_jacobi(k - d, weight + d, weight + d, s) if k >= d else 0 * s
            j.append(factor * lower)
        g = [bubble(s), bubble.deriv(1)(s), bubble.deriv(2)(s)]
        rows = [g[0] * j[0], g[1] * j[0] + g[0] * j[1], g[2] * j[0] + 2 * g[1] * j[1] + g[0] * j[2]]
        found.append([row / bubble_height(k, weight) for row in rows])
    return np.array(found).transpose(1, 0, 2)


@lru_cache(maxsize=64)
def bubble_height(k, weight):
    """About the largest value of (1 - s^2)^(weight/2) P_k(weight, weight)."""
    s = np.linspace(-1, 1, 101)
    return float(np.abs((1 - s**2) ** (weight // 2) * eval_jacobi(k, weight, weight, s)).max())


class Axis:
    """Functions of one coordinate: `at` (points) gives three sparse (points, functions)."""

    def __init__(self, lines, p, smooth, first, last):
        self.lines, self.p, self.smooth = lines, p, smooth
        cells, at_end = len(lines) - 1, 2 if smooth else 1
        inner = p + 1 - 2 * at_end
        number = np.empty((cells, p + 1), dtype=int)
        for e in range(cells):
            number[e, :at_end] = at_end * e + np.arange(at_end)
            number[e, at_end : 2 * at_end] = at_end * (e + 1) + np.arange(at_end)
            number[e, 2 * at_end :] = at_end * (cells + 1) + inner * e + np.arange(inner)
        kept = np.ones(at_end * (cells + 1) + inner * cells, dtype=bool)
        kept[:at_end], kept[at_end * cells : at_end * (cells + 1)] = first[:at_end], last[:at_end]
        self.number = np.where(kept, np.cumsum(kept) - 1, -1)[number]
        self.size = int(kept.sum())

    def rule(self, points):
        """Gauss points and weights on all elements."""
        s, w = legendre.leggauss(points)
        middle, half = (self.lines[1:] + self.lines[:-1]) / 2, np.diff(self.lines) / 2
        return (middle[:, None] + half[:, None] * s).ravel(), (half[:, None] * w).ravel()

    def at(self, x):
        cell = np.clip(np.searchsorted(self.lines, x, side="right") - 1, 0, len(self.lines) - 2)
        middle, half = (self.lines[1:] + self.lines[:-1])[cell] / 2, np.diff(self.lines)[cell] / 2
        values = shape_functions((x - middle) / half, self.p, self.smooth)
        if self.smooth:  # slopes by the element's length, as its neighbour's
            values[:, [1, 3]] *= half
        number = self.number[cell].T
        rows = np.broadcast_to(np.arange(len(x)), number.shape)
        held = number < 0
        return [
            coo_matrix(
                (
                    np.where(held, 0, v / half**d).ravel(),
                    (rows.ravel(), np.maximum(number, 0).ravel()),
                ),
                shape=(len(x), self.size),
            ).tocsr()
            for d, v in enumerate(values)
        ]
