"""Isolas of random systems are on branches; short form of tests.stress.isolas."""

import pytest

from tests.stress.isolas import near, scanned, wide

CASES = ((near, 1), (wide, 2))  # the second merges at twice the level, and the range cuts it there


@pytest.mark.parametrize("draw, seed", CASES)
def test_every_orbit_of_an_isola_that_a_shooting_scan_finds_is_on_a_branch(draw, seed):
    row = scanned(seed, draw)
    assert row.isolas > 0 and row.on_isolas > 0
    assert not row.missed
