"""Modal forces from the instrument: dBm, and the frequencies of Duffing folds."""

import runpy
from math import tau
from pathlib import Path

import numpy as np
import pytest

import nanorom
from nanorom.errors import ModelError
from nanorom.measurement import calibration

DEMO = Path(__file__).parents[2] / "demos" / "instrument.py"
ONE_HARMONIC = 2e-3  # third harmonics shift the fold of a single mode by this much
TONGUE = 1e-3  # first order in 1/Q
INVERTED = 1e-6  # interpolation along the curve of folds
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
    assert calibration.power([0, 10, -30]) == pytest.approx([1e-3, 1e-2, 1e-6])
    ratios = calibration.amplitude_ratio([0, 20, -6], 0.0)
    assert ratios == pytest.approx([1, 10, 0.501187], rel=1e-5)


def test_force_is_found_from_the_fold_of_a_duffing_resonator():
    model = duffing()
    drive = nanorom.Drive([100.0, 200.0])
    response = nanorom.respond(model, drive, nanorom.Sweep("0.95 f1", "1.3 f1"), processes=1)
    folds = [max(p.omega for p in d.points("LP")) / tau for d in response.diagrams]
    found = calibration.force_of_fold(model, "f01", folds)
    assert found == pytest.approx([100e-12, 200e-12], rel=ONE_HARMONIC)


def test_calibration_averages_levels_and_tells_their_spread():
    model = duffing()
    frequency = np.array([20.4e6, 20.9e6])
    force = calibration.force_of_fold(model, 1, frequency)
    dbm = 20 * np.log10(force / force[0])  # as a linear instrument would have it
    found = calibration.calibrate(model, 1, dbm, frequency)
    assert found.force == pytest.approx(force[0])
    assert found.spread < 1e-12
    assert found.at(20.0) == pytest.approx(10 * force[0])
    assert calibration.calibrate(model, 1, dbm + [0, 1], frequency).spread > 0.05


def test_modes_without_an_upper_fold_are_refused():
    with pytest.raises(ModelError, match="no hardening"):
        calibration.force_of_fold(duffing(b=-1e15), "f01", 21e6)
    with pytest.raises(ModelError, match="quadratic"):
        calibration.force_of_fold(duffing(alpha=1e7), "f01", 21e6)
    for frequency in (19e6, 20.01e6):
        with pytest.raises(ModelError, match="folds only from"):
            calibration.force_of_fold(duffing(), "f01", frequency)


def test_tongue_gives_back_the_parametric_force():
    """Its edges from the exact condition of one harmonic, (k - m w^2/4)^2 + (c w/2)^2 = (F/2)^2."""
    model = duffing()
    k, quality = model.stiffness[0, 0], 180
    for excess in (1.0, 1.5, 3.0):
        force = excess * 2 * k / quality
        square = np.roots([1, 1 / quality**2 - 2, 1 - (force / (2 * k)) ** 2])  # of w/(2 w_1)
        low, high = np.sort(2 * 20e6 * np.sqrt(square.real))
        found = calibration.force_of_tongue(model, "f01", low, high)
        assert found == pytest.approx(force, rel=TONGUE)


def test_level_is_found_exactly_where_the_pattern_is_known():
    model = duffing()
    drive = nanorom.Drive([100.0, 200.0])
    response = nanorom.respond(model, drive, nanorom.Sweep("0.95 f1", "1.3 f1"), processes=1)
    folds = [max(p.omega for p in d.points("LP")) / tau for d in response.diagrams]
    found = calibration.level_of_fold(model, "f01", folds, model.drive["pressure"])
    assert found == pytest.approx([100.0, 200.0], rel=INVERTED)
    with pytest.raises(ModelError, match="no force on mode"):
        calibration.level_of_fold(model, 1, folds, [0.0])


def test_demo_finds_the_forces_of_the_spot(tmp_path):
    """By one mode alone but for the coupling; exactly with all modes and the pattern."""
    ratios = runpy.run_path(str(DEMO))["main"](tmp_path, modes=("f01", "f11s"))
    assert abs(ratios.pop("gamma") - 1) < TONGUE
    for alone, whole in ratios.values():
        assert abs(alone - 1) < COUPLING
        assert abs(whole - 1) < INVERTED
    assert (tmp_path / "folds.png").stat().st_size > 10_000
