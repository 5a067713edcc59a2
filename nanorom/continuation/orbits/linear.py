"""The equations linearised about a state at rest: free motions, without drive."""

from __future__ import annotations

import numpy as np

from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array, Numbers


def static_force(system: ScaledSystem, q: Array) -> Array:
    """What holds a state (L,) at rest against the forces and the constant drive, (L,)."""
    products = np.multiply.outer(q, q)
    force = system.stiffness @ q + np.tensordot(system.quadratic, products, axes=2)
    force = force + np.tensordot(system.cubic, products, axes=2) @ q
    return np.asarray(force - system.force[:, 0] - system.parametric[..., 0] @ q)


def static_stiffness(system: ScaledSystem, q: Array) -> Array:
    """Derivative (L, L) of `static_force`."""
    products = np.multiply.outer(q, q)
    tangent = system.stiffness + 2 * system.quadratic @ q - system.parametric[..., 0]
    return np.asarray(tangent + 3 * np.tensordot(system.cubic, products, axes=2))


def free_motions(system: ScaledSystem, q: Array) -> tuple[Numbers, Numbers]:
    """Growth rates (2L - S,) of small motions about a state at rest, in rad per unit of time with
    their frequencies as imaginary parts, and their shapes (L, 2L - S); S states of first order.
    """
    massive = np.flatnonzero(system.inertia)
    stiffness = static_stiffness(system, q)
    damping = system.damping[massive]
    if system.has_loss:
        damping = damping + np.tensordot(system.loss, np.multiply.outer(q, q), axes=2)[massive]
    count = len(massive)
    size = system.size
    matrix = np.zeros((size + count,) * 2)  # of (q, q' of the modes)
    matrix[massive, size + np.arange(count)] = 1.0
    matrix[system.massless, :size] = -stiffness[system.massless]
    matrix[size:, :size] = -stiffness[massive]
    matrix[size:, size:] = -damping[:, massive]
    values, vectors = np.linalg.eig(matrix)
    return values, vectors[:size]
