"""Fourier bases of periodic orbits: which harmonics of which modes take part, sampling, products.

An orbit of period_multiple p is a function of the angle theta = omega t / p. Its coefficients are
kept harmonic-major in the order [1, cos, sin, cos 2, sin 2, ...] as an array (2H + 1, L), so that
changing the number of harmonics H only cuts or pads rows.
"""

from __future__ import annotations

from copy import copy
from functools import lru_cache
from itertools import combinations_with_replacement, product

import numpy as np
from numpy.typing import NDArray

from nanorom.continuation.orbits.groups import Between, Group, Products
from nanorom.continuation.orbits.patterns import patterns
from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array

Index = NDArray[np.int64]
LONG_LADDER = (180, 216, 260, 312, 375, 450, 540, 650)  # for few modes
HARMONIC_LADDER = (3, 5, 7, 9, 11, 13, 15, 18, 21, 25, 30, 36, 43, 51, 61, 73, 87, 104, 125, 150)
BANDS = 8  # of harmonics
ABSENT = 1e-9  # coefficients of an orbit, relative to the largest, that are round-off


def fourier_matrix(angles: Array, harmonics: int) -> Array:
    """Values of [1, cos, sin, cos 2, sin 2, ...] at the angles, shape (..., 2H + 1)."""
    phases = np.multiply.outer(angles, np.arange(1, harmonics + 1))
    values = np.empty(np.shape(angles) + (2 * harmonics + 1,))
    values[..., 0] = 1.0
    values[..., 1::2] = np.cos(phases)
    values[..., 2::2] = np.sin(phases)
    return values


def differentiate(coefficients: Array) -> Array:
    """d/dtheta of coefficients (2H + 1, ...) in the interleaved order."""
    result = np.zeros_like(coefficients)
    order = np.arange(1, (len(coefficients) - 1) // 2 + 1).reshape(
        (-1,) + (1,) * (coefficients.ndim - 1)
    )
    result[1::2] = order * coefficients[2::2]
    result[2::2] = -order * coefficients[1::2]
    return result


def resize(coefficients: Array, harmonics: int) -> Array:
    """The same function cut or padded to another number of harmonics."""
    result = np.zeros((2 * harmonics + 1,) + coefficients.shape[1:])
    rows = min(len(result), len(coefficients))
    result[:rows] = coefficients[:rows]
    return result


def turned(coefficients: Array, angle: float) -> Array:
    """The function of theta + angle."""
    numbers = (np.arange(len(coefficients)) + 1) // 2
    phase = angle * numbers[:, None]
    moved = np.cos(phase) * coefficients
    moved[1::2] += np.sin(phase[1::2]) * coefficients[2::2]
    moved[2::2] -= np.sin(phase[2::2]) * coefficients[1::2]
    return np.asarray(moved)


def stretch(coefficients: Array, factor: int) -> Array:
    """The same motion as a function of theta / factor: harmonic k becomes factor k."""
    harmonics = (len(coefficients) - 1) // 2
    result = np.zeros((2 * harmonics * factor + 1,) + coefficients.shape[1:])
    result[0] = coefficients[0]
    result[2 * factor - 1 :: 2 * factor] = coefficients[1::2]
    result[2 * factor :: 2 * factor] = coefficients[2::2]
    return result


