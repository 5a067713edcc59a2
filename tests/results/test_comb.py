"""Combs of responses: what a lab's map shows is the torus's, and only of the response's model."""

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.cli.main import main
from nanorom.errors import ContinuationError
from nanorom.results.comb import comb_of

SECOND = 0.029553765708  # at 0.9885 of the first frequency; from continuation/tori/test_families.py
OMEGA = 0.9885
FIRST = 2e7  # Hz
FLOOR = 3e-3  # of the largest line; windows reach down to 3e-5


@pytest.fixture(scope="module")
def torus(make_model):
    """The system x1'' + .005 x1' + x1 + x1 x2 = .01 cos, x2'' + .01 x2' + 4 x2 + x1^2 = 0 in SI."""
    unit, rate = 1e-8, 2 * np.pi * FIRST
    mass = np.array([1e-16, 0.5e-16])  # so that the forces have a potential
    quadratic = np.zeros((2, 2, 2))
    quadratic[0, 0, 1] = quadratic[0, 1, 0] = 0.5
    quadratic[1, 0, 0] = 1.0
    model = make_model(
        2,
        frequency=np.array([FIRST, 2 * FIRST]),
        mass=mass,
        stiffness=np.diag(mass * rate**2 * [1.0, 4.0]),
        damping=np.diag(mass * rate * [0.005, 0.01]),
        quadratic=rate**2 / unit * mass[:, None, None] * quadratic,
        cubic=np.zeros((2, 2, 2, 2)),
        drive={"pressure": np.array([0.01 * mass[0] * rate**2 * unit, 0.0])},
    )
    sweep = nanorom.Sweep("0.98 f1", "0.9885 f1")
    response = nanorom.respond(model, nanorom.Drive("1 Pa"), sweep, processes=1)
    return model, response


def test_lines_appear_beyond_the_torus_bifurcation_at_its_second_frequency(torus):
    model, response = torus
    found = comb_of(response, model, rows=5)
    rate = 2 * np.pi * FIRST
    assert found.omega[-1] == pytest.approx(OMEGA * rate)
    near = np.abs(found.frequency / rate - OMEGA) < 0.12
    places, sizes = found.frequency[near] / rate, found.amplitude[:, near, 0]
    lines = sizes > FLOOR * sizes.max(axis=1, keepdims=True)
    # the window of a line is as wide as it is: those far from the drive are no part of its
    apart = np.abs(places - OMEGA) > 2 * (places[1] - places[0]) + 8 / 256 * OMEGA / 2
    assert not (lines[0] & apart).any()
    width = places[1] - places[0]
    turns = (places[lines[-1] & apart] - OMEGA) / SECOND
    assert len(turns) >= 4
    assert np.abs(turns - np.round(turns)).max() * SECOND < width + 8 / 256 * OMEGA / 2


def test_a_response_with_another_damping_is_refused(torus):
    model, response = torus
    other = attrs.evolve(model, damping=2 * model.damping)
    with pytest.raises(ContinuationError, match="damping"):
        comb_of(response, other, rows=5)


def test_the_command_draws_it(torus, tmp_path, monkeypatch):
    model, response = torus
    model.save(tmp_path / "rom.h5")
    response.save(tmp_path / "response.h5")
    monkeypatch.setattr("nanorom.results.comb.ROWS", 5)
    assert main(["plot", str(tmp_path / "response.h5"), "--comb", "--level", "1"]) == 0
    assert (tmp_path / "comb.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("options", "told"), [({"level": 2}, "level"), ({"rows": 1}, "rows"), ({"rows": 9999}, "rows")]
)
def test_what_makes_no_sense_is_told(torus, options, told):
    with pytest.raises(ContinuationError, match=told):
        comb_of(torus[1], torus[0], **options)
