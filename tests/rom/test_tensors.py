"""Symmetric tensors: the same force, exactly symmetric, every product counted once."""

from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nanorom.rom.tensors import asymmetry, monomials, symmetrise


@given(st.integers(1, 5), st.integers(3, 4), st.integers(0, 2**32 - 1))
def test_symmetrised_tensors_give_the_same_force_and_are_exactly_symmetric(size, rank, seed):
    rng = np.random.default_rng(seed)
    tensor, q = rng.standard_normal((size,) * rank), rng.standard_normal(size)
    symmetric = symmetrise(tensor)
    assert np.array_equal(symmetric, np.swapaxes(symmetric, 1, rank - 1))
    assert np.array_equal(symmetric, np.swapaxes(symmetric, 1, 2))
    assert symmetrise(symmetric) is symmetric
    force, expected = symmetric, tensor
    for _ in range(rank - 1):
        force, expected = force @ q, expected @ q
    assert np.allclose(force, expected, rtol=0, atol=1e-13 * np.abs(tensor).sum())


def test_asymmetry_of_a_potential_is_zero_and_of_a_changed_entry_its_relative_size():
    tensor = np.ones((3, 3, 3, 3))
    assert asymmetry(tensor) == 0.0
    tensor[0, 1, 1, 1] += 0.25
    assert asymmetry(tensor) == pytest.approx(0.25 / 1.25, rel=1e-15)
    assert asymmetry(np.zeros((2, 2))) == 0.0


@given(st.integers(1, 6), st.integers(2, 3))
def test_monomials_count_every_product_once(size, degree):
    found = list(monomials(size, degree))
    assert len(found) == comb(size + degree - 1, degree)
    assert sum(orders for _, orders in found) == size**degree
