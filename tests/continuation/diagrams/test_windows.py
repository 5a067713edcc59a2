"""A range shows what a wider one shows there, wherever it is cut."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import ModalSystem, explore
from tests.continuation.windows import RANDOM, compared, states

DAMPING, LEVEL = 0.01, 0.1  # of q'' + c q' + (1 + p cos w t) q + q^3 = 0, five times the threshold
SETTLED = 600  # periods of the drive, in which a disturbance falls by e^-9 and more
AMPLITUDE = 1e-3  # relative: read off between points of a branch


def settled(omega: float) -> float:
    """max |q| that the motion from a large disturbance comes to, by integration in time."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        q, v = y
        return [v, -DAMPING * v - (1 + LEVEL * np.cos(omega * t)) * q - q**3]

    period = 2 * np.pi / omega
    times = np.linspace(SETTLED, SETTLED + 2, 801) * period
    options = {"t_eval": times, "method": "DOP853", "rtol": 1e-8, "atol": 1e-10}
    found = solve_ivp(rates, (0, times[-1]), [0.5, 0.0], **options)
    return float(np.abs(found.y[0]).max())


@pytest.mark.parametrize(
    ("omega", "place"),
    [((1.99, 2.01), 2.0), ((2.0, 2.4), 2.05), ((1.8, 1.99), 1.985), ((2.1, 2.4), 2.15)],
    ids=["within its tongue", "through it", "through it from below", "beside it"],
)
def test_doubled_motion_is_found_wherever_its_tongue_is_cut(omega, place) -> None:
    system = ModalSystem(damping=[DAMPING], stiffness=[1.0], cubic=[[[[1.0]]]], parametric=[[1.0]])
    diagram = explore(system, omega, 0.0, LEVEL)
    (found,) = [s for s in states(diagram, place) if s.stable and s.periods == 2]
    assert float(found.amplitude[0]) == pytest.approx(settled(place), rel=AMPLITUDE)
    assert not diagram.unexplored


@pytest.mark.parametrize("seed", RANDOM)
def test_ranges_show_the_stable_motions_of_a_wider_one_or_say_so(seed) -> None:
    for window in compared(seed):
        assert len(window.missing) <= window.told, window


def test_no_branch_is_found_twice_where_many_orbits_cross_the_ends_of_a_range() -> None:
    """Ends of steps knew the phase of an orbit near resonance to five digits, and looked new."""
    (window,) = compared(13, trials=1)
    amplitudes = np.array([state.amplitude for state in states(window.wide, 3.0)])
    gaps = np.abs(amplitudes[:, None] - amplitudes[None]).max(axis=2)
    assert len(amplitudes) == 7
    assert np.min(gaps[np.triu_indices(len(gaps), 1)]) > 1e-4 * amplitudes.max()
