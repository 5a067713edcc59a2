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
from math import factorial

import attrs
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from nanorom.errors import ModelError
from nanorom.rom.manifold.full import FullSystem
from nanorom.rom.manifold.invariance import carried, kept
from nanorom.rom.manifold.monomials import Index, Monomials
from nanorom.types import Array

CHUNK = 32  # columns of a force at once: some 10 MB at the quadrature points of a film
SAME = 1e-9  # of a frequency: shifts that are one
FINITE = 1e8  # of the static response of a slave, beyond which it is in resonance


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


class _Bordered:
    """Solves (K - sigma^2 M) u = f for u orthogonal to modes, f without them."""

    def __init__(self, system: FullSystem, momenta: Array) -> None:
        self.system, self.momenta = system, momenta

    def solve(self, sigma: Array, right: Array) -> Array:
        """Solutions (p, n), one for each sigma (p,); one factor for all of one size."""
        found = np.zeros_like(right)
        size = np.abs(sigma)
        left = np.flatnonzero(np.abs(right).max(axis=1))
        while len(left):
            same = left[np.abs(size[left] - size[left[0]]) <= SAME * size.max()]
            found[same] = self._solve(size[same[0]], right[same])
            left = np.setdiff1d(left, same)
        return found

    def _solve(self, sigma: float, right: Array) -> Array:
        system, count = self.system, self.momenta.shape[1]
        edge = sp.csc_matrix(self.momenta)
        matrix = sp.bmat(
            [[system.stiffness - sigma**2 * system.mass, edge], [edge.T, None]], format="csc"
        )
        try:
            solve = splu(matrix).solve
        except RuntimeError:
            raise _resonant(sigma) from None
        padded = np.concatenate([right, np.zeros((len(right), count))], axis=1)
        found = np.asarray(solve(padded.T).T[:, : system.size])
        work = np.abs(np.einsum("pn,pn->p", found, (system.stiffness @ found.T).T))
        if not np.all(work <= FINITE * np.abs(np.einsum("pn,pn->p", found, right)) + 1e-300):
            raise _resonant(sigma)
        return found


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
