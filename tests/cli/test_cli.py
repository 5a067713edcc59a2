"""The command line as users meet it: what it writes and prints, one line and a status if not."""

import base64
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.scene.units import tabulated

# Clamped plate with T_x != T_y of Keskekler et al. with E = 410 GPa, in Hz: spectral solution that
# is independent of finite elements, all digits converged.
DRUM_FREQUENCIES = [21.15119357e6, 35.43957465e6, 36.72212759e6]
FREQUENCY_TOLERANCE = 1e-6  # the scene's default accuracy

LONGEST = 120  # seconds; ranks that wait for each other for ever must not stop the suite

SWEEP = """
[damping]
quality_factor = 50
[drive]
direct = ["1 mPa", "2 mPa"]
[sweep]
from = "0.98 f1"
to = "1.02 f1"
"""

HEAVY = ("numpy", "scipy", "matplotlib", "pint", "h5py", "attrs", "tqdm", "dolfinx", "mpi4py")
FINITE_ELEMENTS = ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "ufl", "basix", "ffcx", "gmsh")


@pytest.fixture
def scene(tmp_path, drum_toml):
    path = tmp_path / "drum.toml"
    path.write_text(drum_toml)
    return path


@pytest.fixture
def rom(tmp_path, make_model):
    """A model of two modes that do not interact, so that its response is quick."""
    path = tmp_path / "rom.h5"
    cubic = np.zeros((2, 2, 2, 2))
    cubic[0, 0, 0, 0] = 1e16
    make_model(2, quadratic=np.zeros((2, 2, 2)), cubic=cubic).save(path)
    return path


@pytest.fixture
def sweep(tmp_path):
    path = tmp_path / "sweep.toml"
    path.write_text(SWEEP)
    return path


def python(*arguments, **options):
    return subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, **options
    )


def names(directory):
    return sorted(path.name for path in directory.iterdir())


@pytest.fixture(scope="module")
def results(tmp_path_factory, drum_toml):
    """What `nanorom run` leaves of the drum, run as a user would."""
    directory = tmp_path_factory.mktemp("drum")
    (directory / "drum.toml").write_text(drum_toml)
    done = python("-m", "nanorom", "run", "drum.toml", "-o", "out/drum", cwd=directory)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return directory / "out" / "drum"


def test_run_leaves_model_response_pictures_and_summary(results):
    assert names(results) == [
        "amplitudes.png",
        "modes.png",
        "report.html",
        "response.h5",
        "response.png",
        "rom.h5",
        "summary.json",
    ]


def test_page_of_a_run_shows_its_pictures(results):
    page = (results / "report.html").read_text(encoding="utf-8")
    for name in ("amplitudes.png", "modes.png", "response.png"):
        assert base64.b64encode((results / name).read_bytes()).decode() in page


def test_run_names_its_results_after_the_scene(scene, monkeypatch):
    asked = []
    monkeypatch.setattr("nanorom.workflow.run", lambda scene, where, *_, **__: asked.append(where))
    assert main(["run", str(scene)]) == 0
    assert asked == [Path("results/drum")]


def test_run_finds_the_exact_frequencies_of_the_drum(results):
    model = ReducedModel.load(results / "rom.h5")
    assert np.allclose(model.frequency, DRUM_FREQUENCIES, rtol=FREQUENCY_TOLERANCE, atol=0)
    assert model.label == ("f01", "f11s", "f11c")


def test_run_follows_every_level_and_finds_the_duffing_folds(results):
    response = Response.load(results / "response.h5")
    assert len(response.diagrams) == 2
    for diagram in response.diagrams:
        folds = [point for point in diagram.special_points if point.type == "LP"]
        assert len(folds) == 2
        assert all(point.omega > 2 * np.pi * response.frequency[0] for point in folds)


