"""Solutions that are not to be trusted are errors that tell by how much and what to do."""

import numpy as np
import pytest
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.exact import cases
from nanorom.fem.tensors.cases import load_cases
from nanorom.fem.tensors.inplane import InPlane
from nanorom.fem.tensors.step import check_potential, coefficients, symmetric
from nanorom.workflow import reduce

ROUGH = {"degree": 4, "mesh_size": cases.RADIUS / 2}


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
        reduce(cases.drum(100.0, 6).scene.with_(**ROUGH))


def test_static_load_cases_that_do_not_converge_are_an_error(option):
    option("nanorom_step_snes_max_it", 0)
    with pytest.raises(SolverError, match=r"did not converge: SNES reason -\d at residual .*mesh"):
        reduce(cases.drum(100.0, 2).scene.with_(method="step", **ROUGH))


def test_forces_without_a_potential_are_an_error():
    """Random cubic forces, whose work depends on the path."""
    random = np.random.default_rng(1)
    cubic = random.standard_normal((2, 2, 2, 2))

    def forces(part):
        q = {case: np.array([sum(s for m, s in case if m == j) for j in (0, 1)], float)
             for case in load_cases(2)}  # fmt: skip
        return {case: np.einsum("rjkl,j,k,l->r", part, x, x, x) for case, x in q.items()}

    def result(part):
        return symmetric(*coefficients(forces(part), 2, 1.0), 1.0, 7, InPlane())

    with pytest.raises(SolverError, match=r"potential by \d\.\de[+-]\d\d .*reduction.amplitude"):
        check_potential(result(cubic))
    axes = [(0, 1, 2, 3), (1, 0, 2, 3), (2, 1, 0, 3), (3, 1, 2, 0)]
    inner = sum(cubic.transpose(0, *p) for p in [(1, 2, 3), (1, 3, 2), (2, 1, 3), (2, 3, 1),
                                                 (3, 1, 2), (3, 2, 1)])  # fmt: skip
    check_potential(result(sum(inner.transpose(a) for a in axes)))


def test_a_mesh_that_does_not_see_the_edge_layer_is_an_error():
    scene = cases.drum(5e4, 3).scene
    with pytest.raises(SolverError, match=r"edge layer .* wrong by up to \d\.\de-03; make the ce"):
        reduce(scene.with_(degree=4, mesh_size=0.3 * cases.RADIUS))


@pytest.mark.parametrize("degree", [4, 8])
def test_the_estimate_counts_a_layer_that_the_mesh_does_not_see(degree):
    case = cases.drum(1e8, 1)
    model = reduce(case.scene.with_(degree=degree, mesh_size=0.4 * cases.RADIUS))
    error = abs(model.frequency[0] / case.frequency()[0] - 1)
    assert 0.5 * error < model.diagnostics["error_frequency"] < 3 * error
