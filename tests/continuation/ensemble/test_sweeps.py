"""Many sweeps at once are the sweeps one by one, settle on stable branches, fall at folds."""

import attrs
import numpy as np
import pytest

from nanorom.continuation import Drive, ModalSystem, explore, falls, sweep, sweeps
from nanorom.continuation.ensemble import ensemble, runge_kutta
from nanorom.errors import ContinuationError
from tests.continuation.independent import after, motion, random_drives, random_states
from tests.continuation.systems import duffing

LEVEL = 0.05
SETTLED = 1e-5  # of a state, both sweeps settled to 1e-6 of two periods at Q = 30
INTEGRATED = 1e-7  # of states after three periods, relative
SAME = 1e-12  # of states, relative: the engines differ by rounding
ENGINES = ("compiled", "arrays")
needs_compiler = pytest.mark.skipif(
    runge_kutta.compiled(1) is None, reason="there is no C compiler"
)


def random_system(seed: int, drives=(), states=None) -> ModalSystem:
    """Three modes with every kind of force."""
    rng = np.random.default_rng(seed)
    size = 3
    return ModalSystem(
        damping=np.diag([0.05, 0.06, 0.08]),
        stiffness=np.diag([1.0, 2.3, 4.1]),
        quadratic=0.2 * rng.standard_normal((size,) * 3),
        cubic=0.1 * rng.standard_normal((size,) * 4),
        cubic_damping=0.05 * rng.standard_normal((size,) * 4),
        direct=rng.standard_normal(size),
        parametric=rng.standard_normal((size, size)),
        drives=drives,
        states=states,
    )


@pytest.fixture(scope="module")
def diagram():
    return explore(duffing(30.0), (0.8, 1.6), direct=LEVEL)


@pytest.fixture(scope="module")
def up_and_down():
    up = np.linspace(0.9, 1.5, 25)
    omega = np.stack([up, up[::-1], up])
    options = {"settle": 1e-6, "tolerance": 1e-8}
    return sweeps(duffing(30.0), omega, [LEVEL, LEVEL, LEVEL / 2], **options)


def test_every_member_settles_where_a_sweep_alone_does(up_and_down):
    omega = up_and_down.omega[2, :2]
    alone = sweep(duffing(30.0), omega, LEVEL / 2, settle=1e-6, tolerance=1e-8)
    assert np.abs(up_and_down.state[2, :2] - alone.state).max() < SETTLED
    assert np.abs(up_and_down.amplitude[2, :2] - alone.amplitude).max() < SETTLED


def test_sweeps_are_on_stable_branches_and_jump_at_the_folds(up_and_down, diagram):
    folds = sorted(point.omega for point in diagram.points("LP"))
    (branch,) = diagram.branches
    turns = np.flatnonzero(np.diff(branch.stable.astype(int)))
    parts = branch.omega[: turns[0] + 1], branch.omega[turns[1] + 1 :]
    sizes = branch.amplitude[: turns[0] + 1, 0], branch.amplitude[turns[1] + 1 :, 0]
    for member, upper in ((0, lambda w: w < folds[1]), (1, lambda w: w < folds[0])):
        assert up_and_down.settled[member].all()
        for omega, amplitude in zip(up_and_down.omega[member], up_and_down.amplitude[member, :, 0]):
            if min(abs(omega - fold) for fold in folds) < 0.01:
                continue  # creeps
            x, y = (parts[0], sizes[0]) if upper(omega) else (parts[1], sizes[1])
            order = np.argsort(x)
            # linear between points of the branch, which are close
            assert abs(np.interp(omega, x[order], y[order]) - amplitude) < 5e-3
    found = falls(attrs.evolve(up_and_down, omega=np.tile(up_and_down.omega[0], (3, 1))))
    step = np.diff(up_and_down.omega[0])[0]
    assert folds[1] - 2 * step <= found.last[0] <= folds[1]  # a step may leave the basin before


@needs_compiler
@pytest.mark.parametrize("seed", range(3))
def test_both_engines_make_the_same_steps(seed):
    drives = [Drive(harmonic=2, phase=0.4, direct=[0.1, 0.0, 0.2], power=2)]
    system = random_system(seed, drives)
    rng = np.random.default_rng(seed)
    members = ensemble.members_of(
        system,
        rng.uniform(0.8, 1.2, (7, 1)),
        rng.uniform(0.0, 0.1, 7),
        rng.uniform(0.0, 0.1, 7),
        0.1 * rng.standard_normal((7, 6)),
    )
    ends = []
    for engine in ENGINES:
        own = ensemble.ensemble_of(system, members, 1e-8, engine, 2)
        unit = own.equations.scaled
        tangents = np.random.default_rng(seed + 100).standard_normal((6, 7))
        states = np.stack([unit.inner_states(members.states).T, tangents])
        rates = members.omega[:, 0] / unit.frequency
        ends.append(own.run(states, np.arange(7), rates, 4, 2))
    assert not ends[0][2].any() and not ends[1][2].any()
    for one, two in zip(ends[0][:2], ends[1][:2]):
        assert np.abs(one - two).max() <= SAME * max(1.0, np.abs(one).max())


