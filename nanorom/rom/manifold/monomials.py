"""Monomials of several variables up to an order, and products of polynomials in them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from nanorom.types import Numbers

Index = NDArray[np.intp]


class Monomials:
    """All monomials of n variables of the degrees 0 ... order.

    powers (P, n): by degree. A polynomial of values (...) is an array (P, ...).
    """

    def __init__(self, variables: int, order: int) -> None:
        self.variables, self.order = variables, order
        rows: list[list[int]] = []
        self._starts = []
        for degree in range(order + 1):
            self._starts.append(len(rows))
            for chosen in combinations_with_replacement(range(variables), degree):
                rows.append([chosen.count(variable) for variable in range(variables)])
        self._starts.append(len(rows))
        self.powers = np.array(rows, dtype=int).reshape(-1, variables)
        self._place = {tuple(row): place for place, row in enumerate(rows)}
        self._pairs: dict[tuple[int, int], tuple[Index, Index, Index]] = {}

    def __len__(self) -> int:
        return len(self.powers)

    def place(self, powers: Iterator[int] | tuple[int, ...]) -> int:
        """The number of a monomial."""
        return self._place[tuple(powers)]

    def of(self, degree: int) -> slice:
        """The places of the monomials of one degree."""
        return slice(self._starts[degree], self._starts[degree + 1])

    def values(self, z: Numbers) -> Numbers:
        """Values (..., P) of all monomials at z (..., n)."""
        z = np.asarray(z, dtype=complex)
        table = np.ones((self.order + 1, *z.shape), dtype=complex)
        for power in range(1, self.order + 1):
            table[power] = table[power - 1] * z
        result = np.ones((*z.shape[:-1], len(self)), dtype=complex)
        for variable in range(self.variables):
            result *= np.moveaxis(table[self.powers[:, variable], ..., variable], 0, -1)
        return result

    def slope(self, polynomial: Numbers, variable: int) -> Numbers:
        """The derivative (P, ...) of a polynomial (P, ...)."""
        places, ends, factors = self._slopes[variable]
        result = np.zeros_like(polynomial)
        shape = (-1, *(1,) * (polynomial.ndim - 1))
        result[ends] = polynomial[places] * factors.reshape(shape)
        return result

    @cached_property
    def _slopes(self) -> list[tuple[Index, Index, Index]]:
        """Of each variable: places that contain it, places of the derivatives, and factors."""
        found = []
        for variable in range(self.variables):
            places = np.flatnonzero(self.powers[:, variable])
            lower = self.powers[places].copy()
            lower[:, variable] -= 1
            ends = np.array([self.place(row) for row in lower.tolist()], dtype=int)
            found.append((places, ends, self.powers[places, variable]))
        return found

    def product(self, first: int, left: Numbers, second: int, right: Numbers, how: str) -> Numbers:
        """The product of the parts of degree `first` and `second` of two polynomials, as a
        polynomial of degree first + second alone; how: an einsum of (n, ...) and (n, ...).
        """
        i, j, starts = self._pairs_of(first, second)
        return np.asarray(np.add.reduceat(np.einsum(how, left[i], right[j]), starts, axis=0))

    def _pairs_of(self, first: int, second: int) -> tuple[Index, Index, Index]:
        """Places of all factors of two degrees, by their products, and where those begin."""
        if (first, second) not in self._pairs:
            a, b = (np.arange(part.start, part.stop) for part in map(self.of, (first, second)))
            i, j = np.repeat(a, len(b)), np.tile(b, len(a))
            products = [self.place(row) for row in (self.powers[i] + self.powers[j]).tolist()]
            order = np.argsort(products, kind="stable")
            # every monomial of that degree is a product of two of these
            starts = np.flatnonzero(np.diff(np.array(products)[order], prepend=-1))
            self._pairs[first, second] = i[order], j[order], starts
        return self._pairs[first, second]


def splits(degree: int, first: int, second: int) -> Iterator[tuple[int, int]]:
    """Degrees (a, b) of factors with a + b = degree, a from `first`, b from `second`."""
    for a in range(first, degree - second + 1):
        yield a, degree - a
