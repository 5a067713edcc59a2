"""The masters as oscillators with polynomial forces, in the form in which continuation takes them.

On a manifold of style "graph" the masters are their own coordinates: x'' = P(x, x'), P of the
manifold's order. Continuation takes cubic forces; products of two and three of (x, x') become
states of first order of their own, w' = dw/dx x' + dw/dx' x'' - (w - product). With these, P is
cubic, and where a state is not its product, it becomes so at the rate of the oscillation. Source of
the recast: Guillot, Cochelin and Vergez 2019, doi:10.1016/j.jsv.2018.10.017 (there with algebraic
equations).
"""

from __future__ import annotations

from functools import cached_property
from itertools import combinations_with_replacement, permutations
from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.rom.manifold.drive import check_levels
from nanorom.rom.manifold.equations import Equations
from nanorom.rom.manifold.invariance import Expansion
from nanorom.rom.manifold.monomials import Monomials
from nanorom.types import Array, Numbers

if TYPE_CHECKING:
    from nanorom.continuation.scaled import ScaledSystem

HIGHEST = 7  # order: products of three, times three, are of the ninth degree
CUBIC, QUINTIC = 3, 5  # orders up to which no products, and products of two, suffice
RELAXATION = 1.0  # by the first master's frequency: of states to their products
IMAGINARY = 1e-9  # of a coefficient that is to be real


