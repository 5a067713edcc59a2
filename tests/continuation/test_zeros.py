"""Tensors of many modes that are zero cost nothing; those that are not are made symmetric."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from nanorom.continuation.arrays import symmetrise_cubic
from nanorom.continuation.scaled import over_mass

ROUND_OFF = 1e-15


def test_tensors_that_are_zero_take_no_memory() -> None:
    shapes = {"quadratic": (2,) * 3, "cubic": (2,) * 4, "cubic_damping": (2,) * 4}
    over = over_mass(np.eye(2), {name: np.zeros(shape) for name, shape in shapes.items()})
    assert not any(over["cubic"].strides) and not any(over["loss"].strides)


def test_cubic_tensor_is_the_mean_over_all_orders_and_that_of_the_user_stays() -> None:
    given = np.random.default_rng(5).normal(size=(3,) * 4)
    before = given.copy()
    orders = list(permutations((1, 2, 3)))
    mean = sum(given.transpose(0, *order) for order in orders) / len(orders)
    zero = np.zeros((3,) * 3)
    over = over_mass(np.eye(3), {"quadratic": zero, "cubic": given, "cubic_damping": zero})
    assert np.array_equal(given, before)
    assert np.abs(over["cubic"] - mean).max() < ROUND_OFF
    assert np.abs(symmetrise_cubic(given.copy()) - mean).max() < ROUND_OFF
