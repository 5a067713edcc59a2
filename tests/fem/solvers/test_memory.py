"""What memory may be taken: the limits of queues and containers bind, not the machine alone."""

import pytest

from nanorom.fem.solvers import groups

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
