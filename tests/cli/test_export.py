"""Models handed to other programs from the command line."""

import re

import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.rom.model import ReducedModel
from tests.cli.process import names


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
