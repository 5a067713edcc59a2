"""The package as users install it: an entry point, and a wheel that holds all that is needed."""

import importlib
import importlib.metadata
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from nanorom.report.viewer.pack import Pack
from nanorom.report.viewer.page import Page

REPOSITORY = Path(__file__).resolve().parents[2]
PARTS = ["nanorom", "meshes", "pyproject.toml", "setup.cfg", "README.md", "LICENSE"]

PROBE = """
import importlib.resources, json, nanorom
from nanorom.report.viewer.page import Pack, Page
root = importlib.resources.files("nanorom")
print(json.dumps({
    "location": nanorom.__file__,
    "meshes": {
        f.name: f.read_text() for f in (root / "meshes").iterdir() if f.name.endswith(".geo")
    },
    "typed": (root / "py.typed").is_file(),
    "fmu": (root / "export/fmu/modal.c").is_file(),
    "page": len(Page("title", "lead", Pack()).html()),
}))
"""


def geometry_files() -> dict[str, str]:
    return {file.name: file.read_text() for file in (REPOSITORY / "meshes").glob("*.geo")}


def probe(python: Path, cwd: Path) -> dict:
    """What an interpreter finds of nanorom when nothing of the checkout is on its path."""
    command = [str(python), "-I", "-c", PROBE]
    return json.loads(subprocess.run(command, cwd=cwd, check=True, capture_output=True).stdout)


@pytest.fixture(scope="module")
def wheel_environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with nanorom installed from a wheel built of a copy of the sources."""
    base = tmp_path_factory.mktemp("wheel")
    source, environment = base / "source", base / "environment"
    source.mkdir()
    for part in PARTS:
        if (REPOSITORY / part).is_dir():
            shutil.copytree(REPOSITORY / part, source / part, symlinks=True)
        else:
            shutil.copy(REPOSITORY / part, source / part)
    pip = ["-m", "pip", "--quiet"]
    offline = ["--no-index", "--no-deps"]
    wheel = ["wheel", *offline, "--no-build-isolation", "-w", str(base), "./source"]
    subprocess.run([sys.executable, *pip, *wheel], cwd=base, check=True)
    venv = ["-m", "venv", "--system-site-packages", "--without-pip", str(environment)]
    subprocess.run(["/usr/bin/python3", *venv], check=True)
    install = ["install", *offline, *map(str, base.glob("nanorom-*.whl"))]
    subprocess.run([environment / "bin/python", *pip, *install], cwd=base, check=True)
    return environment


def test_wheel_holds_every_geometry_file(wheel_environment: Path) -> None:
    found = probe(wheel_environment / "bin/python", wheel_environment)
    assert found["location"].startswith(str(wheel_environment))
    assert found["typed"]
    assert found["meshes"] == geometry_files() != {}


def test_wheel_holds_what_pages_and_units_are_made_of(wheel_environment: Path) -> None:
    found = probe(wheel_environment / "bin/python", wheel_environment)
    assert found["fmu"]
    assert found["page"] == len(Page("title", "lead", Pack()).html()) > 200_000


def test_every_dependency_is_here_in_a_version_asked_for() -> None:
    requirements = map(Requirement, importlib.metadata.requires("nanorom") or [])
    needed = [item for item in requirements if item.marker is None]
    assert {item.name for item in needed} >= {"numpy", "scipy", "h5py"}
    for item in needed:
        # the modules are asked, not the metadata: Debian 12 files h5py's under another name
        version = importlib.import_module(item.name.replace("attrs", "attr")).__version__
        assert version in item.specifier, item.name


def test_image_gets_all_that_the_package_is_made_of() -> None:
    let_through = (REPOSITORY / ".dockerignore").read_text(encoding="utf-8").split()
    assert {f"!{part}" for part in PARTS} <= set(let_through)


def test_wheel_names_its_licence(wheel_environment: Path) -> None:
    """As an SPDX expression where setuptools knows of it (77), otherwise as a text."""
    (metadata,) = wheel_environment.glob("lib/python3*/site-packages/nanorom-*.dist-info/METADATA")
    lines = metadata.read_text(encoding="utf-8").splitlines()
    wanted = {"License-Expression: MIT", "License: MIT"}
    assert wanted & set(lines) and "License-File: LICENSE" in lines


def test_wheel_installs_the_command(wheel_environment: Path) -> None:
    command = [wheel_environment / "bin/nanorom", "--help"]
    done = subprocess.run(command, cwd=wheel_environment, check=True, capture_output=True)
    assert b"reduce" in done.stdout


def test_checkout_finds_every_geometry_file(tmp_path: Path) -> None:
    found = probe(Path(sys.executable), tmp_path)
    assert found["location"] == str(REPOSITORY / "nanorom/__init__.py")
    assert found["meshes"] == geometry_files() != {}


def test_entry_point_is_the_command_line() -> None:
    (entry,) = importlib.metadata.entry_points(group="console_scripts", name="nanorom")
    assert entry.value == "nanorom.cli.main:main"
    assert callable(entry.load())


def test_numpy_and_petsc_run_on_openblas() -> None:
    """The reference BLAS, which Debian installs unless told otherwise, is two times slower."""
    code = (
        "import numpy, petsc4py; petsc4py.init([]); from petsc4py import PETSc\n"
        "numpy.linalg.eigvalsh(numpy.eye(3)); print(open('/proc/self/maps').read())"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    files = set(re.findall(r"/\S*(?:blas|/liblapack)[^/\s]*\.so\S*", done.stdout))
    assert files and all("openblas" in file for file in files), files
