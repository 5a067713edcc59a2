"""The unit of FMI has the modal equations, and runs in a program of others."""

import ctypes
import shutil
import xml.etree.ElementTree as ElementTree
import zipfile

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import ModalSystem
from nanorom.export.export import export

SIZE = 3
ROUND_OFF = 1e-12
INTEGRATED = 1e-4  # relative, of a program that integrates to 1e-10 a step
needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")


def system(seed, quadratic=True):
    """A film of nanometres and megahertz, with random coefficients."""
    rng = np.random.default_rng(seed)
    stiffness = np.diag(rng.uniform(1, 5, SIZE))
    coupled = rng.normal(size=(SIZE, SIZE))
    return ModalSystem(
        mass=np.full(SIZE, 1e-16),
        damping=1e-11 * (np.eye(SIZE) + 0.1 * (coupled + coupled.T)),
        stiffness=stiffness,
        quadratic=rng.normal(size=(SIZE,) * 3) * 1e7 * quadratic,
        cubic=rng.normal(size=(SIZE,) * 4) * 1e15,
        direct=rng.normal(size=SIZE) * 1e-11,
        parametric=rng.normal(size=(SIZE, SIZE)),
        cubic_damping=rng.normal(size=(SIZE,) * 4) * 1e5,
    )


def acceleration(given, q, v, direct, parametric):
    """From the arrays themselves: M q'' + C v + K q + A qq + B qqq + D vqq = J d + P q p."""
    force = direct * given.direct + parametric * given.parametric @ q
    force = force - given.damping @ v - given.stiffness @ q
    force = force - np.einsum("rjk,j,k", given.quadratic, q, q)
    force = force - np.einsum("rjkl,j,k,l", given.cubic, q, q, q)
    # D[r, j, k, l] q_l d(q_j q_k)/dt
    product = np.einsum("j,k->jk", v, q) + np.einsum("j,k->jk", q, v)
    force = force - np.einsum("rjkl,jk,l", given.cubic_damping, product, q)
    return np.linalg.solve(given.mass, force)


@needs_compiler
@pytest.mark.parametrize("seed", range(3))
def test_compiled_unit_has_the_equations_of_the_arrays(tmp_path, seed):
    given = system(seed, quadratic=seed > 0)
    path = export(given, "fmu", tmp_path / "modal.fmu")
    with zipfile.ZipFile(path) as file:
        file.extractall(tmp_path)
        identity = ElementTree.fromstring(file.read("modelDescription.xml")).get("guid")
    library = ctypes.CDLL(str(tmp_path / "binaries/linux64/modal.so"))
    library.fmi2Instantiate.restype = ctypes.c_void_p
    make = library.fmi2Instantiate
    assert make(b"one", 0, b"{another}", b"", None, 0, 0) is None
    one = ctypes.c_void_p(make(b"one", 0, identity.encode(), b"", None, 0, 0))
    doubles, size = ctypes.c_double * (2 * SIZE), ctypes.c_size_t
    rng = np.random.default_rng(seed + 10)
    for _ in range(5):
        q, v = rng.normal(size=SIZE) * 3e-8, rng.normal(size=SIZE) * 3
        inputs = rng.normal(size=2) * (100, 0.1)
        references = (ctypes.c_uint * 2)(0, 1)
        assert library.fmi2SetReal(one, references, size(2), (ctypes.c_double * 2)(*inputs)) == 0
        assert library.fmi2SetContinuousStates(one, doubles(*q, *v), size(2 * SIZE)) == 0
        found = doubles()
        assert library.fmi2GetDerivatives(one, found, size(2 * SIZE)) == 0
        expected = np.concatenate([v, acceleration(given, q, v, *inputs)])
        scale = np.repeat([np.abs(v).max(), np.abs(expected[SIZE:]).max()], SIZE)
        assert np.abs((np.array(found) - expected) / scale).max() < ROUND_OFF
    library.fmi2FreeInstance(one)


def test_description_names_states_their_derivatives_and_units(tmp_path):
    path = export(system(0), "fmu", tmp_path / "modal.fmu")
    with zipfile.ZipFile(path) as file:
        assert {"sources/modal.c", "sources/modal.h"} <= set(file.namelist())
        root = ElementTree.fromstring(file.read("modelDescription.xml"))
    variables = root.findall("ModelVariables/ScalarVariable")
    names = [variable.get("name") for variable in variables]
    assert names[: 2 + SIZE] == ["direct", "parametric", "q1", "q2", "q3"]
    for unknown in root.findall("ModelStructure/Derivatives/Unknown"):
        variable = variables[int(unknown.get("index")) - 1]
        state = names[int(variable.find("Real").get("derivative")) - 1]
        assert variable.get("name") == f"der({state})"
    assert [v.find("Real").get("unit") for v in variables[2 : 2 + SIZE]] == ["m"] * SIZE


@needs_compiler
def test_fmpy_runs_the_unit_as_scipy_runs_the_arrays(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    given = system(5)
    path = export(given, "fmu", tmp_path / "modal.fmu")
    end = 2e-7
    times = np.linspace(0, end, 400)
    levels = {"direct": 20.0, "parametric": 0.05}  # switched on; programs hold inputs for a step

    def rate(t, x):
        motion = acceleration(given, x[:SIZE] * 1e-9, x[SIZE:], *levels.values())
        return np.concatenate([x[SIZE:] * 1e9, motion])

    expected = solve_ivp(rate, (0, end), np.zeros(2 * SIZE), "DOP853", times, rtol=1e-9, atol=1e-9)
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=end,
        output_interval=times[1],
        relative_tolerance=1e-10,
        start_values=levels,
        output=["q1", "q2", "q3"],
    )
    scale = 1e-9 * np.abs(expected.y[:SIZE]).max()
    for r in range(SIZE):
        own = np.interp(times, found["time"], found[f"q{r + 1}"])
        assert np.abs(own - 1e-9 * expected.y[r]).max() < INTEGRATED * scale


def test_without_a_compiler_the_unit_has_its_sources(tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name: None)
    with zipfile.ZipFile(export(system(0), "fmu", tmp_path / "modal.fmu")) as file:
        assert "sources/modal.c" in file.namelist()
        assert not [name for name in file.namelist() if name.startswith("binaries")]
