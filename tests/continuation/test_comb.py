"""Combs: the lines of tori and those of records in time are the same."""

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, comb, explore, follow_torus
from nanorom.errors import ContinuationError
from nanorom.plots import comb_figure

LEVEL, OMEGA = 0.01, 0.9885
SECOND = 0.029553765708  # provenance in tori/test_families.py
LINES_ERROR = 0.02  # of the largest line: between cells the window loses a per cent


@pytest.fixture(scope="module")
def two_modes():
    """The system of tori/test_families.py."""
    quadratic = np.zeros((2, 2, 2))
    quadratic[0, 0, 1] = quadratic[0, 1, 0] = 0.5
    quadratic[1, 0, 0] = 1.0
    return ModalSystem(
        damping=[0.005, 0.01], stiffness=[1.0, 4.0], quadratic=quadratic, direct=[1.0, 0.0]
    )


@pytest.fixture(scope="module")
def both(two_modes):
    """The comb of the torus at one frequency, and that of a record that starts on it."""
    points = explore(two_modes, (0.9, 1.1), direct=LEVEL).points("NS")
    start = min(points, key=lambda point: point.omega)
    torus = follow_torus(two_modes, start, (0.98, 0.9886), direct=LEVEL)
    band, width = (0.8, 1.2), SECOND / 4
    options = {"direct": LEVEL, "cells": round((band[1] - band[0]) / width)}
    exact = comb(two_modes, [OMEGA], band, tori=[torus], **options)
    motion = torus.at(OMEGA)[0].motion
    state = np.concatenate([motion(0.0), motion.velocity(0.0)])
    record = comb(two_modes, [OMEGA], band, state=state, periods=2, recorded=400, **options)
    return exact, record, motion


def test_a_record_in_time_shows_the_lines_of_the_torus(both):
    exact, record, _ = both
    assert exact.exact.all() and not record.exact.any()
    lines = exact.amplitude[0, :, 0]
    top = lines.max()
    assert (lines > 0.01 * top).sum() >= 5
    for cell in np.flatnonzero(lines > 0.01 * top):
        near = record.amplitude[0, max(cell - 1, 0) : cell + 2, 0].max()
        assert abs(near - lines[cell]) < LINES_ERROR * top


def test_lines_are_the_second_frequency_apart(both):
    exact, _, motion = both
    assert abs(abs(motion.second) - SECOND) < 1e-9
    places = exact.frequency[exact.amplitude[0, :, 0] > 0.003 * exact.amplitude.max()]
    width = exact.frequency[1] - exact.frequency[0]
    turns = (places - OMEGA) / SECOND
    assert np.abs(turns - np.round(turns)).max() * SECOND <= 0.51 * width


def test_the_map_is_drawn(both, tmp_path):
    exact, record, _ = both
    figure = comb_figure(exact, tmp_path / "comb.png")
    assert (tmp_path / "comb.png").stat().st_size > 1000
    values = figure.axes[0].collections[0].get_array()
    assert values.max() == pytest.approx(exact.amplitude[:, :, 0].max())


def test_a_band_that_falls_is_refused(two_modes):
    with pytest.raises(ContinuationError, match="band"):
        comb(two_modes, [1.0], (1.2, 0.8), direct=LEVEL)
