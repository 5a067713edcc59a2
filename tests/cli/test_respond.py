"""Responses from the command line: followed, interrupted, gone on with, drawn."""

import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from tests.cli.process import LONGEST, SWEEP, names, python


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
    begun = subprocess.Popen(
        [sys.executable, *map(str, command), str(tmp_path / "response.h5")],
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell may ignore it
    )
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
