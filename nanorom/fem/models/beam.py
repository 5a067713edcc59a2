"""Doubly held strings and beams in one dimension, with stretching; NumPy and SciPy only.

    rho A w'' + (E I w_xx)_xx - [S + E A/(2 L) int w_x^2 dx] w_xx = 0

with both ends immovable (Euler-Bernoulli with mid-plane stretching; Nayfeh and Mook 1979,
section 7.2).  The axial displacement is condensed exactly: the axial force is uniform.  Shapes are
polynomials in Shen's basis (1994, doi:10.1137/0915089), which converges exponentially.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.polynomial import legendre

from nanorom.errors import SolverError
from nanorom.scene.support import Kind, Spring
from nanorom.types import Array

CONVERGED = 1e-11  # change of frequencies when the basis grows by half
ROUNDING = 5e-13  # of frequencies and coefficients: measured
MOST_FUNCTIONS = 1000  # a layer of 1e-4 of the length takes 700, in a second


@attrs.frozen
class Beam:
    """A beam between immovable ends, in any consistent units.

    length; axial_stiffness: E A; bending_stiffness: E I (0: a string); tension: S;
    mass_per_length: rho A; ends: (left, right), each "clamped", "simply_supported" or a `Spring` of
    its stiffness in force per displacement and moment per angle.
    """

    length: float
    axial_stiffness: float
    bending_stiffness: float
    tension: float
    mass_per_length: float
    ends: tuple[Kind, Kind] = ("clamped", "clamped")

    @property
    def axial_frequency(self) -> float:
        """Of the slowest axial motion, which condensation takes to be infinitely fast."""
        velocity = np.sqrt(self.axial_stiffness / self.mass_per_length)
        return float(velocity / (2 * self.length))

    def end_stiffness(self, first: Array, second: Array) -> Array:
        """Stiffness (n, n) of elastic ends for functions of values and slopes (2, n) there."""
        total = np.zeros((first.shape[1],) * 2)
        for kind, w, slope in zip(self.ends, first, second):
            if isinstance(kind, Spring):
                total += (kind.spring or 0.0) * np.outer(w, w)
                total += kind.rotational * (self.bending_stiffness > 0) * np.outer(slope, slope)
        return total


@attrs.frozen(eq=False)
class BeamModes:
    """The lowest modes, scaled to max |phi| = 1 and positive there.

    frequency: (L,) Hz; mass: (L,); stiffness: (L, L), bending: (L, L) its part of that; square:
    (L,) int phi^2 dx; area: (L,) int phi dx; slope: (L, L) int phi_j' phi_k' dx; reaction: (L, 2)
    transverse force of both ends; functions: of the basis; error: estimated relative errors of
    frequencies and of the cubic tensor.
    """

    beam: Beam
    frequency: Array
    mass: Array
    stiffness: Array
    bending: Array
    square: Array
    area: Array
    slope: Array
    reaction: Array
    functions: int
    _coefficients: Array
    error: tuple[float, float] = (np.nan, np.nan)

    @property
    def cubic(self) -> Array:
        """(L, L, L, L) with the force B_rjkl q_j q_k q_l."""
        pairs = self.slope[:, :, None, None] * self.slope
        symmetric = (pairs + pairs.transpose(0, 2, 1, 3) + pairs.transpose(0, 3, 2, 1)) / 3
        return np.asarray(self.beam.axial_stiffness / (2 * self.beam.length) * symmetric)

    def completed(self) -> BeamModes:
        """All modes of the same basis: as many as it has functions."""
        return _expanded(self.beam, *_solve(self.beam, self.functions, self.functions))

    def shapes(self, x: Array) -> Array:
        """Shapes (L, n) at positions x (n,) from 0 to the length."""
        return legendre.legval(2 * np.asarray(x) / self.beam.length - 1, self._coefficients.T)


def modes(beam: Beam, count: int) -> BeamModes:
    """The ``count`` lowest modes of a beam; raises SolverError if it buckles or is not resolved."""
    size = 2 * count + 20
    coarse = _expanded(beam, *_solve(beam, size, count))
    while True:
        size += size // 2
        if size > MOST_FUNCTIONS:
            raise SolverError(
                f"{count} modes of a beam with layers of {_layer(beam):.1e} of its length are not "
                f"resolved by {MOST_FUNCTIONS} functions; ask for fewer modes or use a string"
            )
        fine = _expanded(beam, *_solve(beam, size, count))
        frequency, cubic = (
            np.abs(a - b).max() / np.abs(b).max()
            for a, b in ((coarse.frequency, fine.frequency), (coarse.cubic, fine.cubic))
        )
        if max(frequency, cubic) < CONVERGED:
            return attrs.evolve(fine, error=(frequency + ROUNDING, cubic + ROUNDING))
        coarse = fine


def _expanded(beam: Beam, squares: Array, coefficients: Array) -> BeamModes:
    """Modes of given squared angular frequencies (L,) and Legendre coefficients (L, n)."""
    size = coefficients.shape[1] - len(_conditions(beam))
    coefficients = coefficients / _peaks(coefficients)[:, None]
    half = beam.length / 2
    x, weights = legendre.leggauss(coefficients.shape[1] + 2)
    phi = legendre.legval(x, coefficients.T)
    first = legendre.legval(x, legendre.legder(coefficients, 1, axis=1).T) / half
    second = legendre.legval(x, legendre.legder(coefficients, 2, axis=1).T) / half**2
    weights = half * weights
    slope = (first * weights) @ first.T

    def left_over(side: float) -> Array:
        """Of the weak form for the cubic that is 1 at one end, with no slope at either."""
        value, rise, bent = (2 + side * (3 * x - x**3)) / 4, 0.75 * (1 - x**2), -1.5 * x
        force = beam.tension / half * first * side * rise
        force += beam.bending_stiffness / half**2 * second * side * bent
        force -= beam.mass_per_length * squares[:, None] * phi * value
        return np.asarray(force @ weights)

    bending = beam.bending_stiffness * (second * weights) @ second.T
    stiffness = beam.tension * slope + bending
    stiffness += beam.end_stiffness(*_at_ends(coefficients, half))
    return BeamModes(
        beam,
        np.sqrt(squares) / (2 * np.pi),
        beam.mass_per_length * np.sum(phi**2 * weights, axis=1),
        stiffness,
        bending,
        np.sum(phi**2 * weights, axis=1),
        phi @ weights,
        slope,
        np.column_stack([left_over(side) for side in (-1.0, 1.0)]),
        size,
        coefficients,
    )


def _layer(beam: Beam) -> float:
    """Width of the bending layer at a clamped end, relative to the length."""
    return float(np.sqrt(beam.bending_stiffness / max(beam.tension, 1e-300))) / beam.length


def _solve(beam: Beam, size: int, count: int) -> tuple[Array, Array]:
    """Squared angular frequencies and Legendre coefficients (count, size + 4) of the shapes."""
    from scipy.linalg import eigh

    basis = _basis(beam, size)
    half = beam.length / 2
    n = basis.shape[1]
    norm = 2 / (2 * np.arange(n) + 1)
    first = legendre.legder(basis, 1, axis=1)
    second = legendre.legder(basis, 2, axis=1)
    mass = beam.mass_per_length * half * (basis * norm) @ basis.T
    stiffness = beam.tension / half * (first * norm[:-1]) @ first.T
    stiffness += beam.bending_stiffness / half**3 * (second * norm[:-2]) @ second.T
    stiffness += beam.end_stiffness(*_at_ends(basis, half))
    scale = 1 / np.sqrt(np.abs(np.diag(stiffness)))
    stiffness, mass = (m * np.outer(scale, scale) for m in (stiffness, mass))
    if np.linalg.eigvalsh(stiffness)[0] <= 0:
        raise SolverError(
            "the beam is not stable: its compression exceeds the buckling load, raise the tension"
        )
    # the inverse pencil: its largest eigenvalues are the well-determined ones
    inverse, vectors = eigh(mass, stiffness, subset_by_index=(size - count, size - 1))
    return 1 / inverse[::-1], (scale[:, None] * vectors[:, ::-1]).T @ basis


def _at_ends(coefficients: Array, half: float) -> tuple[Array, Array]:
    """Values and slopes (2, n) at both ends of functions with Legendre coefficients (n, m)."""
    ends = np.array([-1.0, 1.0])
    slopes = legendre.legval(ends, legendre.legder(coefficients, 1, axis=1).T) / half
    return legendre.legval(ends, coefficients.T).T, slopes.T


def _basis(beam: Beam, size: int) -> Array:
    """Legendre coefficients (size, size + 4) of functions that meet the ends' conditions.

    P_k plus the next ones, as many as there are conditions w = 0 and, at a clamped end, w' = 0.
    """
    conditions = _conditions(beam)
    n = len(conditions)
    degrees = np.arange(size + n)
    values = {(end, 0): end**degrees for end in (-1.0, 1.0)} | {
        (end, 1): end ** (degrees + 1) * degrees * (degrees + 1) / 2 for end in (-1.0, 1.0)
    }
    basis = np.eye(size, size + n)
    if n == 0:
        return basis
    rows = np.array([values[c] for c in conditions])
    rows = rows / np.abs(rows).max(axis=1, keepdims=True)
    for k in range(size):
        basis[k, k + 1 : k + 1 + n] = np.linalg.solve(rows[:, k + 1 : k + 1 + n], -rows[:, k])
    return basis


def _conditions(beam: Beam) -> list[tuple[float, int]]:
    """Ends, at -1 and 1, and the derivative that is zero there."""
    found = []
    for end, kind in zip((-1.0, 1.0), beam.ends):
        if not isinstance(kind, Spring) or kind.spring is None:
            found.append((end, 0))
        if kind == "clamped" and beam.bending_stiffness > 0:
            found.append((end, 1))
    return found


def _peaks(coefficients: Array) -> Array:
    """Largest |phi| of every shape, signed as at the first of equal ones from the left."""
    grid = np.cos(np.linspace(np.pi, 0, 20 * coefficients.shape[1]))
    peaks = np.empty(len(coefficients))
    for i, c in enumerate(coefficients):
        size = np.abs(legendre.legval(grid, c))
        inside = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])
        tops = 1 + np.flatnonzero(inside & (size[1:-1] > (1 - 1e-3) * size.max()))
        x = grid[tops]
        d1, d2 = legendre.legder(c), legendre.legder(c, 2)
        for _ in range(6):
            x = x - legendre.legval(x, d1) / legendre.legval(x, d2)
        values = legendre.legval(np.concatenate([[-1.0], x, [1.0]]), c)
        values = values[np.abs(values) > (1 - 1e-9) * np.abs(values).max()]
        peaks[i] = np.sign(values[0]) * np.abs(values).max()
    return peaks
