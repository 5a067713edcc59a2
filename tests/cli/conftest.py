"""What commands are given: a scene, a model, a sweep."""

import numpy as np
import pytest

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