class Support:
    """Which residues of the harmonic number (modulo 2p) each mode has: an invariant subspace of the
    equations.

    `table` (L, 2p) is closed under the equations: an orbit that starts inside stays inside, so
    modes and harmonics outside cost nothing. Symmetric systems have odd harmonics only; undriven
    modes rest.
    """

    def __init__(self, table: NDArray[np.bool_], even: bool = False) -> None:
        self.table = table
        self.even = even  # in time: cosines only

    @property
    def modulus(self) -> int:
        return int(self.table.shape[1])

    def rows_mask(self, harmonics: int) -> NDArray[np.bool_]:
        """Which entries of a (2H + 1, L) coefficient array may be non-zero."""
        rows = np.arange(2 * harmonics + 1)
        mask = self.table.T[(rows + 1) // 2 % self.modulus]
        if self.even:
            mask[2::2] = False
        return mask

    def stretch(self, factor: int) -> Support:
        """The same orbits described with a period `factor` times as long."""
        table = np.zeros((len(self.table), self.modulus * factor), dtype=bool)
        table[:, ::factor] = self.table
        return Support(table)

    def holds(self, coefficients: Array, threshold: float = 0.0) -> bool:
        mask = self.rows_mask((len(coefficients) - 1) // 2)
        return bool(np.all(np.abs(coefficients[~mask]) <= threshold))

    @property
    def symmetric(self) -> bool:
        """Each mode has either even or odd harmonics alone: half a period determines the orbit."""
        return bool(not np.any(self.table[:, ::2].any(axis=1) & self.table[:, 1::2].any(axis=1)))


def symmetry_signs(
    system: ScaledSystem, support: Support, period_multiple: int
) -> NDArray[np.float64] | None:
    """Signs with K(theta + pi)_rl = sign_r sign_l K(theta)_rl for the tangent stiffness of all
    modes.

    None where there are no such signs: then half a period does not determine the multipliers.
    Modes with odd harmonics have sign -1; those at rest follow from what couples them.
    """
    if not support.symmetric:
        return None
    active = support.table.any(axis=1)
    odd = support.table[:, 1::2].any(axis=1)
    known = np.where(odd, -1, np.where(active, 1, 0))
    plus, minus = known == 1, known == -1
    acting = patterns(system)
    same = (system.stiffness != 0) | (system.damping != 0) | acting.through(plus, plus)
    same |= acting.through(minus, minus) | acting.quadratic[:, plus].any(axis=1)
    opposite = acting.through(plus, minus) | acting.quadratic[:, minus].any(axis=1)
    for k in range(system.tones + 1):  # half a period turns the drive's angle by p pi
        acts = of_harmonic(system.parametric, k)
        (opposite if k * period_multiple % 2 else same)[acts] = True
    return _coloured(known, same | same.T, opposite | opposite.T)


def _coloured(
    known: Array, same: NDArray[np.bool_], opposite: NDArray[np.bool_]
) -> NDArray[np.float64] | None:
    """Signs that agree with the known ones and with both relations, or None."""
    signs = known.copy()
    while True:
        reached = np.flatnonzero(signs)
        waiting = list(reached)
        while waiting:
            r = waiting.pop()
            for relation, factor in ((same, 1), (opposite, -1)):
                for l in np.flatnonzero(relation[r]):
                    if signs[l] == 0:
                        signs[l] = factor * signs[r]
                        waiting.append(l)
                    elif signs[l] != factor * signs[r]:
                        return None
        if signs.all():
            return signs.astype(float)
        signs[np.flatnonzero(signs == 0)[0]] = 1


def of_harmonic(pattern: Array, k: int) -> NDArray[np.bool_]:
    """Entries (...) of the drive's patterns (..., 2K + 1) that its harmonic k has."""
    return np.asarray((pattern[..., max(2 * k - 1, 0) : 2 * k + 1] != 0).any(axis=-1))


def full_support(system: ScaledSystem, period_multiple: int) -> Support:
    return Support(np.ones((system.size, 2 * period_multiple), dtype=bool))


def forced_support(system: ScaledSystem, period_multiple: int = 1) -> Support:
    """The smallest invariant set of modes and harmonics that the drive excites from rest."""
    modulus = 2 * period_multiple
    table = np.zeros((system.size, modulus), dtype=bool)
    for k in range(system.tones + 1):
        for residue in (k * period_multiple, -k * period_multiple):
            table[of_harmonic(system.force, k), residue % modulus] = True
    return close_support(system, Support(table))


def own_support(system: ScaledSystem, coefficients: Array, period_multiple: int) -> Support:
    """The smallest invariant set of modes and harmonics that an orbit (2H + 1, L) is in."""
    table = forced_support(system, period_multiple).table.copy()
    present = np.abs(coefficients) > ABSENT * np.abs(coefficients).max(initial=0.0)
    numbers = (np.arange(len(coefficients)) + 1) // 2 % table.shape[1]
    np.logical_or.at(table.T, numbers, present)
    return close_support(system, Support(table))


def close_support(system: ScaledSystem, support: Support) -> Support:
    """Add what the equations excite from the modes and harmonics present, until nothing is
    added.
    """
    table = support.table.copy()
    modulus = support.modulus
    half = modulus // 2
    linear = ((system.stiffness != 0) | (system.damping != 0)).astype(float)
    parametric = [of_harmonic(system.parametric, k).astype(float) for k in range(system.tones + 1)]
    acting = patterns(system)
    quadratic, cubic = acting.quadratic.any(), acting.cubic.any()
    while True:
        before = table.copy()
        present = before.astype(float)
        table |= (linear @ present) > 0
        for k, acts in enumerate(parametric):
            for shift in (k * half, -k * half) if acts.any() else ():
                table |= (acts @ np.roll(present, shift, axis=1)) > 0
        residues = [r for r in range(modulus) if before[:, r].any()]
        for pair in combinations_with_replacement(residues, 2) if quadratic else ():
            _mark(table, acting.from_two(*(before[:, r] for r in pair)), pair)
        for triple in combinations_with_replacement(residues, 3) if cubic else ():
            _mark(table, acting.from_three(*(before[:, r] for r in triple)), triple)
        if np.array_equal(table, before):
            return Support(table)


def _mark(table: NDArray[np.bool_], excited: NDArray[np.bool_], residues: tuple[int, ...]) -> None:
    for signs in product((1, -1), repeat=len(residues)):
        table[excited, sum(s * r for s, r in zip(signs, residues)) % table.shape[1]] = True


class Basis:
    """Sampling and product tables for the harmonics up to H that a support allows.

    Sampling is exact for a cubic force: the products have 3H harmonics and are projected on H,
    which needs 4H + 1 samples of a period, or half of them where the support is symmetric.
    """

    def __init__(self, support: Support, harmonics: int, period_multiple: int) -> None:
        table = support.table
        self.harmonics, self.period_multiple = harmonics, period_multiple
        self.modes: Index = np.flatnonzero(table.any(axis=1))
        residues = table.any(axis=0)
        numbers = (np.arange(2 * harmonics + 1) + 1) // 2
        present = residues[numbers % support.modulus]
        if support.even:
            present[2::2] = False
        self.rows: Index = np.flatnonzero(present)
        self.number = numbers[self.rows]
        self.allowed = support.rows_mask(harmonics)[np.ix_(self.rows, self.modes)]
        self.shape = self.allowed.shape
        self._derivative_tables()
        self._take(self.allowed)

        bandwidth = 4 * harmonics + 2 + (-harmonics * 4 - 2) % 4
        bandwidth = max(bandwidth, 4 * (period_multiple + 1))
        self.samples = bandwidth // 2 if support.symmetric else bandwidth
        self.angles = 2 * np.pi / bandwidth * np.arange(self.samples)
        everything = fourier_matrix(self.angles, 2 * harmonics)
        self.synthesis = np.ascontiguousarray(everything[:, self.rows])
        weights = np.full(4 * harmonics + 1, 2.0 / self.samples)
        weights[0] = 1.0 / self.samples
        self.analysis_wide = np.ascontiguousarray((everything * weights).T)
        self.analysis = np.ascontiguousarray(self.analysis_wide[self.rows])
        self.analysis_wide[0] *= 2.0  # product formulas count the mean twice
        self.products = Products(self.rows, self.number)

    def _derivative_tables(self) -> None:
        """(d coefficients/d theta)[i] = derivative_weight[i] coefficients[derivative_row[i]]."""
        position = {int(row): i for i, row in enumerate(self.rows)}
        partner = [0 if row == 0 else (row + 1 if row % 2 else row - 1) for row in self.rows]
        # (of cosines alone, the derivative is only ever multiplied by a damping of zero)
        self.derivative_row: Index = np.array(
            [position.get(int(row), i) for i, row in enumerate(partner)], dtype=np.int64
        )
        signs = np.where(self.rows % 2 == 1, 1.0, -1.0)
        self.derivative_weight = (self.number * signs)[:, None]
        self.second_weight = -(self.number.astype(float) ** 2)[:, None]

    def _take(self, taken: NDArray[np.bool_]) -> None:
        """Which coefficients (rows, modes) are unknowns: in groups of rows that have the same
        modes.
        """
        kinds, kind = np.unique(taken, axis=0, return_inverse=True)
        places = np.arange(taken.size).reshape(self.shape)
        self.groups: list[Group] = []
        self._between: list[Between] = []
        self.size = 0
        for number, modes in enumerate(kinds):
            rows, some = np.flatnonzero(kind.ravel() == number), np.flatnonzero(modes)
            count = len(rows) * len(some)
            if count:
                partners = np.searchsorted(rows, self.derivative_row[rows])
                place = slice(self.size, self.size + count)
                self.groups.append(Group(rows, some, place, partners))
                self.size += count
        found = [places[np.ix_(group.rows, group.modes)].ravel() for group in self.groups]
        everything = len(found) == 1 and self.size == taken.size
        self.unknowns: Index | None = (
            None if everything else np.concatenate([*found, np.zeros(0, dtype=np.int64)])
        )

    def between(self) -> list[Between]:
        """Where the blocks of an operator between all groups are from; found once."""
        if not self._between:
            pairs = product(self.groups, self.groups)
            self._between = [self.products.between(one, two) for one, two in pairs]
        return self._between

    def only(self, taken: NDArray[np.bool_]) -> Basis:
        """The same basis where some coefficients (rows, modes) alone are unknowns, the others 0;
        of a harmonic both or none.
        """
        less = copy(self)
        less._take(self.allowed & taken)
        return less

    def in_bands(self, sizes: Array, part: float) -> NDArray[np.bool_]:
        """Which coefficients (rows, modes) are larger than a part of the largest one, or stand in a
        band of harmonics in which their mode has such ones: few bands, so that few groups.
        """
        large = sizes > part * sizes.max(initial=0.0)
        band = self.number * BANDS // (self.harmonics + 1)
        taken = np.zeros((BANDS, large.shape[1]), dtype=bool)
        np.logical_or.at(taken, band, large)
        return taken[band]

    @property
    def taken(self) -> NDArray[np.bool_]:
        """Which coefficients (rows, modes) are unknowns."""
        mask = np.zeros(self.shape, dtype=bool)
        mask.ravel()[slice(None) if self.unknowns is None else self.unknowns] = True
        return mask

    def compress(self, full: Array) -> Array:
        """Coefficients (2H' + 1, L) of all modes -> those of this basis (rows, modes)."""
        return np.ascontiguousarray(resize(full, self.harmonics)[np.ix_(self.rows, self.modes)])

    def expand(self, coefficients: Array, size: int) -> Array:
        """Coefficients of this basis -> (2H + 1, L) of all modes."""
        full = np.zeros((2 * self.harmonics + 1, size))
        full[np.ix_(self.rows, self.modes)] = coefficients
        return full

    def pack(self, coefficients: Array) -> Array:
        flat = coefficients.ravel()
        return flat.copy() if self.unknowns is None else flat[self.unknowns]

    def unpack(self, unknowns: Array) -> Array:
        if self.unknowns is None:
            return unknowns.reshape(self.shape)
        flat = np.zeros(self.shape[0] * self.shape[1])
        flat[self.unknowns] = unknowns
        return flat.reshape(self.shape)


@lru_cache(maxsize=64)
def _cached_basis(
    table: bytes, shape: tuple[int, int], even: bool, harmonics: int, period_multiple: int
) -> Basis:
    support = Support(np.frombuffer(table, dtype=bool).reshape(shape), even)
    return Basis(support, harmonics, period_multiple)


def basis_for(support: Support, harmonics: int, period_multiple: int) -> Basis:
    """The basis of a support, built once per number of harmonics."""
    table = support.table
    return _cached_basis(table.tobytes(), table.shape, support.even, harmonics, period_multiple)
