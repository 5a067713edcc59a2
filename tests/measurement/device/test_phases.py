"""Phases tell more than amplitudes, whatever the instrument adds to them and counts them by."""

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.errors import SceneError
from nanorom.measurement.data import MeasuredResponse
from tests.measurement.device.test_device import (
    DENSITY,
    FORCE,
    MODULUS,
    NOISE,
    POISSON,
    QUALITY,
    UNKNOWNS,
    guess,
    truth_of_one,
)
from tests.measurement.device.truth import quadratures, with_outliers

TURN = 2.3  # rad, of the instrument
SHARPER = 0.008  # of Q: half width from these data; 0.0117 (three seeds) from amplitudes alone


@pytest.fixture(scope="module")
def clean():
    return truth_of_one(0.3)


def without_phase(measured):
    traces = tuple(attrs.evolve(trace, phase=None) for trace in measured.traces)
    return attrs.evolve(measured, traces=traces)


def check(found, turn):
    for title, truth in (("youngs_modulus", MODULUS), ("quality_factor", QUALITY)):
        assert found[title].holds(truth), title
    assert found["drive"].holds(FORCE)
    away = (found["phase.f01"].value - turn + np.pi) % (2 * np.pi) - np.pi
    assert abs(away) < found["phase.f01"].interval < 0.01


def test_quadratures_in_a_file_tell_the_turn_and_the_loss_better(clean, tmp_path):
    data = quadratures(clean, NOISE, 0, TURN, sense=-1.0)  # the sense in which phases count, too
    paths = []
    for trace in data.traces:
        x, y = 1e9 * trace.amplitude * np.array([np.cos(trace.phase), np.sin(trace.phase)])
        name = f"{trace.level.replace(' ', '')}_{trace.direction}.txt"
        paths.append(tmp_path / name)
        table = np.column_stack([trace.frequency / 1e6, x, y])
        np.savetxt(paths[-1], table, header="f (MHz)\tX (nm)\tY (nm)", delimiter="\t")
    found = nanorom.identify_sweeps(guess(), paths, UNKNOWNS)
    check(found, TURN)
    assert found["quality_factor"].interval < SHARPER * QUALITY


def test_outliers_and_a_wrong_start_are_borne(clean):
    data = with_outliers(quadratures(clean, NOISE, 1, TURN), 0.05, 1)
    random = np.random.default_rng(1)
    traces = []
    for trace in data.traces:
        phase, hit = trace.phase.copy(), random.random(len(trace.phase)) < 0.05
        phase[hit] = random.uniform(-np.pi, np.pi, int(hit.sum()))
        traces.append(attrs.evolve(trace, phase=phase))
    wrong = guess(material=nanorom.Material(2e11, POISSON, DENSITY), tension=nanorom.Tension(0.4))
    found = nanorom.identify_sweeps(wrong, attrs.evolve(data, traces=tuple(traces)), UNKNOWNS)
    check(found, TURN)


def test_a_phase_that_was_not_measured_is_no_unknown(clean):
    with pytest.raises(SceneError, match="found phase without phases in all data; allowed: "):
        nanorom.identify_sweeps(guess(), without_phase(clean), [*UNKNOWNS, "phase"])
    some = clean.traces[:1] + without_phase(clean).traces[1:]
    with pytest.raises(SceneError, match="found phase without phases"):
        nanorom.identify_sweeps(guess(), MeasuredResponse(some, clean.unit), [*UNKNOWNS, "phases"])
