"""Orbits of three and five periods on branches of their own are found without seeds."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import Diagram, ModalSystem, explore

SEEN = 0.02  # relative: amplitudes between two points of a branch
RETURNED = 1e-7  # of a motion: change over its period, when it has settled
FIRST_ORDER = 0.02  # relative, of Melnikov's threshold at small damping
PUBLISHED_NS = [0.987743, 1.009667]  # an example of SSMTool, as in tests/benchmarks/manifolds.py
PRINTED = 1e-6


def duffing(damping: float) -> ModalSystem:
    return ModalSystem(damping=damping, stiffness=[1.0], cubic=[[[[1.0]]]], direct=[1.0])


def settled(damping: float, force: float, omega: float, largest: float) -> set[tuple[int, float]]:
    """Periods and amplitudes at which motions end up, from a grid of states: by Runge-Kutta."""
    line = np.linspace(-largest, largest, 10)
    q, v = (axis.ravel() for axis in np.meshgrid(line, omega / 2 * line))
    steps, time = 48, 0.0
    step = 2 * np.pi / omega / steps

    def change(q, v, t):
        return v, force * np.cos(omega * t) - damping * v - q - q**3

    def period(q, v, time):
        top = np.abs(q)
        for _ in range(steps):
            a = change(q, v, time)
            b = change(q + step / 2 * a[0], v + step / 2 * a[1], time + step / 2)
            c = change(q + step / 2 * b[0], v + step / 2 * b[1], time + step / 2)
            d = change(q + step * c[0], v + step * c[1], time + step)
            q = q + step / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
            v = v + step / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
            time += step
            top = np.maximum(top, np.abs(q))
        return q, v, time, top

    for _ in range(int(45 / damping / (2 * np.pi / omega))):
        q, v, time, _ = period(q, v, time)
    seen, tops = [q], np.zeros_like(q)
    for _ in range(5):
        q, v, time, top = period(q, v, time)
        tops = np.maximum(tops, top)
        seen.append(q)
    found = set()
    for i in range(len(q)):
        for multiple in range(1, 6):
            if abs(seen[multiple][i] - seen[0][i]) < RETURNED:
                found.add((multiple, round(float(tops[i]), 2)))
                break
    return found


def stable_at(diagram: Diagram, omega: float) -> list[tuple[int, float]]:
    """Period multiples and amplitudes of the stable orbits of a diagram at a frequency."""
    found = []
    for branch in diagram.branches:
        before, after = branch.omega[:-1], branch.omega[1:]
        for i in np.flatnonzero((before - omega) * (after - omega) < 0):
            if branch.stable[i] or branch.stable[i + 1]:
                part = (omega - before[i]) / (after[i] - before[i])
                low, high = branch.amplitude[i : i + 2, 0]
                found.append((branch.period_multiple, float(low + part * (high - low))))
    return found


def test_every_motion_that_an_integration_settles_to_is_in_the_diagram() -> None:
    damping, force, omega = 0.1, 5.0, 3.6
    diagram = explore(duffing(damping), (omega - 0.5, omega + 0.5), force)
    stable = stable_at(diagram, omega)
    found = settled(damping, force, omega, 4.0)
    assert {period for period, _ in found} == {1, 3}
    for period, amplitude in found:
        near = [a for p, a in stable if p == period and abs(a / amplitude - 1) < SEEN]
        assert near, f"period {period}, amplitude {amplitude}: none in {stable}"


def test_a_motion_of_five_periods_comes_back_to_itself_when_it_is_disturbed() -> None:
    damping, force, periods = 0.01, 20.0, 60
    diagram = explore(duffing(damping), (6.0, 7.5), force)
    (branch,) = [branch for branch in diagram.branches if branch.period_multiple == 5]
    stable = np.flatnonzero(branch.stable & (branch.omega > 6.8) & (branch.omega < 7.4))
    orbit = branch.orbit(int(stable[len(stable) // 2]))
    start = np.array([orbit(0.0)[0], orbit.velocity(0.0)[0]])

    def right_side(t, y):
        return [y[1], force * np.cos(orbit.omega * t) - damping * y[1] - y[0] - y[0] ** 3]

    time = periods * 2 * np.pi / orbit.omega
    ends = [
        solve_ivp(right_side, (0, time), start + shift, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        for shift in (0.0, 1e-3)
    ]
    assert np.abs(ends[0] - start).max() < 1e-7
    left = np.linalg.norm(ends[1] - ends[0]) / np.linalg.norm([1e-3, 1e-3])
    assert left < 3 * np.exp(-damping * time / 2)
    one = solve_ivp(right_side, (0, time / periods), start, "DOP853", rtol=1e-11).y[:, -1]
    assert np.abs(one - start).max() > 0.1


def test_they_begin_where_the_work_of_the_drive_first_equals_the_loss() -> None:
    """Of q = a cos t + a^3/32 cos 3t, to the first orders in a: 3 f a / 32 = c."""
    damping, force = 1e-4, 4e-3
    amplitude = 32 * damping / (3 * force)
    (branch,) = [
        branch
        for branch in explore(duffing(damping), (3.0, 3.4), force, depth=0).branches
        if branch.period_multiple == 3
    ]
    assert branch.omega.min() == pytest.approx(3 * (1 + 3 / 8 * amplitude**2), rel=FIRST_ORDER / 3)
    assert branch.omega.min() > 3.001


def test_none_are_told_where_the_drive_is_too_weak() -> None:
    diagram = explore(duffing(0.04), (3.1, 4.1), 0.1)
    assert [branch.period_multiple for branch in diagram.branches] == [1]
    assert not diagram.unexplored


def test_the_upper_branch_of_a_resonance_far_below_the_range_is_found() -> None:
    diagram = explore(duffing(0.04), (3.1, 4.1), 2.0)
    upper = [b for b in diagram.branches if b.period_multiple == 1 and b.amplitude.max() > 3]
    stable = [branch for branch in upper if branch.stable.any()]
    assert len(stable) == 1
    assert stable[0].stable.all()


@pytest.mark.filterwarnings("error")
def test_mode_that_alone_is_linear_is_looked_at_without_a_warning():
    """x1'' + x1 + x1 x2, x2'' + 4 x2 + x1^2: alone, x2 has one frequency at all amplitudes."""
    quadratic = np.zeros((2, 2, 2))
    quadratic[0, 0, 1] = quadratic[0, 1, 0] = quadratic[1, 0, 0] = np.sqrt(0.5)
    system = ModalSystem(
        damping=[0.005, 0.01], stiffness=[1.0, 4.0], quadratic=quadratic, direct=[1.0, 0.0]
    )
    found = [point.omega for point in explore(system, (0.9, 1.1), 0.01).points("NS")]
    assert sorted(found) == pytest.approx(PUBLISHED_NS, rel=PRINTED)
