"""What is exported is what the model has, as the programs that it is for read it."""

import csv
import shutil
import subprocess
import warnings

import attrs
import h5py
import numpy as np
import pytest
from scipy.io import loadmat

from nanorom.cli.main import main
from nanorom.errors import FileError, ModelError
from nanorom.export.export import export, export_model, export_motion, export_response, orbit_of
from nanorom.export.polynomial import acceleration
from nanorom.results.respond import respond
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from tests.export.equations import LEVELS, SIZE, rate, system

ROUND_OFF = 1e-12
SINGLE = 1e-6  # of binary32, in which Poscidyn computes
DIFFERENCES = 1e-6  # of central differences with a step of 1e-5


def test_polynomial_is_the_acceleration_of_the_equations():
    scaled = system().scaled(**LEVELS)
    x = np.random.default_rng(1).normal(size=2 * SIZE)
    total = sum(terms(x) for terms in acceleration(scaled))
    expected = rate(scaled, 0.0, x, 0.0, 0.0, 0.0)[SIZE:]
    np.testing.assert_allclose(total, expected, rtol=ROUND_OFF)
    for terms in acceleration(scaled):  # each product of states once
        assert len(np.unique(terms.index, axis=0)) == len(terms.index)


OCTAVE = """
x = {x}; t = {t}; p = {p};
J = modal_dx(t, x, p); Jp = modal_dp(t, x, p); Jt = modal_dt(t, x, p);
dx = zeros(size(J)); dp = zeros(size(Jp));
e = 1e-5;
for i = 1:rows(x)
  step = zeros(rows(x), 1); step(i) = e;
  dx(:, i, :) = (modal(t, x + step, p) - modal(t, x - step, p)) / (2 * e);
end
for i = 1:3
  step = zeros(3, 1); step(i) = e;
  dp(:, i, :) = (modal(t, x, p + step) - modal(t, x, p - step)) / (2 * e);
end
dt = (modal(t + e, x, p) - modal(t - e, x, p)) / (2 * e);
c = cos(p(1, :) .* t); s = sin(p(1, :) .* t);
y = modal(t, x, p); z = modal_autonomous([x; s; c], p);
save('-v7', 'found.mat', 'y', 'z', 'J', 'Jp', 'Jt', 'dx', 'dp', 'dt');
"""


@pytest.mark.skipif(not shutil.which("octave-cli"), reason="Octave is not installed")
@pytest.mark.parametrize("quadratic", [True, False])
def test_matlab_functions_are_the_equations_and_their_derivatives(tmp_path, quadratic):
    given = system() if quadratic else system(quadratic=np.zeros((SIZE,) * 3))
    folder = export(given, "coco", tmp_path / "problem", **LEVELS)
    rng, count = np.random.default_rng(2), 4
    x, t = rng.normal(size=(2 * SIZE, count)), rng.normal(size=(1, count))
    p = rng.uniform(0.5, 1.5, size=(3, count))
    texts = {
        name: str(value.tolist()).replace("], [", "]; [")
        for name, value in {"x": x, "t": t, "p": p}.items()
    }
    program = OCTAVE.format(**texts)
    subprocess.run(["octave-cli", "--quiet", "--eval", program], cwd=folder, check=True, timeout=60)
    found = loadmat(folder / "found.mat")
    scaled = given.scaled(**LEVELS)
    y = np.stack([rate(scaled, t[0, k], x[:, k], *p[:, k]) for k in range(count)], axis=1)
    np.testing.assert_allclose(found["y"], y, rtol=ROUND_OFF, atol=ROUND_OFF)
    np.testing.assert_allclose(found["z"][: 2 * SIZE], y, rtol=ROUND_OFF, atol=ROUND_OFF)
    for derivative, difference in (("J", "dx"), ("Jp", "dp"), ("Jt", "dt")):
        scale = np.abs(found[difference]).max()
        assert np.abs(found[derivative] - found[difference]).max() <= DIFFERENCES * scale