@pytest.mark.parametrize("seed", range(4))
def test_states_of_members_are_those_of_an_independent_integration(seed):
    """Drives of several harmonics and powers, and states of first order, of odd seeds."""
    extra = seed % 2  # a state of first order
    drives = random_drives(3, extra, seed)
    system = random_system(seed, drives, random_states(3, extra, seed) if extra else None)
    rng = np.random.default_rng(seed)
    levels, omega = rng.uniform(0.0, 0.1, (2, 4)), rng.uniform(0.8, 1.3, 4)
    q, v = 0.1 * rng.standard_normal((2, 4, 3 + extra))
    v[:, 3:] = 0.0
    states = np.concatenate([q, v], axis=1)
    members = ensemble.members_of(system, omega[:, None], *levels, states)
    own = ensemble.ensemble_of(system, members, 1e-10, "auto", 1)
    unit = own.equations.scaled
    begin = np.ascontiguousarray(unit.inner_states(states).T)[None]
    end = own.run(begin, np.arange(4), omega / unit.frequency, 3, 1)[0][0]
    for member in range(4):
        rate = motion(system, omega[member], *levels[:, member])
        start = np.concatenate([q[member, :3], v[member, :3], q[member, 3:]])
        exact = after(rate, start, 6 * np.pi / omega[member])
        found = unit.given_states(end[:, member])
        found = np.concatenate([found[:3], found[3 + extra : 6 + extra], found[3 : 3 + extra]])
        assert np.abs(found - exact).max() < INTEGRATED * max(1.0, np.abs(exact).max())


def test_members_that_leave_all_bounds_are_told_and_others_go_on():
    system = ModalSystem(damping=[0.02], stiffness=[1.0], quadratic=np.ones((1, 1, 1)), direct=[1])
    found = sweeps(system, [0.7, 0.8, 0.9], [0.01, 2.0], periods=40, engine="auto")
    assert np.isnan(found.escaped[0]) and found.escaped[1] == pytest.approx(0.7)
    assert np.isfinite(found.amplitude[0]).all() and np.isnan(found.amplitude[1]).all()


def test_one_that_leaves_costs_the_others_nothing():
    """Steps of the others stay as long as they were."""
    system = ModalSystem(damping=[0.02], stiffness=[1.0], quadratic=np.ones((1, 1, 1)), direct=[1])
    members = ensemble.members_of(system, [0.8], [0.01, 2.0], 0.0, None)
    own = ensemble.ensemble_of(system, members, 1e-6, "auto", 1)
    states = np.full((1, 2, 2), 1e-3)
    left = own.run(states, np.arange(2), np.full(2, 0.8), 40, 1)[2]
    assert list(left) == [False, True] and own.steps < 100


def test_without_a_compiler_arrays_do_the_same(monkeypatch):
    monkeypatch.setattr(ensemble, "compiled", lambda workers: None)
    found = sweeps(duffing(5.0), [0.9, 1.0], [0.05, 0.1], settle=1e-4)
    monkeypatch.undo()
    other = sweeps(duffing(5.0), [0.9, 1.0], [0.05, 0.1], settle=1e-4)
    assert np.abs(found.amplitude - other.amplitude).max() < SAME
    monkeypatch.setattr(ensemble, "compiled", lambda workers: None)
    with pytest.raises(ContinuationError, match="C compiler"):
        sweeps(duffing(5.0), [0.9], 0.05, engine="compiled")


def test_shares_of_sweeps_that_are_up_have_their_intervals(up_and_down):
    one = attrs.evolve(
        up_and_down,
        omega=np.tile(np.arange(1.0, 6.0), (4, 1)),
        amplitude=np.array([[1, 1, 0, 0, 0], [1, 1, 1, 0, 0], [1, 1, 1, 1, 1], [1, 0, 0, 0, 0.0]])[
            :, :, None
        ],
    )
    found = falls(one)
    assert list(found.last) == [2.0, 3.0, 5.0, 1.0]
    assert list(found.fell) == [True, True, False, True]
    assert found.up == pytest.approx([1.0, 0.75, 0.5, 0.25, 0.25])
    # of none in four the 95 % interval ends at 1 - .025^(1/4)
    assert found.low[0] == pytest.approx(0.025**0.25) and found.high[0] == 1.0
    assert found.quantile(0.0) == 1.0 and found.quantile(0.99) == np.inf


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"omega": [1.0, -1.0]}, "omega"),
        ({"omega": [1.0], "direct": [1.0, 2.0], "parametric": [0.0] * 3}, "members"),
        ({"omega": [1.0], "state": np.zeros(3)}, "state"),
        ({"omega": [1.0], "direct": np.nan}, "direct"),
        ({"omega": [1.0], "engine": "fast"}, "engine"),
        ({"omega": np.ones((20_000, 9_000))}, "numbers"),
    ],
)
def test_what_makes_no_sense_is_told(arguments, told):
    with pytest.raises(ContinuationError, match=told):
        sweeps(duffing(), **arguments)
