"""A reduced model finds its own modes among those of a larger one."""

import attrs
import numpy as np
import pytest

from nanorom.rom.larger import Larger

LARGER = {"f01": 1.0, "f11c": 2.0, "f11s": 2.001, "f53s": 5.0, "f34s": 5.4}


@pytest.fixture
def larger(make_model):
    names, frequency = zip(*LARGER.items())
    return Larger.of(
        attrs.evolve(make_model(5, 1), label=names, frequency=1e6 * np.array(frequency))
    )


def model_of(make_model, **frequency):
    places = attrs.evolve(make_model(len(frequency), 2), label=tuple(frequency))
    return attrs.evolve(places, frequency=1e6 * np.array(list(frequency.values())))


def test_near_modes_are_found_by_name(make_model, larger):
    model = model_of(make_model, f01=1.0003, f11s=2.0, f11c=2.0005)
    assert larger.places(model).tolist() == [0, 2, 1]


def test_a_mode_with_another_name_is_found_by_its_frequency(make_model, larger):
    """As a mixed shape of a drum of sixty modes, which among seventy-two has its other name."""
    model = model_of(make_model, f01=1.0, f34s=5.003)
    assert larger.places(model).tolist() == [0, 3]
    matched = larger.matched(model)
    assert matched.label == ("f01", "f11c", "f11s", "f34s", "f53s")
    assert np.all(np.diff(matched.frequency) > 0)
    assert matched.frequency[3] == model.frequency[1]
    assert matched.cubic[3, 3, 0, 0] == model.cubic[1, 1, 0, 0]


def test_a_mode_that_the_larger_model_lacks_is_told(make_model, larger):
    with pytest.raises(ValueError, match="no mode f01"):
        larger.places(model_of(make_model, f01=1.2, f11c=2.0))