FORCES = """
load model.mat; q = {}; v = {};
loss = zeros(rows(q), 1);
for k = 1:rows(q) for j = 1:rows(q) for l = 1:rows(q)
  loss += cubic_damping(:, k, j, l) * v(k) * q(j) * q(l);
end end end
force = C * v + K * q + coefficients.' * prod(q.' .^ exponents, 2) + loss;
r = load('response.mat');
fold = strcmp(r.special, 'LP');
place = r.frequency(fold); size_of = r.amplitude(fold, 1);
unit = r.unit_direct; names = numel(r.label);
save('-v7', 'found.mat', 'force', 'place', 'size_of', 'unit', 'names');
"""


@pytest.mark.skipif(not shutil.which("octave-cli"), reason="Octave is not installed")
def test_matlab_files_are_read_as_they_describe_themselves(tmp_path, response):
    given = system()
    export(given, "matlab", tmp_path / "model.mat")
    export_response(response, "matlab", tmp_path / "response.mat")
    q, v = np.random.default_rng(5).normal(size=(2, SIZE))
    columns = ("; ".join(map(repr, values.tolist())) for values in (q, v))
    program = FORCES.format(*(f"[{column}]" for column in columns))
    options = ["--quiet", "--eval", program]
    subprocess.run(["octave-cli", *options], cwd=tmp_path, check=True, timeout=60)
    found = loadmat(tmp_path / "found.mat", squeeze_me=True)
    expected = given.damping @ v + given.stiffness @ q
    expected = expected + np.einsum("rjk,j,k", given.quadratic, q, q)
    expected = expected + np.einsum("rjkl,j,k,l", given.cubic, q, q, q)
    expected = expected + np.einsum("rkjl,k,j,l", given.cubic_damping, v, q, q)
    np.testing.assert_allclose(found["force"], expected, rtol=ROUND_OFF)
    folds = [p for d in response.diagrams for p in d.special_points if p.type == "LP"]
    assert len(folds) > 0
    np.testing.assert_array_equal(np.atleast_1d(found["place"]), [p.frequency for p in folds])
    sizes = [p.amplitude[0] for p in folds]
    np.testing.assert_array_equal(np.atleast_1d(found["size_of"]), sizes)
    assert found["unit"] == "Pa" and found["names"] == len(response.label)


def test_poscidyn_computes_the_accelerations_of_the_model(tmp_path):
    poscidyn = pytest.importorskip("poscidyn")
    given = system(
        cubic_damping=np.zeros((SIZE,) * 4),
        damping=np.diag([0.1, 0.2, 0.3]),
        parametric=np.zeros((SIZE, SIZE)),
    )
    levels = {"direct": LEVELS["direct"], "parametric": 0.0}
    held = np.load(export(given, "poscidyn", tmp_path / "modal.npz", **levels))
    names = ("omega_0", "Q", "a", "b")
    oscillator = poscidyn.NonlinearOscillator(**{name: held[name] for name in names})
    drive = poscidyn.DirectHarmonicExcitation(f_d=held["f_d"])
    x, t, omega = np.random.default_rng(6).normal(size=2 * SIZE), 0.4, 1.3
    found = oscillator.f_i(t, x, None) + drive.f_e(t, x, {"omega": omega})
    expected = rate(given.scaled(**levels), t, x, omega)[SIZE:]
    np.testing.assert_allclose(found, expected, rtol=0, atol=SINGLE * np.abs(expected).max())


def test_poscidyn_gets_the_equations_that_it_has(tmp_path):
    diagonal = system(
        cubic_damping=np.zeros((SIZE,) * 4),
        damping=np.diag([0.1, 0.2, 0.3]),
        parametric=np.diag([1.0, 2.0, 3.0]),
    )
    scaled = diagonal.scaled(**LEVELS)
    held = np.load(export(diagonal, "poscidyn", tmp_path / "modal.npz", **LEVELS))
    x, t, omega = np.random.default_rng(4).normal(size=2 * SIZE), 0.3, 1.7
    q, v = np.split(x, 2)
    force = held["omega_0"] / held["Q"] * v + held["omega_0"] ** 2 * q
    force = force + np.einsum("ijk,j,k", held["a"], q, q)
    force = force + np.einsum("ijkl,j,k,l", held["b"], q, q, q)
    drive = (held["f_d"] + held["f_p"] * q) * np.cos(omega * t)
    expected = rate(scaled, t, x, omega)[SIZE:]
    np.testing.assert_allclose(drive - force, expected, rtol=1e-10)
    assert held["frequency"] == scaled.frequency and held["amplitude"] == scaled.amplitude
    for changes, message in [
        ({}, "no nonlinear damping"),
        ({"cubic_damping": np.zeros((SIZE,) * 4)}, "damping couples modes"),
    ]:
        with pytest.raises(FileError, match=message):
            export(system(**changes), "poscidyn", tmp_path / "no.npz", **LEVELS)
    assert not (tmp_path / "no.npz").exists()


