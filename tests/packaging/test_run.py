"""`./run` on a copy of the checkout, with commands in its way that would show any use of apt."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGES = REPOSITORY / "docker/packages.txt"
TESTS = "docker/packages-tests.txt"
TOOLS = ["cat", "cmp", "dirname", "flock", "grep", "readlink", "rm", "sed", "sh", "tr", "xargs"]
FORBIDDEN = ["apt-get", "dpkg", "sudo", "pip", "pip3"]
WHERE = ["python", "-c", "import nanorom, sys; print(nanorom.__file__, sys.prefix, sep='\\n')"]


def executable(path: Path, text: str) -> None:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def forbidding(tmp_path: Path) -> dict[str, str]:
    """An environment in which set-up that asks for more than Python fails."""
    folder = tmp_path / "forbidding"
    folder.mkdir()
    for name in FORBIDDEN:
        executable(folder / name, f"echo forbidden: {name} >&2; exit 9")
    return {**os.environ, "PATH": f"{folder}:/usr/bin:/bin"}


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """A folder of commands, to be the whole PATH, of a machine that has no Debian packages."""
    folder = tmp_path / "bare"
    folder.mkdir()
    for name in TOOLS:
        found = shutil.which(name)
        assert found, name
        (folder / name).symlink_to(found)
    executable(folder / "id", "echo 1000")
    return folder


def copy_checkout(place: Path) -> Path:
    """A checkout whose path has a space, with its own environment still to be made."""
    copy = place / "a checkout"
    (copy / "docker").mkdir(parents=True)
    for name in ["run", "pyproject.toml", "setup.cfg", "README.md", "docker/packages.txt", TESTS]:
        shutil.copy(REPOSITORY / name, copy / name)
    for name in ["nanorom", "meshes"]:
        shutil.copytree(REPOSITORY / name, copy / name, symlinks=True)
    return copy


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    return copy_checkout(tmp_path)


def run(
    checkout: Path, *arguments: str, env: dict[str, str], cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(checkout / "run"), *arguments],
        env=env,
        cwd=cwd or checkout,
        capture_output=True,
        text=True,
        timeout=120,
    )


def environment_state(checkout: Path) -> dict[str, int]:
    venv = checkout / ".venv"
    return {str(path): path.lstat().st_mtime_ns for path in [venv, *venv.rglob("*")]}


def test_set_up_happens_once(checkout: Path, forbidding: dict[str, str], tmp_path: Path) -> None:
    expected = [str(checkout / "nanorom/__init__.py"), str(checkout / ".venv")]
    first = run(checkout, *WHERE, env=forbidding, cwd=tmp_path)
    assert (first.returncode, first.stdout.splitlines()) == (0, expected), first.stderr
    made = environment_state(checkout)
    second = run(checkout, *WHERE, env=forbidding, cwd=tmp_path)
    assert (second.returncode, second.stdout.splitlines()) == (0, expected)
    assert second.stderr == ""
    assert environment_state(checkout) == made


def test_moved_or_interrupted_set_up_is_done_again(
    checkout: Path, forbidding: dict[str, str], tmp_path: Path
) -> None:
    (checkout / ".venv/bin").mkdir(parents=True)  # as an interruption leaves it: no stamp
    assert run(checkout, "nanorom", "--help", env=forbidding).returncode == 0
    moved = checkout.rename(tmp_path / "moved")
    done = run(moved, *WHERE, env=forbidding)
    assert done.stdout.splitlines() == [str(moved / "nanorom/__init__.py"), str(moved / ".venv")]


def test_command_keeps_its_directory_arguments_and_status(
    forbidding: dict[str, str], tmp_path: Path
) -> None:
    script = 'pwd; printf "<%s>" "$@"; exit 7'
    arguments = ["sh", "-c", script, "sh", "a b", "", "*"]
    done = run(REPOSITORY, *arguments, env=forbidding, cwd=tmp_path)
    assert done.returncode == 7
    assert done.stdout == f"{tmp_path}\n<a b><><*>"


def test_other_python_settings_do_not_leak_in(forbidding: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "numpy.py").write_text("raise ImportError('the wrong numpy')")
    env = {**forbidding, "PYTHONPATH": str(tmp_path), "PETSC_DIR": "/nonexistent"}
    script = "import numpy; from petsc4py import PETSc"
    done = run(REPOSITORY, "python", "-c", script, env=env)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("has_apt", "cause"), [(False, "not Debian or Ubuntu"), (True, "neither root nor sudo")]
)
def test_machine_without_the_packages_is_told_which(
    checkout: Path, bare: Path, has_apt: bool, cause: str
) -> None:
    if has_apt:
        executable(bare / "apt-get", "echo forbidden: apt-get >&2; exit 9")
    done = run(checkout, "nanorom", "--help", env={"PATH": str(bare)})
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert cause in done.stderr and "docker build" in done.stderr
    wanted = [name for name in PACKAGES.read_text().splitlines() if name and name[0] != "#"]
    assert all(name in done.stderr for name in wanted)
    assert not (checkout / ".venv").exists()


def test_no_verb_prints_usage_and_sets_nothing_up(
    checkout: Path, forbidding: dict[str, str]
) -> None:
    done = run(checkout, env=forbidding)
    assert done.returncode == 0
    assert "./run demo" in done.stdout
    assert not (checkout / ".venv").exists()


def test_tools_of_the_tests_are_asked_for_by_the_tests_alone(checkout: Path, bare: Path) -> None:
    tools = (REPOSITORY / TESTS).read_text().split("\n\n")[1].split()
    assert "mypy" in tools and "python3-pytest" in tools
    test, demo = (run(checkout, verb, env={"PATH": str(bare)}).stderr for verb in ("test", "demo"))
    assert set(tools) <= set(test.split())
    assert not set(tools) & set(demo.split())


def test_package_list_names_openblas() -> None:
    assert "libopenblas0-pthread" in PACKAGES.read_text().splitlines()
