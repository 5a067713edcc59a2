"""Isolas of random systems are on branches; short form of tests.stress.isolas."""

import pytest

from tests.stress.isolas import scanned

SEEDS = (1, 2)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_orbit_of_an_isola_that_a_shooting_scan_finds_is_on_a_branch(seed):
    row = scanned(seed)
    assert row.isolas > 0 and row.on_isolas > 0
    assert not row.missed
