"""Quadratic and cubic coefficients of a solid's modes, all that lies outside them condensed.

The force of a solid is exactly cubic.  With masters Phi q and the rest theta, K-orthogonal to them,
the rest finds its equilibrium by theta_jk = -G Q(phi_j, phi_k), G = K^-1 - Phi (Phi^T K Phi)^-1
Phi^T: fields of second order, also got as static modal derivatives (Idelsohn and Cardona 1985,
doi:10.1016/0045-7825(85)90125-2; Jain and Tiso 2017, doi:10.1016/j.ymssp.2016.10.012).  To third
order in q

    A_rjk = phi_r . Q(phi_j, phi_k),
    B_rjkl = phi_r . T(phi_j, phi_k, phi_l) - 2 sym Q(phi_r, phi_j) . G Q(phi_k, phi_l).

For a film it is what condensing its in-plane displacement is: theta is stationary, so that its own
error enters squared.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem.modes.solid import SolidModes
from nanorom.fem.solvers import algebra
from nanorom.fem.tensors.outside import MATTERS
from nanorom.rom import tensors


@attrs.frozen(eq=False)
class SolidTensors:
    """Coefficients of L modes, by modulus and length.

    stiffness (L, L), quadratic (L, L, L), cubic (L, L, L, L), of which outside (L, L, L, L) is what
    lies outside the modes; asymmetry: of the quadratic one before it was made symmetric;
    eigenvalue: squared frequency of the slowest response outside the modes (Rayleigh's quotient,
    from above); own: (L,), the same of the response to the square of each mode.
    """

    stiffness: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray
    outside: np.ndarray
    asymmetry: float
    eigenvalue: float
    own: np.ndarray


def condensed(modes: SolidModes) -> SolidTensors:
    """By one factorisation and L (L + 1)/2 solutions. Collective."""
    solid, shapes = modes.solid, modes.shapes
    n, comm = shapes.shape[1], solid.domain.comm
    pull = solid.linear(shapes)
    stiffness = modes.products(pull)
    stiffness = 0.5 * (stiffness + stiffness.T)
    pairs = np.column_stack(np.triu_indices(n))
    j, k = pairs.T
    force = solid.quadratic(shapes[:, j], shapes[:, k])
    work = modes.products(force)
    quadratic = np.zeros((n, n, n))
    quadratic[:, j, k] = quadratic[:, k, j] = work
    factors = algebra.Factorization(solid.stiffness, "nanorom_solid_", "solid's stiffness")
    rest: np.ndarray = force - pull @ np.linalg.solve(stiffness, work)
    response = factors.solve(rest)
    response -= shapes @ np.linalg.solve(stiffness, modes.products(solid.linear(response)))
    factors.reset()
    energy = comm.allreduce(rest.T @ response)
    mass = comm.allreduce(np.sum(response * algebra.multiply(solid.mass, response), axis=0))
    products, given_way = np.zeros((n,) * 4), np.zeros((n,) * 4)
    tensors.unpacked(solid.pair_products(shapes, pairs), pairs, products)
    tensors.unpacked(0.5 * (energy + energy.T), pairs, given_way)
    outside = tensors.paired(given_way)
    size = energy.diagonal()
    square = size / mass
    slow = size > MATTERS * max(size.max(), np.finfo(float).tiny)
    even = (quadratic + quadratic.transpose(1, 0, 2) + quadratic.transpose(2, 1, 0)) / 3
    return SolidTensors(
        stiffness,
        even,
        tensors.symmetrised(products) + outside,
        outside,
        tensors.asymmetry(quadratic),
        float(square[slow].min()) if slow.any() else np.inf,
        square[j == k],
    )


def stiffening(modes: SolidModes, stress: tuple[float, float, float]) -> np.ndarray:
    """What a further uniform stress along x, y, z adds to the stiffness (L, L) of modes.

    By its unit; what lies outside the modes relaxes under it, theta = -G int N:eps, and is then
    pulled too: int N:S(phi_r, phi_s) + 2 phi_r . Q(theta, phi_s).  Collective.
    """
    solid, shapes = modes.solid, modes.shapes
    pull = solid.linear(shapes)
    stiffness = modes.products(pull)
    force = solid.pull(stress)[:, None]
    rest: np.ndarray = force - pull @ np.linalg.solve(stiffness, modes.products(force))
    factors = algebra.Factorization(solid.stiffness, "nanorom_solid_", "solid's stiffness")
    relaxed = -factors.solve(rest)
    factors.reset()
    found: np.ndarray = 2 * modes.products(
        solid.quadratic(np.repeat(relaxed, shapes.shape[1], axis=1), shapes)
    )
    for axis, value in enumerate(stress):
        found += value * solid.slopes(shapes, [axis])
    return 0.5 * (found + found.T)
