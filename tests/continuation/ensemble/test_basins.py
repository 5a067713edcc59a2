"""Basins: their border is the stable manifold of the unstable orbit, their motions the branches."""

import numpy as np
import pytest

from nanorom.continuation import basins, explore
from nanorom.errors import ContinuationError
from nanorom.plots import basins_figure
from tests.continuation.independent import after, motion
from tests.continuation.systems import duffing

LEVEL, OMEGA = 0.05, 1.25
AXIS = np.linspace(-1.2, 1.2, 13)
STATE = 1e-3  # of states: settled to 1e-6 of two periods at Q = 30


@pytest.fixture(scope="module")
def found():
    return basins(duffing(30.0), OMEGA, np.eye(2), AXIS, AXIS, direct=LEVEL)


def orbits():
    """States of the three orbits at the frequency, corrected by time integration and Newton."""
    (branch,) = explore(duffing(30.0), (0.9, 1.6), direct=LEVEL).branches
    rate = motion(duffing(30.0), OMEGA, LEVEL, 0.0)
    period = 2 * np.pi / OMEGA
    for index in np.flatnonzero(np.diff(np.sign(branch.omega - OMEGA))):
        ends = [branch.orbit(int(place)) for place in (index, index + 1)]
        part = (OMEGA - ends[0].omega) / (ends[1].omega - ends[0].omega)
        begins = [np.concatenate([orbit(0.0), orbit.velocity(0.0)]) for orbit in ends]
        state = (1 - part) * begins[0] + part * begins[1]
        for _ in range(6):
            gap = after(rate, state, period) - state
            steps = 1e-5 * np.eye(2)
            slope = [after(rate, state + s, period) - after(rate, state - s, period) for s in steps]
            state = state - np.linalg.solve(np.array(slope).T / 2e-5 - np.eye(2), gap)
        yield bool(branch.stable[index]), state


def test_motions_are_the_stable_orbits(found):
    stable = [state for kind, state in orbits() if kind]
    assert len(found.share) == len(stable) == 2
    for state in stable:
        assert np.abs(found.state - state).max(axis=1).min() < STATE
    assert (found.which >= 0).all() and found.share.sum() == pytest.approx(1.0)


def test_the_border_goes_through_the_unstable_orbit():
    """Beside it, along its unstable direction, starts settle on different motions on each side."""
    ((_, state),) = [each for each in orbits() if not each[0]]
    rate, period = motion(duffing(30.0), OMEGA, LEVEL, 0.0), 2 * np.pi / OMEGA
    steps = 1e-5 * np.eye(2)
    slope = [after(rate, state + s, period) - after(rate, state - s, period) for s in steps]
    values, vectors = np.linalg.eig(np.array(slope).T / 2e-5)
    direction = vectors[:, np.abs(values).argmax()].real
    beside = basins(
        duffing(30.0),
        OMEGA,
        np.stack([direction, np.zeros(2)]),
        0.02 * np.array([-2.0, -1.0, 1.0, 2.0]),
        [0.0],
        direct=LEVEL,
        origin=state,
        tolerance=1e-9,
    ).which[:, 0]
    assert beside[0] == beside[1] != beside[2] == beside[3]


def test_they_are_drawn(found, tmp_path):
    figure = basins_figure(found, tmp_path / "basins.png")
    assert (tmp_path / "basins.png").stat().st_size > 1000
    drawn = figure.axes[0].collections[0].get_array().reshape(13, 13)
    assert np.array_equal(np.asarray(drawn).T, found.which)


def test_a_plane_of_one_direction_is_refused():
    with pytest.raises(ContinuationError, match="plane"):
        basins(duffing(30.0), OMEGA, np.ones((1, 2)), AXIS, AXIS, direct=LEVEL)
