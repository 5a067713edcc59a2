"""Modal forces from the instrument: dBm, and the frequencies of Duffing folds."""

import runpy
from math import tau
from pathlib import Path

import numpy as np
import pytest

import nanorom
from nanorom import instrument
from nanorom.errors import ModelError

DEMO = Path(__file__).parents[2] / "demos" / "instrument.py"
ONE_HARMONIC = 2e-3  # third harmonics shift the fold of a single mode by this much
COUPLING = 0.03  # what other modes do to the force found from folds


def duffing(alpha=0.0, b=1.0e15):
    """One mode with f = 20 MHz, Q = 180."""
    mass, omega = 1e-16, tau * 20e6
    return nanorom.ReducedModel(
        frequency=[20e6],
        mass=[mass],
        label=["f01"],
        number=[1],
        stiffness=[[mass * omega**2]],
        damping=[[mass * omega / 180]],
        quadratic=[[[alpha]]],
        cubic=[[[[b]]]],
        drive={"pressure": [1e-12]},
        parametric={"tension": [[1.0]]},
    )


def test_twenty_decibels_are_a_factor_ten_of_the_amplitude():
    assert instrument.power([0, 10, -30]) == pytest.approx([1e-3, 1e-2, 1e-6])
    ratios = instrument.amplitude_ratio([0, 20, -6], 0.0)
    assert ratios == pytest.approx([1, 10, 0.501187], rel=1e-5)


def test_force_is_found_from_the_fold_of_a_duffing_resonator():
    model = duffing()
    drive = nanorom.Drive([100.0, 200.0])
    response = nanorom.respond(model, drive, nanorom.Sweep("0.95 f1", "1.3 f1"), processes=1)
    folds = [max(p.omega for p in d.points("LP")) / tau for d in response.diagrams]
    found = instrument.force_of_fold(model, "f01", folds)
    assert found == pytest.approx([100e-12, 200e-12], rel=ONE_HARMONIC)


def test_calibration_averages_levels_and_tells_their_spread():
    model = duffing()
    frequency = np.array([20.4e6, 20.9e6])
    force = instrument.force_of_fold(model, 1, frequency)
    dbm = 20 * np.log10(force / force[0])  # as a linear instrument would have it
    found = instrument.calibrate(model, 1, dbm, frequency)
    assert found.force == pytest.approx(force[0])
    assert found.spread < 1e-12
    assert found.at(20.0) == pytest.approx(10 * force[0])
    assert instrument.calibrate(model, 1, dbm + [0, 1], frequency).spread > 0.05


def test_modes_without_an_upper_fold_are_refused():
    with pytest.raises(ModelError, match="no hardening"):
        instrument.force_of_fold(duffing(b=-1e15), "f01", 21e6)
    with pytest.raises(ModelError, match="quadratic"):
        instrument.force_of_fold(duffing(alpha=1e7), "f01", 21e6)
    for frequency in (19e6, 20.01e6):
        with pytest.raises(ModelError, match="folds only from"):
            instrument.force_of_fold(duffing(), "f01", frequency)


def test_demo_finds_the_forces_of_the_spot_but_for_the_coupling():
    ratios = runpy.run_path(str(DEMO))["main"]()
    for ratio in ratios.values():
        assert abs(ratio - 1) < COUPLING
