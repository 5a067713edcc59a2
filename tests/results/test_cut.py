"""Resonances that the range of a sweep cuts are told, and no others."""

import warnings

import numpy as np
import pytest

from nanorom.plots import response_figure
from nanorom.report.text import response_text
from nanorom.results.cut import cut_peaks, told
from nanorom.results.respond import respond
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep

QUALITY = 50
SEED = 3


@pytest.fixture(scope="module")
def model(make_model):
    """One mode that hardly stiffens: its peak is at its natural frequency."""
    frequency, mass = np.array([20e6]), np.array([1e-16])
    omega = 2 * np.pi * frequency
    return make_model(
        1,
        frequency=frequency,
        mass=mass,
        stiffness=np.diag(mass * omega**2),
        damping=np.diag(mass * omega / QUALITY),
        quadratic=np.zeros((1, 1, 1)),
        cubic=np.full((1, 1, 1, 1), 1e10),
        drive={"pressure": np.array([1e-11])},
        parametric={"tension": np.zeros((1, 1))},
    )


def followed(model, low, high):
    return respond(model, Drive(["0.1 Pa"]), Sweep(f"{low} f1", f"{high} f1"), processes=1)


def test_peak_outside_the_range_is_told_at_the_end_that_is_nearer(model):
    rng = np.random.default_rng(SEED)
    for _ in range(6):
        near, far = 1 + rng.uniform(0.01, 0.1), 1 + rng.uniform(0.2, 0.5)
        low, high = (near, far) if rng.random() < 0.5 else (2 - far, 2 - near)
        response = followed(model, low, high)
        (cut,) = cut_peaks(response)
        assert cut.level == 0
        nearest = min((low, high), key=lambda end: abs(end - 1))
        assert cut.omega == pytest.approx(nearest * 2 * np.pi * 20e6, rel=1e-3)
        assert cut.amplitude[0] == response.diagrams[0].branches[0].amplitude.max()
        assert "still rising" in response_text(response)
        assert "level 1 at" in told(response)


def test_film_that_stays_at_rest_has_no_peak_and_a_picture_without_complaints(model, tmp_path):
    drive = Drive(parametric=["1 uN/m"])  # of the mode, which it does not reach: its P is zero
    response = respond(model, drive, Sweep("0.8 f1", "1.2 f1"), processes=1)
    assert cut_peaks(response) == []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        response_figure(response, tmp_path / "rest.png")


def test_peak_within_the_range_is_not_told(model):
    rng = np.random.default_rng(SEED)
    for _ in range(3):
        low, high = 1 - rng.uniform(0.05, 0.3), 1 + rng.uniform(0.05, 0.3)
        response = followed(model, low, high)
        assert cut_peaks(response) == []
        assert told(response) == ""
        assert "still rising" not in response_text(response)
