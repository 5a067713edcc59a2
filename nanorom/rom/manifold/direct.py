"""The manifold of a few modes in all degrees of freedom of a film or a solid, order by order.

Without damping and in normal form, u = W(z), u' = i V(z), z' = i g(z) have real coefficients, z the
masters and their conjugates.  With masters apart, W = shapes (U + U*) / 2 + slaves, monomial z^a
with sigma = sum_j a_j omega_j (negative for conjugates) gives

    (K - sigma^2 M) W_a = -N_a + M (sigma c_a + d_a) ,  W_a orthogonal to the masters,

N the force of lower degrees, c and d what these carry along of W and V.  The shifted operator is
bordered by the masters, with which it is regular where they resonate.  Source: Vizzaccaro, Opreni,
Salles, Frangi and Touze 2022, doi:10.1007/s11071-021-06865-1 (direct parametrisation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations_with_replacement
from math import comb, factorial

import attrs
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from nanorom.errors import ModelError
from nanorom.rom.manifold.full import FullSystem
from nanorom.rom.manifold.invariance import carried, kept
from nanorom.rom.manifold.monomials import Index, Monomials
from nanorom.types import Array

# of factors of symmetric matrices: of a slender solid of 12 000 unknowns they take a twentieth of
# the time of those by columns, and have as many digits
SYMMETRIC = {"diag_pivot_thresh": 1e-3, "options": {"SymmetricMode": True}}
CHUNK = 32  # columns of a force at once: some 10 MB at the quadrature points of a film
MOST_PRODUCTS = 1e5  # of two or three fields: some minutes
SAME = 1e-9  # of a frequency: shifts that are one
CLOSE = 1e-5  # of a squared frequency: another one as near as that is in resonance, or may be
RESONANT = 1e-8  # of the same: what is as near and driven has no bounded response
ITERATED = 3  # times: enough to tell a mode that is CLOSE
VANISHING = 1e-9  # of a response, by the static one of all else: what drives it is round-off


@attrs.frozen(eq=False)
class Fields:
    """What follows the masters: slaves (P, n) by monomials of z (2m,), and g (P, 2m)."""

    monomials: Monomials
    slaves: Array
    dynamics: Array


def fields(system: FullSystem, shapes: Array, squares: Array, order: int) -> Fields:
    """The conservative manifold of masters in normal form.

    shapes (n, m) of unit mass, squares (m,): their squared frequencies; near rest u = shapes Re(z).
    Raises ModelError where a slave is in resonance with the masters.
    """
    omega = np.sqrt(squares)
    rates = np.concatenate([omega, -omega])
    monomials = Monomials(2 * len(omega), order)
    swap = swapped(monomials)
    sigma = monomials.powers @ rates
    masters = np.zeros((len(monomials), len(rates)))
    dynamics = np.zeros_like(masters)
    slaves = np.zeros((len(monomials), system.size))
    speeds, whole = np.zeros_like(slaves), np.zeros_like(slaves)
    linear = monomials.of(1)
    masters[linear] = monomials.powers[linear]
    dynamics[linear] = monomials.powers[linear] * rates
    whole[linear] = monomials.powers[linear] @ np.concatenate([shapes, shapes], axis=1).T / 2
    border = _Bordered(system, system.mass @ shapes)
    for degree in range(2, order + 1):
        here = monomials.of(degree)
        turn = sigma[here, None]
        force = _force(system, monomials, whole, swap, degree)
        push = force @ shapes / omega
        right = np.concatenate([push, -push], axis=1)
        right -= carried(monomials, masters, dynamics, degree, 2, 2).real
        keep = kept(1j * sigma[here], 1j * rates, "normal")
        dynamics[here] = np.where(keep, right, 0.0)
        masters[here] = np.where(keep, 0.0, right / np.where(keep, 1.0, turn - rates))
        moved = carried(monomials, slaves, dynamics, degree, 2, 2).real
        pushed = turn * moved + carried(monomials, speeds, dynamics, degree, 2, 2).real
        rest = (system.mass @ pushed.T).T - force
        slaves[here] = border.solve(sigma[here], rest - (rest @ shapes) @ border.momenta.T)
        speeds[here] = turn * slaves[here] + moved
        both = masters[here].reshape(-1, 2, len(omega)).sum(axis=1) / 2
        whole[here] = slaves[here] + both @ shapes.T
    return Fields(monomials, slaves, dynamics)


def swapped(monomials: Monomials) -> Index:
    """Places (P,) of the monomials with z and its conjugate exchanged."""
    rows = np.roll(monomials.powers, monomials.variables // 2, axis=1)
    return np.array([monomials.place(row) for row in rows.tolist()])


def check_products(masters: int, order: int) -> None:
    """Raise ModelError for more products of fields than can be computed."""
    counts = np.array([0, *(comb(d + 2 * masters - 1, d) for d in range(1, order + 1))], float)
    pairs = np.convolve(counts, counts)
    both = pairs[: order + 1].sum() / 2 + np.convolve(pairs, counts)[: order + 1].sum() / 6
    if both / 2 > MOST_PRODUCTS:
        raise ModelError(
            f"order: found one with some {both / 2:.1g} products of fields of {masters} masters; "
            f"allowed: up to {MOST_PRODUCTS:g}; lower the order, or take fewer masters"
        )


class _Bordered:
    """Solves (K - sigma^2 M) u = f for u orthogonal to modes, f without them."""

    def __init__(self, system: FullSystem, momenta: Array) -> None:
        self.system, self.momenta = system, momenta

    def solve(self, sigma: Array, right: Array) -> Array:
        """Solutions (p, n), one for each sigma (p,); one factor for all of one size."""
        found = np.zeros_like(right)
        size = np.abs(sigma)
        left = np.flatnonzero(np.abs(right).max(axis=1, initial=0.0))
        while len(left):
            same = left[np.abs(size[left] - size[left[0]]) <= SAME * size.max()]
            found[same] = self._solve(size[same[0]], right[same])
            left = np.setdiff1d(left, same)
        return found

    def _solve(self, sigma: float, right: Array) -> Array:
        """Solutions (p, n); a mode at sigma that nothing drives is left at rest.

        What nothing drives is round-off, which a resonance would enlarge.
        """
        system, count = self.system, self.momenta.shape[1]
        edge = sp.csc_matrix(self.momenta)
        matrix = sp.bmat(
            [[system.stiffness - sigma**2 * system.mass, edge], [edge.T, None]], format="csc"
        )
        try:
            factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", **SYMMETRIC)
        except RuntimeError:
            raise _resonant(sigma) from None

        def solve(columns: Array) -> Array:
            padded = np.concatenate([columns, np.zeros((count, columns.shape[1]))])
            return np.asarray(factors.solve(padded)[: system.size])

        found = solve(right.T)
        near, square = self._nearest(solve)
        if abs(square - sigma**2) > CLOSE * square:
            return found.T
        share = near @ (system.mass @ found)
        rest = found - np.outer(near, share)
        alone = np.sqrt(np.abs(np.einsum("np,np->p", rest, system.stiffness @ rest)))
        driven = np.abs(near @ right.T) > VANISHING * np.sqrt(square) * alone
        if driven.any() and abs(square - sigma**2) <= RESONANT * square:
            raise _resonant(sigma)
        return np.where(driven, found, rest).T

    def _nearest(self, solve: Callable[[Array], Array]) -> tuple[Array, float]:
        """The mode (n,) of unit mass nearest to a shift, and its squared frequency."""
        mass = self.system.mass
        mode = np.random.default_rng(0).standard_normal((self.system.size, 1))
        for _ in range(ITERATED):
            mode = solve(mass @ mode)
            mode /= np.sqrt((mode * (mass @ mode)).sum())
        return mode[:, 0], float((mode * (self.system.stiffness @ mode)).sum())


def responses(system: FullSystem, modes: Array, rates: Array, loads: Array) -> Array:
    """What is not of some modes (n, N) of unit mass in responses (n, k) to loads (n, k) that
    oscillate at rates (k,), without damping.
    """
    border = _Bordered(system, system.mass @ modes)
    right = loads - border.momenta @ (modes.T @ loads)
    return border.solve(rates, right.T).T


def _resonant(sigma: float) -> ModelError:
    return ModelError(
        f"masters: another mode is in resonance with them, at {sigma:.6g} in units of the film; "
        "take it as a master, too"
    )


def _force(
    system: FullSystem, monomials: Monomials, whole: Array, swap: Index, degree: int
) -> Array:
    """N (count, n) of one degree, of u (P, n) known below it."""
    here = monomials.of(degree)
    found = np.zeros((here.stop - here.start, whole.shape[1]))
    moving = whole.any(axis=1)
    forces: dict[int, Callable[..., Array]] = {2: system.quadratic, 3: system.cubic}
    for count, force in forces.items():
        factors, ends, weights = _factors(monomials, degree, count, swap, moving)
        for begin in range(0, len(ends), CHUNK):
            part = slice(begin, begin + CHUNK)
            columns = [whole[factors[part, k]].T for k in range(count)]
            np.add.at(found, ends[part] - here.start, weights[part, None] * force(*columns).T)
    rows = np.arange(here.start, here.stop)
    return np.asarray(found[np.minimum(rows, swap[rows]) - here.start])


def _factors(
    monomials: Monomials, degree: int, count: int, swap: Index, moving: Index
) -> tuple[Index, Index, Array]:
    """All products of `count` monomials of one degree: factors (p, count) in rising order, places
    (p,) and multiplicities (p,); of products that exchange with another, the first alone.
    """
    factors, ends, weights = [], [], []
    for places in _rising(monomials, degree, count, 1):
        end = monomials.place(monomials.powers[list(places)].sum(axis=0).tolist())
        if end <= swap[end] and moving[list(places)].all():
            factors.append(places)
            ends.append(end)
            repeats = [factorial(places.count(p)) for p in set(places)]
            weights.append(factorial(count) / np.prod(repeats))
    return np.array(factors, int).reshape(-1, count), np.array(ends, int), np.array(weights)


def _rising(
    monomials: Monomials, degree: int, count: int, lowest: int
) -> Iterator[tuple[int, ...]]:
    """Places of `count` monomials in rising order whose degrees, from `lowest`, sum to a degree."""
    if count == 0:
        if degree == 0:
            yield ()
        return
    for own in range(lowest, degree // count + 1):
        part = monomials.of(own)
        for equal in range(1, count + 1):  # how many factors have this degree
            if (equal == count) != (degree == equal * own):
                continue
            for rest in _rising(monomials, degree - equal * own, count - equal, own + 1):
                for first in combinations_with_replacement(range(part.start, part.stop), equal):
                    yield (*first, *rest)
