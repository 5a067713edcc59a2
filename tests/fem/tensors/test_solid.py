"""Condensed coefficients of solids: those of STEP with imposed modes, and of beams."""

import numpy as np
import pytest
from mpi4py import MPI

from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Grid
from nanorom.fem.mesh.volumes import Thick
from nanorom.fem.models.solid import Solid
from nanorom.fem.modes import solid as solids
from nanorom.fem.tensors.solid import condensed
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
