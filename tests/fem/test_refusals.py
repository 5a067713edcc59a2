"""Solutions that are not to be trusted are errors that tell by how much and what to do."""

import pytest
from petsc4py import PETSc

from nanorom.bench import exact
from nanorom.errors import SolverError
from nanorom.workflow import reduce

ROUGH = {"degree": 4, "mesh_size": exact.RADIUS / 2}


@pytest.fixture
def option():
    """A function that sets a PETSc option for the test."""
    options, names = PETSc.Options(), []

    def put(name, value):
        names.append(name)
        options[name] = value

    yield put
    for name in names:
        options.delValue(name)


def test_eigenvalues_that_do_not_converge_are_an_error(option):
    option("nanorom_modes_eps_max_it", 1)
    option("nanorom_modes_eps_ncv", 8)
    with pytest.raises(SolverError, match=r"only \d of \d+ modes converged in 1 iterations; ref"):
        reduce(exact.drum(100.0, 6).scene.with_(**ROUGH))


def test_static_load_cases_that_do_not_converge_are_an_error(option):
    option("nanorom_step_snes_max_it", 0)
    with pytest.raises(SolverError, match=r"did not converge: SNES reason -\d at residual .*mesh"):
        reduce(exact.drum(100.0, 2).scene.with_(method="step", **ROUGH))
