"""Random modal systems whose forces derive from a potential, and a known one in 1:2 resonance."""

from itertools import permutations

import numpy as np

from nanorom.continuation import ModalSystem


def symmetric(tensor):
    orders = list(permutations(range(tensor.ndim)))
    return sum(tensor.transpose(order) for order in orders) / len(orders)


def random_system(seed, modes=4, quadratic=1.0, losses=0.0, coupled=0.0, ratio=0.003):
    """Lowest frequency 1, others between 1.2 and 6, hardening cubic forces, damping `ratio`;
    `losses` and `coupled`: sizes of cubic damping and of damping off the diagonal.
    """
    random = np.random.default_rng(seed)
    frequency = np.sort(np.append(1.0, random.uniform(1.2, 6, modes - 1)))
    cubic = symmetric(random.standard_normal((modes,) * 4)) / 2
    cubic[np.arange(modes), np.arange(modes), np.arange(modes), np.arange(modes)] += 1.0
    root = random.standard_normal((modes, modes))
    damping = np.diag(2 * ratio * frequency) + coupled * ratio * (root + root.T) / 4
    return ModalSystem(
        damping=damping,
        stiffness=frequency**2,
        quadratic=quadratic * symmetric(random.standard_normal((modes,) * 3)),
        cubic=cubic,
        cubic_damping=losses * symmetric(random.standard_normal((modes,) * 4)),
        direct=random.standard_normal(modes),
        parametric=symmetric(random.standard_normal((modes,) * 2)),
    )


def one_to_two():
    """x1'' + .005 x1' + x1 + x1 x2 = F cos(omega t), x2'' + .01 x2' + 4 x2 + x1^2 = 0."""
    quadratic = np.zeros((2, 2, 2))
    quadratic[0, 0, 1] = quadratic[0, 1, 0] = 0.5
    quadratic[1, 0, 0] = 1.0
    return ModalSystem(
        damping=[0.005, 0.01], stiffness=[1.0, 4.0], quadratic=quadratic, direct=[1.0, 0.0]
    )


def rest(system, t, state):
    """(q, q')' without drive, written out anew."""
    q, v = np.split(state, 2)
    rate = np.outer(q, v)
    force = system.damping @ v + system.stiffness @ q
    force = force + np.einsum("rjk,j,k->r", system.quadratic, q, q)
    force = force + np.einsum("rjkl,j,k,l->r", system.cubic, q, q, q)
    force = force + np.einsum("rjkl,jk,l->r", system.cubic_damping, rate + rate.T, q)
    return np.concatenate([v, -np.linalg.solve(system.mass, force)])
