"""The command line as users meet it: what it prints, one line and a status if not."""

import logging
import re
import warnings

import h5py
import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.rom.model import ReducedModel
from nanorom.scene.units import tabulated
from tests.cli.process import SWEEP, names, python

HEAVY = ("numpy", "scipy", "matplotlib", "pint", "h5py", "attrs", "tqdm", "dolfinx", "mpi4py")
FINITE_ELEMENTS = ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "ufl", "basix", "ffcx", "gmsh")


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


def test_a_reduction_without_a_response_loads_nothing_that_follows_one():
    modules = "nanorom.workflow, nanorom.fem.reduce, nanorom.verification.modes"
    done = python("-c", f"import sys, {modules}; print(*sys.modules)")
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.split())
    assert not {"nanorom.continuation", "scipy.signal", "scipy.stats"} & loaded


def test_following_a_response_loads_none_of_what_only_statistics_need():
    done = python("-c", "import sys, nanorom.results.respond; print(*sys.modules)")
    assert done.returncode == 0, done.stderr
    assert not {"scipy.signal", "scipy.stats", "matplotlib"} & set(done.stdout.split())


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

    load = commands.load

    def warn(path):
        warnings.warn("less\naccurate", AccuracyWarning, stacklevel=1)
        return load(path)

    monkeypatch.setattr(commands, "load", warn)
    assert main(["info", str(rom)]) == 0
    assert capsys.readouterr().err == "nanorom: warning: less accurate\n"


def test_a_command_within_a_script_leaves_its_log_as_it_was(rom, capsys):
    before = logging.root.manager.disable
    assert main(["info", str(rom)]) == 0
    assert main(["info", "nowhere.h5"]) == 1
    capsys.readouterr()
    assert logging.root.manager.disable == before == logging.NOTSET


def test_interrupt_is_one_line(monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("nanorom.cli.commands.load", interrupt)
    assert main(["info", "rom.h5"]) == 130
    assert capsys.readouterr().err == "nanorom: error: interrupted\n"
