"""Short form of ``nanorom bench --stress``: every trial is right, or refused with a message."""

import re

import numpy as np
import pytest

from nanorom.bench import stress
from nanorom.errors import NanoromError
from nanorom.exact import cases
from nanorom.scene.film import Plate, Tension
from nanorom.scene.units import to_si
from nanorom.workflow import reduce

BOUND = 1e-6  # the tolerance of every trial with a mesh of the program's own choice

FAMILIES = {
    "tension": lambda: stress.tensions(True, 3),
    "material": lambda: stress.materials(True, 3),
    "size": lambda: stress.sizes(True, 3),
    "unequal tensions": lambda: stress.unequal_tensions(True, 3),
    "nearly degenerate modes": stress.nearly_degenerate,
    "poor triangles": lambda: stress.poor_triangles(True),
    "compression": lambda: stress.compression(True),
}


@pytest.mark.parametrize("family", FAMILIES)
def test_extreme_parameters_give_the_exact_solution_or_a_message(family):
    trials = list(FAMILIES[family]())
    assert trials
    for trial in trials:
        assert trial.sound, trial
        if trial.verdict == "ok":
            assert max(trial.error_frequency, trial.error_tensor) < BOUND, trial


def test_a_compressed_membrane_is_refused():
    scene = cases.drum(100.0, 3).scene
    with pytest.raises(NanoromError, match="tension"):
        reduce(scene.with_(plate=Plate(thickness=1e-8, model="membrane"), tension=Tension(-1, 1)))


def test_unequal_compression_buckles_at_a_multiple_of_both_tensions():
    """At the critical tension that the message tells the lowest frequency vanishes."""
    case = cases.unequal_drum(-60.0, -10.0, 1)
    with pytest.raises(NanoromError, match="not stable") as caught:
        reduce(case.scene)
    told = re.findall(r"-[\d.]+ \S*N/m", str(caught.value))
    x, y = (to_si(pull, "N/m", "tension") for pull in told)
    assert x / y == pytest.approx(6.0, rel=1e-6)
    unloaded = reduce(case.scene.with_(tension=Tension(0.0, 0.0))).frequency[0]
    almost = reduce(case.scene.with_(tension=Tension(x * 0.9999, y * 0.9999))).frequency[0]
    assert np.isfinite(almost)
    assert almost < 0.02 * unloaded
    with pytest.raises(NanoromError, match="not stable"):
        reduce(case.scene.with_(tension=Tension(x * 1.0001, y * 1.0001)))
