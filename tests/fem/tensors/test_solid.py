"""Condensed coefficients of solids: those of STEP with imposed modes, and of beams."""

import numpy as np
import pytest
from mpi4py import MPI

from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Grid
from nanorom.fem.mesh.volumes import Thick
from nanorom.fem.models.solid import Solid
from nanorom.fem.modes import solid as solids
from nanorom.fem.tensors.solid import condensed, stiffening
from nanorom.fem.tensors.solid_cases import SolidCases
from nanorom.fem.tensors.step import step

STEP_AGREES = 1e-8  # of the largest entry, by its force at the thickness
POTENTIAL = 1e-8


def bent(x, rise):
    """Points of a block raised to an arch."""
    lifted = x.copy()
    lifted[:, 2] += rise * (1 - 4 * x[:, 0] ** 2)
    return lifted


def arch(seed, degree=2):
    """A skew arch of random measures, held at both ends."""
    numbers = np.random.default_rng(seed)
    height, width, rise = numbers.uniform((0.03, 0.08, -0.1), (0.06, 0.15, 0.1))
    source = Thick(Grid(tuple(np.linspace(-0.5, 0.5, 7)), (-width / 2, width / 2)), height, 1)
    data = source.mesh(1)
    data.points[:] = bent(data.points, rise)
    domain = mesh.distribute(MPI.COMM_SELF, data)
    stress = (*numbers.uniform(0, 2e-3, 1), 0.0, 0.0)
    return Solid.on(domain, degree, numbers.uniform(0, 0.4), ["left", "right"], stress), height


@pytest.mark.parametrize("seed", range(4))
def test_condensation_and_step_with_imposed_modes_give_one_tensor(seed):
    solid, height = arch(seed)
    modes = solids.solve(solid, 2).take(np.arange(2))
    found = condensed(modes)
    by_step = step(SolidCases(modes), 0.05 * height, extrapolate=True)
    assert by_step.asymmetry < POTENTIAL and found.asymmetry < POTENTIAL
    scale = max(np.abs(found.cubic).max(), np.abs(found.quadratic).max() / height)
    assert np.abs(by_step.cubic - found.cubic).max() < STEP_AGREES * scale
    assert np.abs(by_step.quadratic - found.quadratic).max() < STEP_AGREES * scale * height


def test_the_cubic_tensor_has_every_symmetry():
    solid, _ = arch(7)
    found = condensed(solids.solve(solid, 3).take(np.arange(3)))
    for axes in ((1, 0, 2, 3), (0, 2, 1, 3), (3, 1, 2, 0)):
        assert (
            np.abs(found.cubic - found.cubic.transpose(axes)).max()
            < 1e-12 * np.abs(found.cubic).max()
        )


def test_modes_inside_do_not_answer_themselves():
    """With a second mode inside, what it took statically is the quadratic coefficient's."""
    solid, _ = arch(2)
    modes = solids.solve(solid, 4)
    alone, both = (condensed(modes.take(np.arange(n))) for n in (1, 4))
    k = np.diag(both.stiffness)
    given_way = sum(2 * both.quadratic[i, 0, 0] ** 2 / k[i] for i in range(1, 4))
    expected = both.cubic[0, 0, 0, 0] - given_way
    assert alone.cubic[0, 0, 0, 0] == pytest.approx(expected, rel=1e-7)


def test_a_further_stress_relaxes_as_heat_lets_it():
    """A solid warmed as a whole grows in every direction but for its ends: an independent state.

    Without Poisson's ratio a bar between held ends keeps the axial stress alone.
    """
    lines = tuple(np.linspace(-0.5, 0.5, 7)), (-0.04, 0.04)
    domain = mesh.build(MPI.COMM_SELF, Thick(Grid(*lines), 0.05, 1), 1)
    modes = solids.solve(Solid.on(domain, 3, 0.0, ["left", "right"]), 2).take(np.arange(2))
    axial = modes.solid.slopes(modes.shapes, [0])
    found = stiffening(modes, (1.0, 1.0, 1.0))
    # transverse strains of -1 by the modulus change the bending stiffness beside that
    held = stiffening(modes, (1.0, 0.0, 0.0))
    assert held == pytest.approx(axial, abs=1e-9 * np.abs(axial).max())
    assert np.diag(found) == pytest.approx(np.diag(axial), rel=0.05)


@pytest.mark.parametrize("seed", range(2))
def test_stiffening_is_the_derivative_of_eigenvalues_about_the_relaxed_state(seed):
    """By Newton's method in the stress, all modes outside: k changes by the full tangent."""
    solid, _ = arch(seed)
    modes = solids.solve(solid, 1).take(np.arange(1))
    stress, small = (0.3, -0.2, 0.1), 1e-6
    found = stiffening(modes, stress)[0, 0]
    pull, phi = small * solid.pull(stress)[:, None], modes.shapes
    borne = np.array(solid.stress) + small * np.array(stress)
    about = Solid(
        solid.domain, solid.degree, solid.poisson_ratio, tuple(borne), solid.space, solid.free
    )
    cases = SolidCases(modes)
    reaction = cases._pull @ np.linalg.solve(cases.linear, modes.products(pull))
    state = -cases._factors.solve(pull - reaction)
    for _ in range(4):  # equilibrium of all that lies outside the mode
        force = about.force(state) + pull
        rest = force - cases._pull @ np.linalg.solve(cases.linear, modes.products(force))
        state = state - cases._factors.solve(rest)
    tangent = about.linear(phi) + 2 * about.quadratic(state, phi)
    tangent += 3 * about.cubic(state, state, phi)
    changed = (phi.T @ tangent)[0, 0] - cases.linear[0, 0]
    assert changed / small == pytest.approx(found, rel=1e-4)