@attrs.frozen(eq=False, slots=False)
class Oscillators:
    """What `explore` takes in place of a `ModalSystem`: m masters and their products.

    Where results have L modes, there are first the masters, in m; then their velocities by the
    first master's frequency, and products, all of which are states of first order.  Drives act on
    the masters; `Reduced.lifted` adds what slaves do, and `Reduced.response` what that does to the
    masters.

    force (P, m): x'' by monomials of (x, x'); direct (m,), parametric (m, m): at level 1, scaled.
    """

    frequency: float
    amplitude: float
    monomials: Monomials
    force: Array
    direct: Array
    parametric: Array

    @property
    def masters(self) -> int:
        """Number of masters m."""
        return len(self.direct)

    @cached_property
    def _names(self) -> list[tuple[int, ...]]:
        """The coordinates, as products of (x, x'), by their numbers."""
        order = self.monomials.order
        highest = 1 if order <= CUBIC else 2 if order <= QUINTIC else 3
        variables = range(2 * self.masters)
        return [
            chosen
            for degree in range(1, highest + 1)
            for chosen in combinations_with_replacement(variables, degree)
        ]

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self._names)

    def scaled(self, direct: float = 0.0, parametric: float = 0.0) -> ScaledSystem:
        """The equations at given levels of the drives, non-dimensional.

        Raises ModelError for a level of a drive that the manifold lacks.
        """
        from nanorom.continuation.scaled import ScaledSystem

        check_levels((direct, parametric), (self.direct, self.parametric))

        size, m = self.size, self.masters
        # forces by one, two and three coordinates
        terms = [np.zeros((size,) * count) for count in (2, 3, 4)]
        force, stretch = np.zeros((size, 3)), np.zeros((size, size, 3))
        for row, name in enumerate(self._names):
            for factors, value in self._rate(name).items():
                _add(terms, row, self._split(factors), -value)
            if len(name) > 1:
                terms[0][row, row] += RELAXATION
                parts = self._number(name[:-1]), self._number(name[-1:])
                _add(terms, row, parts, -RELAXATION)
            for place, variable in enumerate(name):
                if variable < m:
                    continue
                rest = name[:place] + name[place + 1 :]
                pushed = direct * self.direct[variable - m]
                if rest:
                    stretch[row, self._number(rest), 1] += pushed
                else:
                    force[row, 1] += pushed
                for other in range(m):
                    moved = parametric * self.parametric[variable - m, other]
                    stretch[row, self._number((*rest, other)), 1] += moved
        return ScaledSystem(
            frequency=self.frequency,
            amplitude=self.amplitude,
            damping=np.eye(size),
            loss=np.zeros((size,) * 4),
            force=force,
            parametric=stretch,
            inertia=np.zeros(size),
            stiffness=terms[0],
            quadratic=terms[1],
            cubic=terms[2],
        )

    def _rate(self, name: tuple[int, ...]) -> dict[tuple[int, ...], float]:
        """The rate of a product, as a polynomial of (x, x') by its factors."""
        found: dict[tuple[int, ...], float] = {}
        for place, variable in enumerate(name):
            rest = name[:place] + name[place + 1 :]
            for factors, value in self._motion(variable).items():
                key = tuple(sorted((*rest, *factors)))
                found[key] = found.get(key, 0.0) + value
        return found

    def _motion(self, variable: int) -> dict[tuple[int, ...], float]:
        m = self.masters
        if variable < m:
            return {(variable + m,): 1.0}
        column = self.force[:, variable - m]
        return {
            tuple(np.repeat(np.arange(2 * m), self.monomials.powers[row]).tolist()): float(value)
            for row, value in enumerate(column)
            if value
        }

    def _split(self, factors: tuple[int, ...]) -> tuple[int, ...]:
        """Up to three coordinates whose product a product is, of degrees as equal as can be."""
        largest = len(self._names[-1])
        parts = min(max(-(-len(factors) // largest), 1), 3)
        ends = [len(factors) * k // parts for k in range(parts + 1)]
        return tuple(self._number(factors[a:b]) for a, b in zip(ends, ends[1:]))

    def _number(self, factors: tuple[int, ...]) -> int:
        return self._names.index(tuple(sorted(factors)))


def _add(terms: list[Array], row: int, numbers: tuple[int, ...], value: float) -> None:
    """A term of a force, symmetric in its factors."""
    orders = list(permutations(numbers))
    for order in orders:
        terms[len(numbers) - 1][(row, *order)] += value / len(orders)


def oscillators(equations: Equations, expansion: Expansion) -> Oscillators:
    """The masters of a manifold of style "graph" as oscillators.

    Raises ModelError for an order above 7, or damping that couples masters with slaves: their
    coordinates are then not those of the masters alone.
    """
    monomials = expansion.monomials
    if monomials.order > HIGHEST:
        raise ModelError(
            f"order: found {monomials.order}; allowed for continuation: up to {HIGHEST}"
        )
    half = monomials.variables // 2
    rates = equations.basis.rates[expansion.masters][:half]
    table = _substituted(monomials, rates)
    flow = table.T @ expansion.dynamics[:, :half]
    own, force = flow.real, (rates * flow).real
    own[[monomials.place(unit) for unit in np.eye(2 * half, dtype=int).tolist()[half:]]] -= np.eye(
        half
    )
    if np.abs(own).max() > IMAGINARY * max(1.0, float(np.abs(flow).max())):
        raise ModelError(
            'style: a system for continuation needs "graph", and damping that does not couple '
            "masters with slaves"
        )
    shapes = equations.basis.shapes[:, expansion.masters[:half]].real
    inverse = equations.basis.inverse[expansion.masters[:half]]
    push = (rates[:, None] * inverse).real
    return Oscillators(
        frequency=equations.frequency,
        amplitude=equations.amplitude,
        monomials=monomials,
        force=force,
        direct=push @ equations.direct,
        parametric=push @ equations.parametric @ (2 * shapes),
    )


def coordinates(rates: Numbers) -> Numbers:
    """(2m, 2m): (z, conj z) by x = Re z and x' = Re(rate z), of rates (m,)."""
    half = len(rates)
    linear = np.zeros((2 * half, 2 * half), dtype=complex)
    for r, rate in enumerate(rates):
        linear[r, [r, half + r]] = np.array([-rate.conj(), 1.0]) / (1j * rate.imag)
        linear[half + r] = linear[r].conj()
    return linear


def _substituted(monomials: Monomials, rates: Numbers) -> Numbers:
    """Monomials of (z, conj z) by those of x = Re z and x' = Re(rate z), (P, P)."""
    linear = coordinates(rates)
    table = np.zeros((len(monomials), len(monomials)), dtype=complex)
    table[0, 0] = 1.0
    for row in range(1, len(monomials)):
        powers = monomials.powers[row].copy()
        variable = int(np.flatnonzero(powers)[0])
        powers[variable] -= 1
        known = table[monomials.place(powers.tolist())]
        for column in np.flatnonzero(known):
            for other in np.flatnonzero(linear[variable]):
                raised = monomials.powers[column].copy()
                raised[other] += 1
                place = monomials.place(raised.tolist())
                table[row, place] += known[column] * linear[variable, other]
    return table
