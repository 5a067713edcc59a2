"""Orbits of random systems lie on branches of their diagrams; short form of tests.stress.scan."""

import pytest

from tests.stress.scan import scanned

SEEDS = (0, 1, 6)  # hardening, softening and parametric


@pytest.mark.parametrize("seed", SEEDS)
def test_every_orbit_that_a_shooting_scan_finds_is_on_a_branch(seed):
    row = scanned(seed)
    assert row.orbits > 0
    assert not row.missed
