"""What an installation lacks is told in one line with the remedy."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import cffi
import pytest

from nanorom.errors import NanoromError
from nanorom.fem.mesh import gmsh, vetting
from nanorom.fem.solvers import compiler

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


ZIG = """
import os, subprocess, sys
assert sys.argv[1] == "cc"
sys.exit(subprocess.run(["/usr/bin/gcc", *sys.argv[2:]], env={"PATH": "/usr/bin"}).returncode)
"""


@pytest.mark.skipif(not Path("/usr/bin/gcc").exists(), reason="what stands for Zig's compiler")
def test_compiler_of_the_index_is_found_where_there_is_no_other(tmp_path, drum_toml):
    """A package that calls itself ziglang compiles all forms; no other compiler is on the path."""
    (tmp_path / "modules" / "ziglang").mkdir(parents=True)
    (tmp_path / "modules" / "ziglang" / "__main__.py").write_text(ZIG)
    programs = tmp_path / "programs"  # all but compilers
    programs.mkdir()
    for program in Path("/usr/bin").iterdir():
        if not re.search(r"cc\b|clang", program.name):
            (programs / program.name).symlink_to(program)
    own = {"PATH": str(programs), "PYTHONPATH": str(tmp_path / "modules")}
    done = reduced(tmp_path, drum_toml, **own, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "cache").rglob("libffcx_*.so"))


def test_forms_need_none_of_pythons_own_headers(tmp_path):
    """A module as cffi makes them of forms, compiled with the package's declarations alone."""
    builder = cffi.FFI()
    builder.cdef("typedef struct { int rank; double (*tabulate)(double); } form; extern form one;")
    builder.set_source(
        "of_forms",
        "typedef struct { int rank; double (*tabulate)(double); } form;\n"
        "static double twice(double x) { return 2 * x; }\n"
        "form one = {3, twice};\n",
    )
    builder.emit_c_code(str(tmp_path / "of_forms.c"))
    command = [shutil.which("cc") or "gcc", "-shared", "-fPIC", "-Wall", "-Werror"]
    command += ["-I", str(compiler.HEADERS), "of_forms.c", "-o", "of_forms.abi3.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    spec = importlib.util.spec_from_file_location("of_forms", tmp_path / "of_forms.abi3.so")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.lib.one.rank == 3
    assert module.lib.one.tabulate(1.5) == 3.0


def test_libraries_that_gmsh_lacks_are_told(tmp_path, drum_toml, without_gmsh):
    file = gmsh.MESHES / "ellipse.geo"
    scene = drum_toml.replace('shape = "disc"', f'shape = "mesh"\nfile = "{file}"')
    scene = scene.replace("radius = ", "scale = ")
    done = reduced(tmp_path, scene, PYTHONPATH=without_gmsh)
    assert done.returncode == 1
    assert done.stderr.startswith(f"nanorom: error: gmsh cannot be loaded ({LOST})")
    assert done.stderr.count("\n") == 1


def test_mesh_is_not_called_damaged_where_gmsh_cannot_read_any(tmp_path, monkeypatch, without_gmsh):
    mesh = tmp_path / "film.msh"
    mesh.write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")
    monkeypatch.setenv("PYTHONPATH", without_gmsh)
    with pytest.raises(NanoromError, match="gmsh cannot be loaded"):
        vetting.check(mesh)
