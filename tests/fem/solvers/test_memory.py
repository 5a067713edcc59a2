"""What memory may be taken: the limits of queues and containers bind, not the machine alone."""

import pytest
from mpi4py import MPI

from nanorom.errors import AccuracyWarning, SolverError
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.routes import plate as route
from nanorom.fem.solvers import groups
from tests.fem.routes.test_sides import CCCF, film

GIGABYTE = 1_000_000_000


def written(folder, limit, used, names=("memory.max", "memory.current")):
    folder.mkdir(parents=True)
    for name, value in zip(names, (limit, used)):
        (folder / name).write_text(f"{value}\n")


@pytest.mark.parametrize(
    ("job", "step", "left"),
    [
        ((8 * GIGABYTE, GIGABYTE), ("max", GIGABYTE), 7 * GIGABYTE),
        ((8 * GIGABYTE, 2 * GIGABYTE), (3 * GIGABYTE, GIGABYTE), 2 * GIGABYTE),
        (("max", GIGABYTE), ("max", GIGABYTE), float("inf")),
        ((GIGABYTE, 2 * GIGABYTE), ("max", GIGABYTE), 0.0),
    ],
)
def test_the_narrowest_limit_above_a_process_binds(tmp_path, job, step, left):
    written(tmp_path / "root" / "job", *job)
    written(tmp_path / "root" / "job" / "step", *step)
    own = tmp_path / "own"
    own.write_text("0::/job/step\n")
    assert groups.left_by_limits(own, tmp_path / "root") == left


def test_limits_of_the_first_version_are_read(tmp_path):
    names = "memory.limit_in_bytes", "memory.usage_in_bytes"
    written(tmp_path / "memory" / "job", 4 * GIGABYTE, GIGABYTE, names)
    own = tmp_path / "own"
    own.write_text("5:cpu,cpuacct:/other\n4:memory:/job\n")
    assert groups.left_by_limits(own, tmp_path) == 3 * GIGABYTE


def test_a_machine_without_limits_leaves_everything(tmp_path):
    assert groups.left_by_limits(tmp_path / "none", tmp_path) == float("inf")


def test_a_mesh_that_fills_the_memory_is_told_and_the_best_before_it_kept(monkeypatch):
    """There is none left for the second."""
    scene, solve = film("cccf", 0.8, tolerance=1e-3, count=1), route.solve

    def rough(*given):
        solution = solve(*given)
        solution.diagnostics["error_tensor"] = 2e-3
        return solution

    left = iter([1e12, 1e6])
    monkeypatch.setattr(groups, "memory", lambda comm: next(left))
    monkeypatch.setattr(groups, "LITTLE", 0.0)
    monkeypatch.setattr(route, "solve", rough)
    with pytest.warns(AccuracyWarning, match="GB of memory are left"):
        model = reduce_scene(scene)
    assert model.frequency == pytest.approx(CCCF[:1], rel=1e-3)


def test_memory_that_is_not_known_binds_nothing(monkeypatch):
    monkeypatch.setattr(groups, "memory", lambda comm: 0.0)
    groups.check_fits(10**9, MPI.COMM_SELF)
    monkeypatch.setattr(groups, "memory", lambda comm: 1e9)
    with pytest.raises(SolverError, match="ask for a larger tolerance"):
        groups.check_fits(10**9, MPI.COMM_SELF)
