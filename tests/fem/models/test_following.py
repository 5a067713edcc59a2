"""What lies outside the modes is told of where it does not follow them at once."""

import warnings

import numpy as np
import pytest

import nanorom
from nanorom.errors import AccuracyWarning
from tests.verification.conftest import drum

NEAR = 0.3  # of a change: told from one frequency of all that is outside
LITTLE = 0.01  # of the coefficient: change of the mode whose companion is there


def loaded(modes):
    load = nanorom.Load(pressure="20 kPa")
    return nanorom.reduce(drum(modes, model="plate", tension=(0.3, 0.3), load=load))


def effective(model):
    """Cubic coefficient that a backbone of the first mode shows, others answering at 2 omega."""
    k, a, omega = model.stiffness.diagonal(), model.quadratic[0, 0], 2 * np.pi * model.frequency[0]
    moving = k - (2 * omega) ** 2 * model.mass
    return model.cubic_of()[0, 0, 0, 0] - 2 * a**2 @ (2 / 3 / k + 1 / 3 / moving)


def test_companion_at_twice_the_frequency_is_missed_and_told_of():
    with pytest.warns(AccuracyWarning, match="f01 at .* does not follow at once"):
        one = loaded([1])
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        two = loaded([1, 6])
    change = abs(effective(two) / effective(one) - 1)
    assert change > 0.1
    assert one.diagnostics["outside_dynamics"][0] == pytest.approx(change, rel=NEAR)
    assert two.diagnostics["outside_dynamics"][0] < LITTLE
