"""All forces of a shell as plain arrays: those that its energy and its load have."""

import numpy as np
import pytest

import nanorom
from nanorom.fem.models.shell_system import ShellSystem
from nanorom.fem.plan import Plan
from nanorom.fem.routes.shell import solve
from nanorom.fem.solvers.groups import alone
from nanorom.fem.stopwatch import Stopwatch

ROUND_OFF = 1e-9  # of the largest force: small differences of those about a state under load
DIFFERENCES = 1e-5


@pytest.fixture(scope="module", params=[None, 30.0])
def shell(request, tmp_path_factory):
    """A shallow dome of random height under tension; without and with a pressure inside."""
    rng = np.random.default_rng(15)
    x, y = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(-1.01, 1.01, 41)]))
    bent = 0.1 * (1 - x**2) * (1 - y**2) + 0.02 * np.polyval(rng.standard_normal(3), x + 0.5 * y)
    file = tmp_path_factory.mktemp("dome") / "dome.csv"
    np.savetxt(file, np.column_stack([x, y, bent]), delimiter=",")
    scene = nanorom.Scene(
        geometry=nanorom.Disc(radius=1.0),
        plate=nanorom.Plate(0.02, "shell", file),
        material=nanorom.Material(1e9, 0.3, 1000.0),
        tension=nanorom.Tension(1e4, 1e4),
        support=nanorom.Support("clamped"),
        load=None if request.param is None else nanorom.Load(pressure=request.param),
        modes=nanorom.Modes(2),
        accuracy=nanorom.Accuracy(degree=4, mesh_size=1.0),
    )
    plan = Plan.of(scene)
    modes = solve(alone(), plan, None, Stopwatch(None)).modes
    pressure = (request.param or 0.0) * plan.scales.length / plan.scales.tension
    problem = modes.problem
    system = ShellSystem.of(modes.shell, problem.free.local, problem.stiffness, pressure)
    return problem, system


def moved(system, columns, seed):
    size = 0.05 * np.random.default_rng(seed).standard_normal((system.size, columns))
    return size


def test_force_is_that_of_the_energy_and_of_the_pressure_that_follows(shell):
    problem, system = shell
    base, load = problem.free_values(), float(problem.magnitude.value)
    rest = problem.residual()
    for state in moved(system, 2, 1).T:
        problem.set_state(base + state, load)
        expected = problem.residual() - rest
        problem.set_state(base, load)
        found = system.stiffness @ state + system.force(state[:, None])[:, 0]
        assert np.abs(found - expected).max() < ROUND_OFF * np.abs(expected).max()


def test_multilinear_forces_are_symmetric_and_sum_to_the_whole(shell):
    _, system = shell
    u, v, w, x = (moved(system, 3, seed) for seed in range(4))
    whole = system.force(u)
    unit = np.abs(whole).max()
    assert system.quadratic(u, u) + system.cubic(u, u, u) == pytest.approx(whole, abs=1e-12 * unit)
    along = 2 * system.quadratic(u, v) + 3 * system.cubic(u, u, v)
    assert system.along(u, v) == pytest.approx(along, abs=1e-12 * unit)
    work = np.sum(x * system.cubic(u, v, w), axis=0)
    assert np.sum(v * system.cubic(u, x, w), axis=0) == pytest.approx(work, rel=ROUND_OFF)
    work = np.sum(w * system.quadratic(u, v), axis=0)
    assert np.sum(v * system.quadratic(w, u), axis=0) == pytest.approx(work, rel=ROUND_OFF)
    complex_force = system.quadratic(u + 1j * v, w)
    assert complex_force.imag == pytest.approx(system.quadratic(v, w), abs=1e-12 * unit)
