"""What an installation lacks is told in one line with the remedy."""

import os
import subprocess
import sys

import pytest

from nanorom.errors import NanoromError
from nanorom.fem.mesh import vetting

LOST = "libGLU.so.1: cannot open shared object file: No such file or directory"


def reduced(tmp_path, scene: str, **environment: str) -> subprocess.CompletedProcess:
    (tmp_path / "scene.toml").write_text(scene)
    command = [sys.executable, "-m", "nanorom", "reduce", "scene.toml", "-o", "rom.h5"]
    own = {**os.environ, **environment}
    return subprocess.run(command, cwd=tmp_path, env=own, capture_output=True, text=True)


@pytest.fixture
def without_gmsh(tmp_path):
    """A folder whose gmsh fails as that of the Python index does without its libraries."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "gmsh.py").write_text(f"raise OSError({LOST!r})\n")
    return str(folder)


def test_missing_c_compiler_is_told(tmp_path, drum_toml):
    cache = str(tmp_path / "cache")  # of compiled forms: an empty one
    done = reduced(tmp_path, drum_toml, CC="/nowhere/cc", XDG_CACHE_HOME=cache)
    assert done.returncode == 1
    assert done.stderr.startswith("nanorom: error: the forms of DOLFINx cannot be compiled")
    assert "install gcc" in done.stderr and done.stderr.count("\n") == 1


def test_libraries_that_gmsh_lacks_are_told(tmp_path, drum_toml, without_gmsh):
    done = reduced(tmp_path, drum_toml, PYTHONPATH=without_gmsh)
    assert done.returncode == 1
    assert done.stderr.startswith(f"nanorom: error: gmsh cannot be loaded ({LOST})")
    assert done.stderr.count("\n") == 1


def test_mesh_is_not_called_damaged_where_gmsh_cannot_read_any(tmp_path, monkeypatch, without_gmsh):
    mesh = tmp_path / "film.msh"
    mesh.write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")
    monkeypatch.setenv("PYTHONPATH", without_gmsh)
    with pytest.raises(NanoromError, match="gmsh cannot be loaded"):
        vetting.check(mesh)
