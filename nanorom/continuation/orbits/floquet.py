"""Floquet multipliers of periodic orbits from the variational equation along them.

The tangent stiffness of a Fourier orbit is a trigonometric polynomial. It couples only such modes
as the moving ones couple: under a symmetric load the modes of a film fall into classes, and the
variational equation into as many independent parts. A product tree over the intervals of the
period (`variation`) gives the monodromy matrix of each part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from nanorom.continuation.orbits.harmonics import (
    Support,
    differentiate,
    fourier_matrix,
    symmetry_signs,
)
from nanorom.continuation.orbits.pairs import Index
from nanorom.continuation.orbits.parts import Part, independent_parts
from nanorom.continuation.orbits.product import LARGE, product, product_eigenvalues
from nanorom.continuation.orbits.splitting import Splitting
from nanorom.continuation.orbits.variation import Variation
from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array

BATCH_DOUBLES = 400_000
SupportKey = tuple[bytes, tuple[int, ...]]
TRUNCATION = 1e-13  # last terms of the series, relative to the map
COARSE = 1e-10  # truncation from which splitting costs less than a series
FINE = 1e-11  # at which a series costs little more than at a coarser one
DIGITS = 10  # of moduli that tell multipliers apart when they are sorted
TINY = 1e-300  # modulus below which none is told from zero


@lru_cache(maxsize=32)
def _sampling(harmonics: int, period_multiple: int, tones: int) -> tuple[Array, Array, Array]:
    """Synthesis (N, 2H + 1), analysis (4H + 1, N) and terms of the drive (N, 2K + 1) for the
    tangent stiffness of an orbit.
    """
    wide = max(2 * harmonics, tones * period_multiple)
    count = 2 * wide + 2
    angles = 2 * np.pi / count * np.arange(count)
    everything = fourier_matrix(angles, wide)
    weights = np.full(2 * wide + 1, 2.0 / count)
    weights[0] = 1.0 / count
    synthesis = np.ascontiguousarray(everything[:, : 2 * harmonics + 1])
    return (
        synthesis,
        np.ascontiguousarray((everything * weights).T),
        fourier_matrix(period_multiple * angles, tones),
    )


@dataclass(frozen=True, eq=False)
class _Motion:
    """Samples (n, N, m) of the moving modes of orbits and of their velocities (where those matter);
    what turns samples into Fourier coefficients; the terms of the drive (N, 2K + 1).
    """

    rates: Array
    v: Array
    z: Array | None
    analysis: Array
    drive: Array

    def some(self, chosen: slice) -> _Motion:
        z = None if self.z is None else self.z[chosen]
        return replace(self, rates=self.rates[chosen], v=self.v[chosen], z=z)


class FloquetSolver:
    """Monodromy matrices and multipliers of orbits of one system, all modes."""

    def __init__(self, system: ScaledSystem, truncation: float = TRUNCATION) -> None:
        self.system, self.truncation = system, truncation
        self.size = system.size
        self.has_loss = system.has_loss
        self.fastest, self.relaxation = system.fastest, system.relaxation
        self._signs: dict[SupportKey, Array | None] = {}
        self._variations: dict[Part, Variation | Splitting] = {}
        # intervals times rate, learnt on the way
        self._density: dict[tuple[int, bool, int], float] = {}

    def parts(self, support: Support) -> tuple[Index, list[Part]]:
        """The modes that move in a support and the independent parts of the equations."""
        moving = np.flatnonzero(support.table.any(axis=1))
        return moving, independent_parts(self.system, moving)

    def _variation(self, part: Part) -> Variation | Splitting:
        if part not in self._variations:
            given = part.damping, part.inertia
            self._variations[part] = (
                Splitting(part.damping.diagonal().copy(), self.truncation)
                if self.truncation >= COARSE and Splitting.serves(*given, part.has_loss)
                else Variation(*given, min(self.truncation, FINE))
            )
        return self._variations[part]

    def _harmonics(self, part: Part, motion: _Motion) -> tuple[Array, Array | None]:
        """Fourier coefficients (n, F, Lp, Lp) of a part's tangent stiffness and damping."""
        v, z, analysis, drive = motion.v, motion.z, motion.analysis, motion.drive
        n, count, size = v.shape
        flat = v.reshape(n * count, size)
        stiffness = part.cubic.of(flat).reshape(n, count, -1)
        if part.quadratic.any():
            stiffness += v @ part.quadratic
        stiffness += part.stiffness.ravel()
        if part.parametric.any():
            stiffness -= drive @ part.parametric
        damping = None
        if z is not None:
            mixed = np.einsum("rkjl,nsl,nsk->nsrj", part.mixed, v, z, optimize=True)
            stiffness += mixed.reshape(n, count, -1)
            damping = part.loss.of(flat).reshape(n, count, -1) + part.damping.ravel()
            damping = (analysis @ damping).reshape(n, -1, part.size, part.size)
        return (analysis @ stiffness).reshape(n, -1, part.size, part.size), damping

    def maps(
        self, orbits: Array, rates: Array, period_multiple: int, support: Support
    ) -> tuple[Array, Array]:
        """Fundamental matrices over one period, or over half of it (with the symmetry applied) if
        symmetric, and their eigenvalues.

        orbits (n, 2H + 1, L), rates (n,) = omega / period_multiple; result (n, d): the matrices of
        the parts, flattened one after the other, and (n, 2L).
        """
        moving, parts = self.parts(support)
        harmonics = (orbits.shape[1] - 1) // 2
        synthesis, analysis, drive = _sampling(harmonics, period_multiple, self.system.tones)
        z = None
        if self.has_loss:
            slopes = np.stack([differentiate(orbit) for orbit in orbits])
            z = rates[:, None, None] * (synthesis @ slopes[:, :, moving])
        motion = _Motion(rates, synthesis @ orbits[:, :, moving], z, analysis, drive)
        found = [self._part_maps(part, motion, period_multiple, support) for part in parts]
        matrices = [matrix.reshape(len(orbits), -1) for matrix, _ in found]
        values = np.concatenate([eigenvalues for _, eigenvalues in found], axis=1)
        return np.concatenate(matrices, axis=1), values

    def _part_maps(
        self, part: Part, motion: _Motion, period_multiple: int, support: Support
    ) -> tuple[Array, Array]:
        """Matrices (n, 2 Lp, 2 Lp) and eigenvalues (n, 2 Lp) of one part."""
        size, rates = part.size, motion.rates
        signs = self.signs(support)
        half = signs is not None
        key = (period_multiple, half, int(part.modes[0]))
        variation = self._variation(part)
        start = (np.pi if half else 2 * np.pi) * max(self.fastest, self.relaxation) / 2.5
        density = self._density.get(key, start)
        intervals = max(3, int(np.ceil(density / float(rates.min()))))
        per_orbit = intervals * variation.depth * 3 * size * size
        batch = max(1, BATCH_DOUBLES // per_orbit)
        result = np.empty((len(rates), 2 * size, 2 * size))
        eigenvalues = np.empty((len(rates), 2 * size), dtype=complex)
        for first in range(0, len(rates), batch):
            some = slice(first, first + batch)
            stiffness, damping = self._harmonics(part, motion.some(some))
            maps, intervals = variation.propagate(stiffness, damping, rates[some], intervals, half)
            if signs is not None:
                maps[:, -1] *= np.tile(signs[part.modes], 2)[:, None]
            result[some] = product(maps)
            eigenvalues[some] = np.linalg.eigvals(result[some])
            for i in np.flatnonzero(np.abs(result[some]).max(axis=(1, 2)) > LARGE):
                eigenvalues[first + i] = product_eigenvalues(maps[i])
        self._density[key] = intervals * float(rates.min())
        return result, eigenvalues

    def entries(self, support: Support) -> int:
        """Number of entries d of the independent parts of a monodromy matrix."""
        return sum(4 * part.size**2 for part in self.parts(support)[1])

    def pairs(self, support: Support) -> tuple[Index, Index]:
        """Numbers of the first and the second of all pairs of eigenvalues of the same part."""
        ends = np.cumsum([2 * part.size for part in self.parts(support)[1]])
        starts = np.append(0, ends[:-1])
        found = [np.triu_indices(end - start, 1) for start, end in zip(starts, ends)]
        first, second = (
            np.concatenate([pair[i] + start for pair, start in zip(found, starts)]) for i in (0, 1)
        )
        return first, second

    def eigenvalues(self, matrices: Array, support: Support) -> Array:
        """Eigenvalues (n, 2L) of matrices (n, d) as `maps` returns them."""
        _, parts = self.parts(support)
        values, first = [], 0
        for part in parts:
            side = 2 * part.size
            block = matrices[:, first : first + side * side].reshape(-1, side, side)
            values.append(np.linalg.eigvals(block).astype(complex))
            first += side * side
        return np.concatenate(values, axis=1)

    def monodromy(
        self, orbits: Array, rates: Array, period_multiple: int, support: Support
    ) -> tuple[Array, Array]:
        """As `maps`, with the matrices (n, 2L, 2L) for the state (q, q')."""
        matrices, eigenvalues = self.maps(orbits, rates, period_multiple, support)
        result = np.zeros((len(orbits), 2 * self.size, 2 * self.size))
        first = 0
        for part in self.parts(support)[1]:
            place = np.append(part.modes, self.size + part.modes)
            side = len(place)
            block = matrices[:, first : first + side * side].reshape(-1, side, side)
            result[:, place[:, None], place] = block
            first += side * side
        return result, eigenvalues

    def signs(self, support: Support) -> Array | None:
        """The signs of the half-period symmetry of orbits in a support, if they have it."""
        key = _key(support)
        if key not in self._signs:
            self._signs[key] = symmetry_signs(self.system, support, support.modulus // 2)
        return self._signs[key]

    def multipliers(
        self, orbits: Array, rates: Array, period_multiple: int, support: Support
    ) -> Array:
        """All multipliers (n, 2L) over the whole period, largest modulus first."""
        _, values = self.maps(orbits, rates, period_multiple, support)
        return sort_multipliers(values if self.signs(support) is None else values**2)


def _key(support: Support) -> SupportKey:
    return support.table.tobytes(), support.table.shape


def sort_multipliers(values: Array) -> Array:
    """Largest modulus first, conjugates with the positive imaginary part first."""
    # to ten digits, relative to each: conjugates must not be told apart by round-off
    sizes = np.log(np.maximum(np.abs(values), TINY))
    keys = np.lexsort((-values.imag, -np.round(sizes, DIGITS)), axis=-1)
    return np.take_along_axis(values, keys, axis=-1)
