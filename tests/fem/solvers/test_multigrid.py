"""Iterations with multigrid give what factors give, tell how well, and refuse to guess."""

import attrs
import numpy as np
import pytest

from nanorom.errors import SolverError
from nanorom.fem.modes import eigen
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.solvers import multigrid, patches
from nanorom.fem.tensors import direct
from nanorom.scene.film import Plate
from nanorom.scene.load import Load
from nanorom.scene.scene import Accuracy, Reduction
from tests.fem.exact import RADIUS, drum, paper_drum

SAME = 1e-9  # of the largest entry: shapes settle to 1e-10
FEW_CELLS = Accuracy(degree=4, mesh_size=RADIUS / 4)
MEMBRANE = attrs.evolve(paper_drum(3), accuracy=FEW_CELLS, plate=Plate("10 nm", "membrane"))
MOST_CYCLES = 14  # to an error of 1e-6; a factor of 0.37 a cycle
CRITICAL = -14.68  # T R^2/D at which a clamped disc buckles


def with_solver(scene, solver, method="direct"):
    return attrs.evolve(scene, reduction=Reduction(method=method, solver=solver))


@pytest.mark.parametrize(
    ("scene", "method"),
    [
        (attrs.evolve(paper_drum(6), accuracy=FEW_CELLS), "direct"),
        (drum(100.0, count=3, accuracy=FEW_CELLS), "step"),
        (MEMBRANE, "direct"),
        (drum(100.0, count=2, accuracy=FEW_CELLS, load=Load(pressure="2 kPa")), "direct"),
    ],
    ids=["paper", "step", "membrane", "static load"],
)
def test_multigrid_gives_what_factors_give(scene, method):
    found = reduce_scene(with_solver(scene, "multigrid", method))
    expected = reduce_scene(with_solver(scene, "factors", method))
    np.testing.assert_allclose(found.frequency, expected.frequency, rtol=SAME)
    for name in ("quadratic", "cubic", "stiffness"):
        tensor = getattr(expected, name)
        largest = np.abs(tensor).max()
        np.testing.assert_allclose(getattr(found, name), tensor, rtol=0, atol=SAME * largest)
    assert 0 < found.diagnostics["solver_residual"] < direct.SOLVED
    assert found.diagnostics["solver_iterations"] > 1
    assert "solver_residual" not in expected.diagnostics


def test_iterations_grow_neither_with_the_mesh_nor_with_the_degree():
    found = []
    for degree, size in ((4, RADIUS / 3), (4, RADIUS / 12), (8, RADIUS / 3)):
        accuracy = Accuracy(degree=degree, mesh_size=size)
        scene = drum(100.0, count=2, accuracy=accuracy)
        found.append(reduce_scene(with_solver(scene, "multigrid")).diagnostics["solver_iterations"])
    assert max(found) <= MOST_CYCLES


def test_size_decides(monkeypatch):
    scene = drum(100.0, count=2, accuracy=FEW_CELLS)
    assert "solver_residual" not in reduce_scene(scene).diagnostics
    monkeypatch.setattr(multigrid, "LARGEST_FACTORS", 100)
    assert "solver_residual" in reduce_scene(scene).diagnostics


def test_what_the_smoother_misses_is_an_error(monkeypatch):
    whole = patches.VertexPatches.__call__

    def holed(self, residuals):
        return whole(self, residuals) * (np.arange(len(residuals)) % 3 > 0)[:, None]

    monkeypatch.setattr(patches.VertexPatches, "__call__", holed)
    with pytest.raises(SolverError, match=r"multigrid"):
        reduce_scene(with_solver(drum(100.0, count=2, accuracy=FEW_CELLS), "multigrid"))


def test_unfinished_iterations_are_errors(monkeypatch):
    scene = with_solver(drum(100.0, count=2, accuracy=FEW_CELLS), "multigrid")
    monkeypatch.setattr(multigrid, "MOST_ITERATIONS", 3)
    with pytest.raises(SolverError, match=r"in-plane stiffness .* error of \d.* in 3 iter"):
        reduce_scene(scene)
    monkeypatch.setattr(eigen, "MOST_STEPS", 1)
    monkeypatch.setattr(eigen, "MOST_ROUNDS", 2)
    with pytest.raises(SolverError, match=r"still changed by \d.* after 2 rounds"):
        reduce_scene(scene)


def test_buckled_film_is_refused():
    scene = drum(1.5 * CRITICAL, count=2, accuracy=FEW_CELLS)
    with pytest.raises(SolverError, match="buckl"):
        reduce_scene(with_solver(scene, "multigrid"))