def test_summary_agrees_with_the_files(results):
    summary = json.loads((results / "summary.json").read_text())
    model = ReducedModel.load(results / "rom.h5")
    response = Response.load(results / "response.h5")
    assert [mode["frequency_Hz"] for mode in summary["modes"]] == model.frequency.tolist()
    assert [mode["cubic_N_per_m3"] for mode in summary["modes"]] == [
        model.cubic[r, r, r, r] for r in range(3)
    ]
    found = [
        [point["frequency_Hz"] for point in level["special_points"]]
        for level in summary["response"]
    ]
    assert found == [
        [point.omega / (2 * np.pi) for point in diagram.special_points]
        for diagram in response.diagrams
    ]
    assert summary["response"][1]["direct"] == {"level": 20.0, "unit": "Pa"}


def test_scene_in_the_model_reads_back_as_the_scene(results, drum_toml):
    from nanorom.scene.scene import Scene

    assert Scene.from_toml(ReducedModel.load(results / "rom.h5").scene) == Scene.from_toml(
        drum_toml
    )


def test_overrides_reach_the_reduction(tmp_path, scene):
    output = tmp_path / "rom.h5"
    arguments = ["reduce", str(scene), "-o", str(output), "--modes", "1,3", "--in-plane", "fixed"]
    assert main([*arguments, "--method", "step", "--degree", "4", "--mesh-size", "1 um"]) == 0
    model = ReducedModel.load(output)
    assert model.number.tolist() == [1, 3]
    assert (model.method, model.in_plane) == ("step", "fixed")
    assert model.diagnostics["degree"] == 4


@pytest.mark.mpi
@pytest.mark.skipif(shutil.which("mpirun") is None, reason="needs mpirun")
def test_two_ranks_write_the_model_of_one(tmp_path, scene, results):
    output = tmp_path / "two.h5"
    launch = ["mpirun", "--oversubscribe", "-n", "2"]
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(
        [*launch, sys.executable, "-m", "nanorom", "reduce", str(scene), "-o", str(output)],
        capture_output=True,
        text=True,
        env={**os.environ, **allow, "OMPI_MCA_btl": "^tcp,ofi"},
        timeout=LONGEST,
    )
    assert done.returncode == 0, done.stderr
    one, two = ReducedModel.load(results / "rom.h5"), ReducedModel.load(output)
    assert np.allclose(two.frequency, one.frequency, rtol=1e-10, atol=0)
    assert np.abs(two.cubic - one.cubic).max() <= 1e-10 * np.abs(one.cubic).max()


def test_info_prints_the_modes_with_units(rom, capsys):
    assert main(["info", str(rom)]) == 0
    text = capsys.readouterr().out
    model = ReducedModel.load(rom)
    assert re.search(r"frequency +mass +stiffness +Q", text)
    assert re.search(r"MHz +\w*g +N/m +1 +(1e\d+ )?N/m\^2 +1e\d+ N/m\^3", text)
    for label, frequency in zip(model.label, tabulated(model.frequency, "Hz", 10)[0]):
        assert re.search(rf"{label} +{re.escape(frequency)}", text)
    assert "180" in text  # the quality factor


def test_info_prints_the_asymmetry_that_was_found_and_not_that_of_symmetrised_tensors(
    tmp_path, make_model, capsys
):
    make_model(2, diagnostics={"asymmetry": 3e-7}).save(tmp_path / "rom.h5")
    assert main(["info", str(tmp_path / "rom.h5")]) == 0
    assert re.search(r"asymmetry +3\.0e-07", capsys.readouterr().out)


def test_respond_uses_the_damping_of_the_sweep_file(tmp_path, rom, sweep):
    output = tmp_path / "response.h5"
    assert main(["respond", str(rom), str(sweep), "-o", str(output)]) == 0
    response, model = Response.load(output), ReducedModel.load(rom)
    # so weakly driven the response is linear: |q_1| = J p Q / k at resonance
    for diagram, level in zip(response.diagrams, (1e-3, 2e-3)):
        peak = diagram.branches[0].amplitude[:, 0].max()
        linear = abs(model.drive["pressure"][0]) * level * 50 / model.stiffness[0, 0]
        assert peak == pytest.approx(linear, rel=1e-2)