def test_vtk_file_has_every_mode_on_the_triangles(tmp_path, make_model):
    model = make_model(3)
    points = len(model.shapes.points)
    model = attrs.evolve(model, static={"deflection": np.arange(points) * 1e-9})
    path = export_model(model, "vtk", tmp_path / "modes.vtkhdf")
    with h5py.File(path) as file:
        assert file["VTKHDF"].attrs["Type"] == b"UnstructuredGrid"
        assert np.array_equal(file["VTKHDF/PointData/2 f1é"], model.shapes.values[1])
    with pytest.raises(ModelError, match="shapes: the model has none"):
        export_model(attrs.evolve(model, shapes=None), "vtk", tmp_path / "no.vtkhdf")
    with pytest.raises(FileError, match="vtk is for a model with its mode shapes"):
        export(system(), "vtk", tmp_path / "no.vtkhdf")


def test_vtk_itself_reads_the_file(tmp_path, make_model):
    reader_of = pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    model = make_model(2, label=["f01", "f02"])
    path = export_model(model, "vtk", tmp_path / "modes.vtkhdf")
    reader = reader_of.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfCells() == len(model.shapes.cells)
    np.testing.assert_array_equal(vtk_to_numpy(grid.GetPoints().GetData()), model.shapes.points)
    found = vtk_to_numpy(grid.GetPointData().GetArray("2 f02"))
    np.testing.assert_array_equal(found, model.shapes.values[1])
    cell = grid.GetCell(3)
    assert [cell.GetPointId(i) for i in range(3)] == model.shapes.cells[3].tolist()


def test_moving_film_is_written_for_vtk_at_every_instant(tmp_path, response, driven):
    driven.save(tmp_path / "rom.h5")
    response.save(tmp_path / "response.h5")
    command = ["export", str(tmp_path / "response.h5"), "--to", "vtk", "--level", "2"]
    assert main([*command, "--at", "1.05 f1"]) == 0
    orbit = orbit_of(response, 2, "1.05 f1")
    step = max(np.diff(b.frequency).max() for b in response.diagrams[1].branches)
    wanted = 1.05 * response.frequency[0]
    assert orbit.omega / (2 * np.pi) == pytest.approx(wanted, abs=step)
    with h5py.File(tmp_path / "response.vtkhdf") as file:
        group = file["VTKHDF"]
        times = group["Steps/Values"][:]
        found = group["PointData/deflection"][:].reshape(len(times), -1, 3)
    assert times[-1] < orbit.period == pytest.approx(times[1] * len(times))
    expected = orbit.shape(driven.shapes.values, times)
    assert np.abs(found[..., 2] - expected).max() < 1e-12 * np.abs(expected).max()
    assert not found[..., :2].any()
    with pytest.raises(FileError, match="level: found 3"):
        orbit_of(response, 3)
    with pytest.raises(FileError, match="no stable orbit at 5 f1"):
        orbit_of(response, 1, "5 f1")
    assert main(["export", str(tmp_path / "response.h5"), "--to", "coco"]) == 1


def test_vtk_itself_reads_the_moving_film(tmp_path, response, driven):
    reader_of = pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    orbit = orbit_of(response, 2)
    path = export_motion(driven, orbit, "vtk", tmp_path / "motion.vtkhdf")
    reader = reader_of.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for step in (0, 5, 63):
        reader.SetStep(step)
        reader.Update()
        data = reader.GetOutput().GetPointData().GetArray("deflection")
        expected = orbit.shape(driven.shapes.values, step * orbit.period / 64)
        np.testing.assert_allclose(vtk_to_numpy(data)[:, 2], expected, rtol=1e-12, atol=1e-30)
        assert reader.GetTimeValue() == pytest.approx(step * orbit.period / 64)


