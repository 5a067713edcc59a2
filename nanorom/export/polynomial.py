"""The modal equations as polynomials of the state x = (q, q'), for programs of other people.

q'' = sum of the terms of order 1, 2 and 3 + (f + P q) cos(omega t)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation.scaled import ScaledSystem
from nanorom.types import Array


@attrs.frozen(eq=False)
class Terms:
    """Terms of one order d: sum_t coefficient[:, t] prod_i x[index[t, i]].

    index : (n, d), 0-based places in x (2L,), rising; coefficient : (L, n).
    """

    index: NDArray[np.int64]
    coefficient: Array

    def __call__(self, x: Array) -> Array:
        """Their sum (L,) at a state x (2L,)."""
        return np.asarray(self.coefficient @ np.prod(x[self.index], axis=1))


def acceleration(system: ScaledSystem) -> tuple[Terms, Terms, Terms]:
    """q'' without the drive, terms of order 1, 2 and 3 in the units of the scaled equations."""
    n = system.size
    q, v = np.arange(n), n + np.arange(n)
    linear = [((q,), system.stiffness), ((v,), system.damping)]
    cubic = [((q, q, q), system.cubic), ((v, q, q), system.loss)]
    return _terms(linear), _terms([((q, q), system.quadratic)]), _terms(cubic)


def _terms(parts: Sequence[tuple[tuple[NDArray[Any], ...], Array]]) -> Terms:
    """Minus the sum of tensors T[r, a, b, ...] x_a x_b ..., each product of states once."""
    places, values = [], []
    for axes, tensor in parts:
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        places.append(np.sort(grid, axis=1))
        values.append(-tensor.reshape(len(tensor), -1).T)
    index, inverse = np.unique(np.concatenate(places), axis=0, return_inverse=True)
    total = np.zeros((len(index), values[0].shape[1]))
    np.add.at(total, inverse.ravel(), np.concatenate(values))
    kept = total.any(axis=1)
    return Terms(index[kept], total[kept].T)