def test_interrupted_response_goes_on_with_the_same_command(tmp_path, rom):
    sweep = tmp_path / "sweep.toml"
    levels = ", ".join(f'"{level} mPa"' for level in range(1, 9))
    sweep.write_text(SWEEP.replace('"1 mPa", "2 mPa"', levels))
    command = ["-m", "nanorom", "respond", rom, sweep, "-o"]
    begun = subprocess.Popen([sys.executable, *map(str, command), str(tmp_path / "response.h5")])
    deadline = time.monotonic() + LONGEST
    while not (tmp_path / "response.h5").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    begun.send_signal(signal.SIGINT)
    assert begun.wait(LONGEST) == 130
    part = Response.load(tmp_path / "response.h5")
    assert 1 <= len(part.diagrams) < 8
    assert part.unfinished == 8 - len(part.diagrams)
    assert names(tmp_path) == ["response.h5", "rom.h5", "sweep.toml"]

    assert python(*command, "response.h5", cwd=tmp_path).returncode == 0
    assert python(*command, "whole.h5", cwd=tmp_path).returncode == 0
    one, two = (Response.load(tmp_path / f"{name}.h5") for name in ("response", "whole"))
    assert one.unfinished == 0
    assert one.drive == two.drive
    for a, b in zip(one.diagrams, two.diagrams, strict=True):
        assert a.direct == b.direct
        assert [p.omega for p in a.special_points] == [p.omega for p in b.special_points]
        for c, d in zip(a.branches, b.branches, strict=True):
            assert np.array_equal(c.omega, d.omega)
            assert np.array_equal(c.multipliers, d.multipliers)


def contents(path):
    """Every attribute and dataset of an HDF5 file, by name."""
    found = {}

    def visit(name, node):
        found.update({f"{name}@{key}": value for key, value in node.attrs.items()})
        if isinstance(node, h5py.Dataset):
            found[name] = node[()]

    with h5py.File(path) as file:
        visit("", file)
        file.visititems(visit)
    return found


def test_response_killed_at_random_moments_ends_with_the_same_file(tmp_path, rom):
    random = np.random.default_rng(4)
    sweep, output = tmp_path / "sweep.toml", tmp_path / "response.h5"
    levels = ", ".join(f'"{level} mPa"' for level in range(1, 13))
    sweep.write_text(SWEEP.replace('"1 mPa", "2 mPa"', levels))
    command = ["-m", "nanorom", "respond", rom, sweep, "-o"]
    kills = 0
    for _ in range(3):
        run = subprocess.Popen([sys.executable, *map(str, command), str(output)])
        before = output.stat().st_mtime_ns if output.exists() else 0
        deadline = time.monotonic() + LONGEST
        while run.poll() is None and time.monotonic() < deadline:
            if output.exists() and output.stat().st_mtime_ns != before:
                break
            time.sleep(0.002)
        time.sleep(0.03 * random.random())
        run.kill()
        kills += run.wait(LONGEST) == -signal.SIGKILL
        assert Response.load(output).diagrams  # whole levels only
    assert kills
    assert python(*command, output).returncode == 0
    assert python(*command, tmp_path / "whole.h5").returncode == 0
    one, two = contents(output), contents(tmp_path / "whole.h5")
    assert one.keys() == two.keys()
    assert all(np.array_equal(one[name], two[name]) for name in one)
    assert names(tmp_path) == ["response.h5", "rom.h5", "sweep.toml", "whole.h5"]


def test_plot_draws_a_model_and_a_response_beside_the_file(tmp_path, rom, sweep, capsys):
    response = tmp_path / "response.h5"
    assert main(["respond", str(rom), str(sweep), "-o", str(response)]) == 0
    assert main(["plot", str(rom)]) == 0
    assert main(["plot", str(response), "-o", str(tmp_path / "new" / "pictures")]) == 0
    assert main(["info", str(response)]) == 0
    assert "level 2  2 mPa direct" in capsys.readouterr().out
    assert (tmp_path / "modes.png").exists()
    assert names(tmp_path / "new" / "pictures") == ["amplitudes.png", "response.png"]