@pytest.fixture(scope="module")
def driven(make_model):
    """A mode that stiffens and one beside it, under a pressure."""
    model = make_model(2, cubic=np.zeros((2,) * 4), quadratic=np.zeros((2,) * 3))
    cubic = np.zeros((2,) * 4)
    cubic[0, 0, 0, 0] = model.stiffness[0, 0] / 1e-16
    return attrs.evolve(model, cubic=cubic, drive={"pressure": np.array([1e-11, 1e-12])})


@pytest.fixture(scope="module")
def response(driven):
    level = 3e-9 * driven.stiffness[0, 0] / 1e-11 / 100
    drive = Drive([0.1 * level, level])
    return respond(driven, drive, Sweep("0.97 f1", "1.2 f1"), Damping(100), processes=1)


def test_table_has_every_point_of_every_branch(response):
    table = response.table()
    (lengths,) = {len(column) for column in table.values()}
    on = table["special"] == ""
    branches = [(n, b) for n, d in enumerate(response.diagrams, 1) for b in d.branches]
    assert on.sum() == sum(len(branch) for _, branch in branches) < lengths
    points = [p for d in response.diagrams for p in d.special_points]
    assert table["special"][~on].tolist() == [p.type for p in points] and "LP" in table["special"]
    np.testing.assert_array_equal(
        table["frequency"][on], np.concatenate([b.omega for _, b in branches]) / (2 * np.pi)
    )
    for mode, label in enumerate(response.label):
        amplitude = np.concatenate([b.amplitude[:, mode] for _, b in branches])
        np.testing.assert_array_equal(table[f"amplitude of {label}"][on], amplitude)
    stable = np.concatenate([b.stable for _, b in branches])
    assert np.array_equal(table["stable"][on] == 1, stable) and set(table["stable"][~on]) == {-1}
    assert set(table["level"]) == {1, 2}


def test_response_as_csv_and_matlab_is_its_table(tmp_path, response):
    table = response.table()
    path = export_response(response, "csv", tmp_path / "response.csv")
    with open(path, newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert head[:8] == [
        "level", "direct (Pa)", "parametric (N/m)", "branch", "period", "stable", "special",
        "frequency (Hz)",
    ]  # fmt: skip
    assert head[8:] == [f"amplitude of {label} (m)" for label in response.label]
    assert [float(row[7]) for row in rows] == table["frequency"].tolist()
    assert [row[6] for row in rows] == table["special"].tolist()
    found = loadmat(export_response(response, "matlab", tmp_path / "r.mat"), squeeze_me=True)
    np.testing.assert_array_equal(found["frequency"], table["frequency"])
    for mode, label in enumerate(response.label):
        np.testing.assert_array_equal(found["amplitude"][:, mode], table[f"amplitude of {label}"])
    assert found["label"].tolist() == list(response.label)
    assert found["unit_direct"] == "Pa"


def test_pandas_takes_the_table(response):
    pandas = pytest.importorskip("pandas")
    table = response.table()
    frame = pandas.DataFrame(table)
    assert list(frame.columns) == list(table) and len(frame) == len(table["frequency"])


def test_command_exports_whatever_the_file_holds(tmp_path, make_model, response, capsys):
    model, other = tmp_path / "rom.h5", tmp_path / "response.h5"
    make_model(2, label=["f01", "f02"]).save(model)
    response.save(other)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for to, suffix in (("vtk", ".vtkhdf"), ("coco", ".coco"), ("verilog-a", ".va")):
            assert main(["export", str(model), "--to", to]) == 0
            assert model.with_suffix(suffix).exists()
        assert main(["export", str(other), "--to", "csv"]) == 0
        assert main(["export", str(other), "--to", "auto"]) == 1
    assert "export: auto is for models; a response goes to matlab, csv" in capsys.readouterr().err
    assert main(["export", str(model), "--to", "excel"]) == 1
    assert "--to: found 'excel'; allowed: auto, matlab" in capsys.readouterr().err
