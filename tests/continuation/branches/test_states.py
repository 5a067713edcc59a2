"""States on a branch one by one, and orbits against time integration."""

from __future__ import annotations

from itertools import islice

import pytest

from nanorom.continuation import explore, states
from tests.continuation.independent import gap
from tests.continuation.systems import duffing, random_potential


def test_states_lie_on_the_branch_and_can_be_stopped() -> None:
    first = list(islice(states(duffing(), (0.8, 1.5), 0.005), 5))
    assert len(first) == 5
    assert first[0].omega == pytest.approx(0.8)
    for state in first:
        assert gap(duffing(), state.orbit, 0.005) < 1e-8
    falling = list(states(duffing(), (0.8, 1.5), 0.005, falling=True))
    assert falling[0].omega == pytest.approx(1.5)
    assert falling[-1].omega == pytest.approx(0.8)


@pytest.mark.parametrize("seed", range(3))
def test_orbits_of_dense_systems_close_in_time_integration(seed) -> None:
    system = random_potential(3, seed)
    diagram = explore(system, (0.8, 1.6), direct=0.05, parametric=0.02)
    for branch in diagram.branches:
        for index in range(0, len(branch), 15):
            orbit = branch.orbit(index)
            assert gap(system, orbit, 0.05, 0.02) < 1e-8