def test_plot_lays_measured_data_over_a_response(tmp_path, rom, sweep, capsys):
    response, measured = tmp_path / "response.h5", tmp_path / "measured.csv"
    assert main(["respond", str(rom), str(sweep), "-o", str(response)]) == 0
    start = ReducedModel.load(rom).frequency[0] / 1e6
    measured.write_text(f"frequency (MHz),amplitude (mV)\n{start},1\n")
    pictures = []
    for options in ([], ["--data", str(measured)]):
        assert main(["plot", str(response), *options]) == 0
        pictures.append((tmp_path / "response.png").read_bytes())
    assert pictures[0] != pictures[1]
    assert main(["plot", str(rom), "--data", str(measured)]) == 1
    assert "--data goes with a response.h5" in capsys.readouterr().err


def test_second_half_works_where_the_finite_element_libraries_are_absent(tmp_path, rom, sweep):
    script = (
        "import sys\n"
        f"for name in {FINITE_ELEMENTS}: sys.modules[name] = None\n"
        "from nanorom.cli.main import main\n"
        f"sys.exit(main(['respond', {str(rom)!r}, {str(sweep)!r}, '-o', 'response.h5'])\n"
        "    or main(['plot', 'response.h5']) or main(['plot', 'rom.h5'])\n"
        "    or main(['info', 'response.h5']))\n"
    )
    done = python("-c", script, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_reducing_without_dolfinx_names_the_remedy(tmp_path, scene):
    script = (
        "import sys\n"
        f"for name in {FINITE_ELEMENTS}: sys.modules[name] = None\n"
        "from nanorom.cli.main import main\n"
        f"sys.exit(main(['reduce', {str(scene)!r}, '-o', 'rom.h5']))\n"
    )
    done = python("-c", script, cwd=tmp_path)
    assert done.returncode == 1
    assert re.match(r"nanorom: error: this needs DOLFINx.*container image\n$", done.stderr)


@pytest.mark.parametrize("module", ["nanorom", "nanorom.cli.main"])
def test_importing_the_package_and_its_command_line_is_cheap(module):
    done = python("-c", f"import sys, {module}; print(*sys.modules)")
    assert done.returncode == 0, done.stderr
    assert not set(HEAVY) & set(done.stdout.split())


def test_public_names_are_what_they_say():
    import nanorom
    import nanorom.plots

    assert set(nanorom.__all__) <= set(dir(nanorom))
    for name in nanorom.__all__:
        assert callable(getattr(nanorom, name)), name
    with pytest.raises(AttributeError, match="nothing"):
        _ = nanorom.nothing


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("run none.toml -o out", "none.toml: no such file"),
        ("run bad.toml -o out", "bad.toml: plate.thickness: found '-10 nm'"),
        ("run drum.toml -o drum.toml", "drum.toml: .* is not a directory"),
        ("run drum.toml -o drum.toml/out", "is not a directory"),
        ("reduce drum.toml -o none/rom.h5", "none/rom.h5: there is no directory 'none'"),
        ("reduce drum.toml -o /dev/null", "/dev/null: is not a regular file"),
        ("reduce drum.toml -o .", "is a directory"),
        ("reduce drum.toml -o new.h5 --method fast", "reduction.method: found 'fast'"),
        ("reduce drum.toml -o new.h5 --modes 1,1", "modes.select: mode 1 appears twice"),
        ("reduce drum.toml -o new.h5 --modes few", "--modes: found 'few'"),
        ("reduce drum.toml -o new.h5 --tolerance tight", "accuracy.tolerance: found 'tight'"),
        ("reduce drum.toml -o new.h5 --degree 4", "accuracy.mesh_size: missing"),
        ("reduce drum.toml -o new.h5 --degree 4 --mesh-size 1kg", "accuracy.mesh_size: found"),
        ("reduce drum.toml -o new.h5 --in-plane no", "reduction.in_plane: found 'no'"),
        ("info none.h5", "none.h5: no such file"),
        ("info drum.toml", "drum.toml: not an HDF5 file"),
        ("info other.h5", "other.h5: an HDF5 file of format 'other'"),
        ("plot drum.toml", "drum.toml: not an HDF5 file"),
        ("plot rom.h5 -o drum.toml", "is not a directory"),
        ("respond rom.h5 drum.toml -o new.h5", "drum.toml: geometry: unknown section"),
        ("respond rom.h5 none.toml -o new.h5", "none.toml: no such file"),
        ("respond drum.toml sweep.toml -o new.h5", "drum.toml: not an HDF5 file"),
        ("respond rom.h5 sweep.toml -o none/new.h5", "there is no directory 'none'"),
        ("respond nan.h5 sweep.toml -o new.h5", "nan.h5: cubic: contains NaN"),
        ("respond loose.h5 sweep.toml -o new.h5", "stiffness: a natural frequency is zero"),
        ("respond undamped.h5 drive.toml -o new.h5", "damping: zero or negative"),
        ("respond rom.h5 still.toml -o new.h5", "still.toml: sweep.from: found '0 Hz'"),
        ("export rom.h5 --to csv -o none/x.csv", "there is no directory 'none'"),
        ("export rom.h5 --to auto --level 2", "level: found 2; the drive has levels 1 to 1"),
        ("export rom.h5 --to auto --omega 1 0.5", "sweep.to: found 0.5 Hz"),
        ("export rom.h5 --to auto --direct 5m", "drive.direct: found '5m'"),
        ("respond rom.h5 many.toml -o new.h5", "damping.quality_factor: found 3 values"),
    ],
)
def test_bad_input_is_one_line_before_any_work(
    tmp_path, monkeypatch, capsys, drum_toml, scene, rom, sweep, make_model, arguments, message
):
    def too_late(*_):
        raise AssertionError("the reduction has started")

    monkeypatch.setattr("nanorom.workflow.reduce", too_late)
    monkeypatch.setattr("nanorom.results.respond.explore_each", too_late)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text(drum_toml.replace("10 nm", "-10 nm"))
    (tmp_path / "many.toml").write_text(SWEEP.replace("= 50", "= [1, 2, 3]"))
    (tmp_path / "drive.toml").write_text(SWEEP.partition("= 50")[2])
    (tmp_path / "still.toml").write_text(SWEEP.replace("0.98 f1", "0 Hz"))
    make_model(2, damping=np.zeros((2, 2))).save(tmp_path / "undamped.h5")
    make_model(2, stiffness=np.zeros((2, 2))).save(tmp_path / "loose.h5")
    make_model(2).save(tmp_path / "nan.h5")
    with h5py.File(tmp_path / "nan.h5", "r+") as file:
        file["cubic"][0, 0, 0, 0] = np.nan
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file.attrs["format"] = "other"
    before = names(tmp_path)
    assert main(arguments.split()) == 1
    error = capsys.readouterr().err
    assert re.match(rf"nanorom: error: .*{message}.*\n$", error)
    assert error.count("\n") == 1
    assert names(tmp_path) == before


