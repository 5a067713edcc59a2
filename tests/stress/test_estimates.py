"""Estimates of random devices are near their errors; short form of tests.stress.estimates."""

import pytest

from tests.stress.estimates import held

SEEDS = (2, 5)  # a plate and a membrane; the second has the largest overestimate of the first ten
TOO_SMALL, TOO_LARGE = 3.0, 30.0


@pytest.mark.parametrize("seed", SEEDS)
def test_estimate_of_a_random_device_is_near_what_its_film_shows(seed):
    found = held(seed)
    assert len(found.ratios)
    assert (found.ratios > 1 / TOO_SMALL).all()
    assert (found.ratios < TOO_LARGE).all()
