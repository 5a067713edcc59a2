"""The shell as a flat drum: its modes and coefficients tend to the plate's as h/R goes to 0."""

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Rings
from nanorom.fem.models.shell import Shell, ShellStiffness
from nanorom.fem.modes import coupled
from nanorom.fem.modes import shell as shells
from nanorom.fem.modes.normal import normalise
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.statics.problem import StaticProblem
from nanorom.fem.tensors import amplitude, direct, shell_cases, step
from tests.fem.drums import drum

NU, BENDING, DEGREE = 0.3, 0.3, 5
THICKNESSES = (0.04, 0.02)  # of the radius
PLATEAU = 1e-3  # change of b111 when the amplitude is halved


def shell_modes(thickness, count):
    """A drum of tension 1 and bending stiffness BENDING, whatever its thickness."""
    rings = Rings((0.5, 1.0), (2, 4))

    def place(x):
        return np.column_stack([x, np.zeros(len(x))])

    domain = mesh.build(MPI.COMM_WORLD, rings, DEGREE, place=place)
    stretch = 12 * (1 - NU**2) * BENDING / thickness**2
    stiffness = ShellStiffness(stretch / thickness, NU, thickness, pre_tension=(1.0, 1.0, 1.0))
    shell = Shell.on(domain, DEGREE, stiffness)
    problem = StaticProblem(shell.state, shell.energy(), fixed=shell.held(["edge"], []))
    return shells.solve(shell, problem, count), stretch


@pytest.fixture(scope="module")
def plate():
    return normalise(coupled.solve(drum(BENDING, degree=DEGREE, mirrors=(), nu=NU), 1))


def test_frequency_and_cubic_coefficient_tend_to_the_plates(plate):
    cubic, _ = direct.cubic_tensor(plate.take(np.arange(1)))
    exact = np.array([np.sqrt(plate.eigenvalues[0]), cubic[0, 0, 0, 0]])
    deviations = []
    for thickness in THICKNESSES:
        modes, stretch = shell_modes(thickness, 1)
        modes = modes.like(normalise(modes.modes.take(np.arange(1))))
        result = step.step(shell_cases.ShellCases(modes), 0.2 * thickness)
        found = np.array([np.sqrt(modes.eigenvalues[0]), result.cubic[0, 0, 0, 0] / stretch])
        deviations.append(np.abs(found / exact - 1))
    thick, thin = deviations
    assert np.all(thin < 0.01)
    # of order h^2: shear flexibility and rotations
    assert np.all(np.log2(thick / thin) > 1.5)


def test_amplitude_is_on_the_plateau_and_truncation_is_told():
    modes, _ = shell_modes(0.02, 2)
    modes = modes.like(normalise(modes.modes.take(np.arange(2))))
    cases = shell_cases.ShellCases(modes)
    large, small = (step.step(cases, a * 0.02) for a in (0.2, 0.1))
    assert large.cubic == pytest.approx(small.cubic, abs=PLATEAU * np.abs(small.cubic).max())
    assert small.asymmetry < 1e-4
    missed = [amplitude.truncation(cases, small, a * 0.02) for a in (1.0, 2.0)]
    assert missed[0] < 0.01
    # the next term of the force is of two orders more
    assert np.log2(missed[1] / missed[0]) == pytest.approx(2.0, abs=0.3)


def test_follower_pressure_turns_with_the_shell():
    """After a rigid rotation the resultant of a unit pressure lies along the turned normal."""
    shell = shell_modes(0.02, 1)[0].shell
    angle = 1.1
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    x = shell.space.tabulate_dof_coordinates()
    shell.state.x.array.reshape(-1, 6)[:, :3] = x @ (turn - np.eye(3)).T
    shell.state.x.array.reshape(-1, 6)[:, 3:] = turn[:, 2] - np.eye(3)[2]
    force = algebra.assemble_vector(compat.form(shell.follower_pressure())).reshape(-1, 6)
    assert np.abs(force[:, :3].sum(axis=0)) == pytest.approx(np.abs(np.pi * turn[:, 2]), abs=1e-6)
    # a rigid motion stores nothing
    stored = fem.assemble_scalar(compat.form(shell.energy()))
    assert abs(stored) < 1e-8 * shell.stiffness.youngs_modulus * 0.02