def test_more_modes_than_the_mesh_can_give_is_one_line_and_no_file(tmp_path, scene, capsys):
    output = tmp_path / "rom.h5"
    arguments = ["reduce", str(scene), "-o", str(output), "--modes", "90"]
    assert main([*arguments, "--degree", "2", "--mesh-size", "2 um"]) == 1
    assert re.match(r"nanorom: error: 90 modes asked for.*\n$", capsys.readouterr().err)
    assert not output.exists()


def test_failure_leaves_an_earlier_result_alone(tmp_path, scene, rom, monkeypatch, capsys):
    def fail(*_):
        raise RuntimeError("deep\ninside")

    before = rom.read_bytes()
    monkeypatch.setattr("nanorom.workflow.reduce", fail)
    assert main(["reduce", str(scene), "-o", str(rom)]) == 1
    assert rom.read_bytes() == before
    error = capsys.readouterr().err
    assert error.startswith("nanorom: error: unexpected RuntimeError: deep inside")
    assert error.count("\n") == 1
    assert main(["reduce", str(scene), "-o", str(rom), "--debug"]) == 1
    assert "Traceback (most recent call last)" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [[], ["frobnicate"], ["reduce", "drum.toml"]])
def test_wrong_usage_has_status_two(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "usage: nanorom" in capsys.readouterr().err


def test_only_the_first_rank_speaks(monkeypatch, capsys):
    monkeypatch.setenv("OMPI_COMM_WORLD_RANK", "1")
    assert main(["info", "none.h5"]) == 1
    assert capsys.readouterr().err == ""


def test_warning_is_one_line_and_no_failure(rom, monkeypatch, capsys):
    from nanorom.cli import commands
    from nanorom.errors import AccuracyWarning

    load = commands._load

    def warn(path):
        warnings.warn("less\naccurate", AccuracyWarning, stacklevel=1)
        return load(path)

    monkeypatch.setattr(commands, "_load", warn)
    assert main(["info", str(rom)]) == 0
    assert capsys.readouterr().err == "nanorom: warning: less accurate\n"


def test_interrupt_is_one_line(monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("nanorom.cli.commands._load", interrupt)
    assert main(["info", "rom.h5"]) == 130
    assert capsys.readouterr().err == "nanorom: error: interrupted\n"


@pytest.mark.parametrize(
    ("to", "left"), [("auto", "rom.auto"), ("matlab", "rom.mat"), ("csv", "rom.csv")]
)
def test_export_writes_beside_the_model_and_says_where(tmp_path, rom, to, left, capsys):
    assert main(["export", str(rom), "--to", to]) == 0
    assert capsys.readouterr().out == f"{tmp_path / left}\n"
    assert names(tmp_path) == sorted([left, "rom.h5"])


def test_export_takes_range_and_level_from_the_sweep_file(tmp_path, rom, sweep):
    target = tmp_path / "problem"
    arguments = ["export", str(rom), "--to", "auto", "-o", str(target), "--sweep", str(sweep)]
    assert main([*arguments, "--level", "2"]) == 0
    model = ReducedModel.load(rom)
    low, high = (float(x) for x in re.findall(r"1: \[(\S+) - 1e-6, (\S+)\]", _script(target))[0])
    assert (low, high) == pytest.approx((0.98, 1.02))  # of the lowest frequency
    second = _forces(target)
    assert main(arguments) == 0
    assert second == pytest.approx([2 * force for force in _forces(target)])
    quality = 1 / _entries(target, kind=2)[0]  # scaled damping of mode 1, from [damping]
    assert -quality == pytest.approx(50)
    assert model.damping[0, 0] > 0


def test_export_options_win_over_the_sweep_file(tmp_path, rom, sweep):
    target = tmp_path / "problem"
    arguments = ["export", str(rom), "--to", "auto", "-o", str(target), "--sweep", str(sweep)]
    assert main([*arguments, "--omega", "0.5 f1", "2 f1", "--direct", "4 mPa"]) == 0
    assert "1: [0.5 - 1e-6, 2.0]" in _script(target)
    ours = _forces(target)
    assert main(arguments) == 0
    assert ours == pytest.approx([4 * force for force in _forces(target)])


def _script(folder):
    return (folder / "modal.auto").read_text()


def _entries(folder, kind):
    rows = [line.split() for line in (folder / "modal.coef").read_text().splitlines()[1:]]
    return [float(row[-1]) for row in rows if int(row[0]) == kind]


def _forces(folder):
    return _entries(folder, kind=4)


def test_model_without_damping_has_a_table_but_no_response(tmp_path, make_model, capsys):
    path = tmp_path / "rom.h5"
    make_model(2, damping=np.zeros((2, 2))).save(path)
    assert main(["export", str(path), "--to", "csv"]) == 0
    capsys.readouterr()
    assert main(["export", str(path), "--to", "auto"]) == 1
    assert re.match(r"nanorom: error: damping: zero or negative.*\n$", capsys.readouterr().err)
