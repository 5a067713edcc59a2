"""Orbits of random systems lie on branches of their diagrams; short form of tests.stress.scan."""

import pytest

from tests.stress.scan import scanned

SEEDS = (0, 6)  # hardening, at Q of 2e6, and parametric, at 3e5


@pytest.mark.parametrize("seed", SEEDS)
def test_every_orbit_that_a_shooting_scan_finds_is_on_a_branch(seed):
    row = scanned(seed)
    assert row.orbits > 0
    assert not row.missed
