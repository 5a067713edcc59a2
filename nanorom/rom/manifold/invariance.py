"""The invariance equation of a manifold tangent to a few modes, order by order.

u = W(z), z' = f(z), with u the complex modal coordinates of all modes and z those of the masters:

    (sigma_a - rate_k) W_k^a + f_k^a = N_k(W)^a - (sum_j dW_k/dz_j f_j)^a

for each monomial z^a of degree two and more, sigma_a = sum_j a_j rate_j; f is of masters alone.
Which monomials f keeps, and W then lacks, is the style. Source: Haller and Ponsioen 2016,
doi:10.1007/s11071-016-2974-z; Vizzaccaro, Opreni, Salles, Frangi and Touze 2022,
doi:10.1007/s11071-021-06865-1 (direct parametrisation of arbitrary order).
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import ModelError
from nanorom.rom.manifold.equations import Equations
from nanorom.rom.manifold.forces import PolynomialForces
from nanorom.rom.manifold.monomials import Index, Monomials, splits
from nanorom.types import Numbers

STYLES = ("normal", "real", "graph")
NEAR = 0.1  # of the lowest master's frequency: divisors of masters below are those of resonances
SINGULAR = 1e-9  # of a frequency: divisors of slaves below are none
PRESENT = 1e-12  # of the largest: what is to be divided by such a divisor, and is no round-off
TOLD = 0.05  # of the lowest master's frequency: divisors of slaves below are told
LOW = 3  # degree up to which these are


@attrs.frozen(eq=False)
class Expansion:
    """W (P, 2L) and f (P, 2m) by monomials of z (2m,), and the matrices of the forces on it.

    masters (2m,): places of the masters and of their conjugates among the coordinates u; sigma
    (P,): rates of the monomials; near : slaves that are nearly in resonance: (place of the slave,
    powers (2m,), divisor relative to the lowest master's frequency).
    """

    monomials: Monomials
    masters: Index
    sigma: Numbers
    shape: Numbers
    dynamics: Numbers
    forces: PolynomialForces
    near: tuple[tuple[int, tuple[int, ...], float], ...]


def expand(equations: Equations, masters: Index, order: int, style: str) -> Expansion:
    """The manifold of masters (m,), numbers of modes from 0; raises ModelError where a slave is in
    resonance with them.
    """
    basis = equations.basis
    places = np.concatenate([masters, masters + basis.size])
    monomials = Monomials(len(places), order)
    rates = basis.rates[places]
    sigma = monomials.powers @ rates
    forces = equations.forces(monomials)
    shape = np.zeros((len(monomials), 2 * basis.size), dtype=complex)
    dynamics = np.zeros((len(monomials), len(places)), dtype=complex)
    linear = monomials.of(1)
    for place, powers in zip(range(linear.start, linear.stop), monomials.powers[linear]):
        variable = int(powers.argmax())
        shape[place, places[variable]] = 1.0
        dynamics[place, variable] = rates[variable]
    found: list[tuple[int, tuple[int, ...], float]] = []
    for degree in range(2, order + 1):
        here = monomials.of(degree)
        q, speed = shape @ basis.shapes.T, shape @ basis.speeds.T
        right: Numbers = -forces.of(degree, q, speed) @ basis.inverse.T
        right -= carried(monomials, shape, dynamics, degree, 2, 2)
        keep = kept(sigma[here], rates, style)
        dynamics[here] = np.where(keep, right[:, places], 0.0)
        right[:, places] -= dynamics[here]
        divisors = sigma[here, None] - basis.rates
        divisors[:, places] = np.where(keep, 1.0, divisors[:, places])
        scale = float(np.abs(rates.imag).min())
        found += _check(divisors, right, monomials.powers[here], scale, basis.size)
        small = np.abs(divisors) < SINGULAR * scale
        shape[here] = np.where(small, 0.0, right / np.where(small, 1.0, divisors))
    return Expansion(monomials, places, sigma, shape, dynamics, forces, tuple(found))


def carried(
    monomials: Monomials, shape: Numbers, flow: Numbers, degree: int, lowest: int, first: int
) -> Numbers:
    """(sum_j dshape/dz_j flow_j) of one degree, of the degrees of shape from `lowest`, and of those
    of flow from `first`.
    """
    here = monomials.of(degree)
    result = np.zeros((here.stop - here.start, shape.shape[1]), dtype=complex)
    for variable in range(monomials.variables):
        slope = monomials.slope(shape, variable)
        for a, b in splits(degree, lowest - 1, first):
            if flow[monomials.of(b), variable].any():
                result += monomials.product(a, slope, b, flow[:, variable], "pk,p->pk")
    return result


def kept(sigma: Numbers, rates: Numbers, style: str) -> NDArray[np.bool_]:
    """Which of the monomials (n,) are kept in the equations of the masters, (n, 2m)."""
    if style == "graph":
        return np.ones((len(sigma), len(rates)), dtype=bool)
    limit = NEAR * np.abs(rates.imag).min()
    near = np.abs(sigma.imag[:, None] - rates.imag) < limit
    if style == "real":  # z and its conjugate alike, so that they stay those of an oscillator
        half = len(rates) // 2
        near |= np.roll(near, half, axis=1)
    return np.asarray(near)


def _check(
    divisors: Numbers, right: Numbers, powers: Index, scale: float, size: int
) -> list[tuple[int, tuple[int, ...], float]]:
    """Slaves nearly in resonance; raises ModelError where the manifold does not exist."""
    relative = np.abs(divisors) / scale
    present = np.abs(right) > PRESENT * np.abs(right).max(initial=0.0)
    for row, slave in zip(*np.nonzero((relative < SINGULAR) & present)):
        raise ModelError(
            f"masters: mode {slave % size + 1} is in resonance with them "
            f"({_monomial(powers[row])}); take it as a master, too"
        )
    if powers[0].sum() > LOW:
        return []
    near = np.argwhere((relative[:, :size] < TOLD) & present[:, :size])
    return [
        (int(slave), tuple(powers[row].tolist()), float(relative[row, slave]))
        for row, slave in near
    ]


def _monomial(powers: Index) -> str:
    half = len(powers) // 2
    return " + ".join(
        f"{count} w{number + 1}"
        for number, count in enumerate((powers[:half] - powers[half:]).tolist())
        if count
    )
