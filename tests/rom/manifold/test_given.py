"""A manifold is made of what people have: a model, its file, a system; else they are told."""

import numpy as np
import pytest

import nanorom
from nanorom.errors import ModelError
from tests.conftest import random_model


def test_the_file_of_a_model_stands_for_it(tmp_path):
    model = random_model(2, seed=3)
    model.save(tmp_path / "rom.h5")
    of_file, of_model = (nanorom.manifold(given, [1], 3) for given in (tmp_path / "rom.h5", model))
    z = np.array([0.3 + 0.1j])
    assert (of_file.state(z) == of_model.state(z)).all()
    assert repr(of_file) == f"Manifold of {model.label[0]}, order 3, style normal, 1 slaves"


def test_what_has_no_modes_is_told_what_to_give():
    with pytest.raises(ModelError, match=r"^manifold: found a float; allowed: a ReducedModel, a M"):
        nanorom.manifold(3.0)
