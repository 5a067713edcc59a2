"""What commands are given: a scene, a model, a sweep."""

import re

import numpy as np
import pytest

from nanorom.cli.main import main
from tests.cli import bad
from tests.cli.process import SWEEP


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


@pytest.fixture
def refused(tmp_path, monkeypatch, capfd):
    """A function (command, message): one line, status 1, nothing new, nothing changed."""
    monkeypatch.chdir(tmp_path)

    def check(command, message):
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        status = main(command.split())
        output, error = capfd.readouterr()
        assert status == 1, output
        assert re.fullmatch(r"nanorom: error: [^\n]+\n", error), error
        assert re.search(message, error), error
        assert "unexpected" not in error
        assert len(error) < 500
        after = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        assert after == before

    return check


@pytest.fixture(scope="session")
def response(tmp_path_factory, make_model):
    """A response of one level."""
    folder = tmp_path_factory.mktemp("response")
    cubic = np.zeros((2, 2, 2, 2))
    make_model(2, quadratic=np.zeros((2, 2, 2)), cubic=cubic).save(folder / "rom.h5")
    (folder / "sweep.toml").write_text(bad.SWEEP)
    command = f"respond {folder}/rom.h5 {folder}/sweep.toml -o {folder}/response.h5"
    assert main(command.split()) == 0
    return (folder / "response.h5").read_bytes()
