"""f01 and f0,1 are one mode, wherever it is named."""

import attrs
import numpy as np
import pytest

from nanorom.errors import ModelError
from nanorom.results.readings import weights
from nanorom.rom import quantities
from nanorom.rom.names import index_of


@pytest.mark.parametrize("comma", [False, True])
def test_modes_are_found_with_a_comma_and_without(make_model, comma):
    """All names of a model have one beside a mode of ten nodal diameters."""
    label = ("f0,1", "f1,1c", "f10,1s") if comma else ("f01", "f11c", "f21s")
    model = attrs.evolve(make_model(3), label=label)
    for name in ("f1,1c", "f11c"):
        assert model.select([name]).label == (label[1],)
        assert model.b(1)[name, 1, 1] == model.b(1)[2, 1, 1]
        value, _ = quantities.value(f"f({name})", model, label)
        assert value == model.frequency[1]
        assert np.array_equal(weights(model, name), [0, 1, 0])
    assert index_of(label, "f101s") is None
    with pytest.raises(ModelError):
        model.select(["f0,2"])
