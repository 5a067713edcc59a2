"""Harmonic balance: its derivatives are those of its residual, whatever terms there are."""

import numpy as np
import pytest

from nanorom.continuation import ModalSystem
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.harmonics import basis_for, full_support

STEP = 1e-3  # of central differences: exact for a cubic, but for round-off
ROUND_OFF = 1e-9


def random_balance(seed, harmonics=5):
    """Three modes with all terms, and without the coefficients of some bands."""
    random = np.random.default_rng(seed)
    vectors = random.standard_normal((4, 3))
    cubic, loss = (np.einsum("mi,mj,mk,ml->ijkl", *[vectors * s] * 4) for s in (1.0, 0.3))
    symmetric = np.einsum("mi,mj,mk->ijk", *[vectors] * 3)
    system = ModalSystem(
        stiffness=np.diag([1.0, 2.0, 5.0]),
        damping=0.1 * np.eye(3),
        quadratic=symmetric,
        cubic=cubic,
        cubic_damping=loss,
        direct=random.standard_normal(3),
        parametric=np.eye(3),
    ).scaled(0.3, 0.2)
    balance = HarmonicBalance(system, basis_for(full_support(system, 1), harmonics, 1))
    taken = random.random((3, 3))[(balance.basis.number + 1) // 2 % 3] > 0.3
    return balance.only(taken), random


@pytest.mark.parametrize("seed", range(3))
def test_jacobian_and_derivative_along_a_direction_are_those_of_the_residual(seed) -> None:
    balance, random = random_balance(seed)
    basis, rate = balance.basis, 0.8
    x, change = (basis.unpack(random.standard_normal(basis.size)) for _ in range(2))
    above, below = (balance.residual(x + sign * STEP * change, rate) for sign in (1, -1))
    twice = [balance.residual(x + 2 * sign * STEP * change, rate) for sign in (1, -1)]
    slope = (8 * (above - below) - (twice[0] - twice[1])) / (12 * STEP)
    along = balance.along(x, rate, change)
    size = np.abs(slope).max()
    assert np.abs(along - slope).max() < ROUND_OFF * size
    product = basis.pack(change) @ balance.jacobian_t(x, rate)
    assert np.abs(product - basis.pack(along)).max() < ROUND_OFF * size
