"""What a lock-in amplifier reads off a response, in tables and pictures."""

import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.errors import ContinuationError
from nanorom.plots import reading_figure
from nanorom.results.respond import respond
from nanorom.rom.model import ReducedModel
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep

LOSS, LEVEL = 0.05, 1e-6
LINEAR = 1e-7  # of the response: a cubic force of 1e-9 of the linear one, over the damping


@pytest.fixture(scope="module")
def model():
    """Two modes of unit mass; of the second the film shows twice as much at a place."""
    cubic = np.zeros((2,) * 4)
    cubic[0, 0, 0, 0] = 1.0
    return ReducedModel(
        frequency=np.array([1.0, 2.0]) / (2 * np.pi),
        mass=[1.0, 1.0],
        label=["f01", "f02"],
        number=[1, 2],
        stiffness=np.diag([1.0, 4.0]),
        damping=np.diag([LOSS, LOSS]),
        quadratic=np.zeros((2,) * 3),
        cubic=cubic,
        drive={"pressure": [1.0, 0.5]},
        parametric={"tension": -np.eye(2)},
    )


@pytest.fixture(scope="module")
def response(model):
    return respond(model, Drive([LEVEL, 2 * LEVEL]), Sweep("0.5 f1", "2.5 f1"))


def motion(omega, output):
    """Of the linear system: the complex amplitude of an output at level 1."""
    modes = [1.0 / (1.0 - omega**2 + 1j * LOSS * omega), 0.5 / (4.0 - omega**2 + 1j * LOSS * omega)]
    return output @ np.array(modes)


@pytest.mark.parametrize("output", ["f02", 1, [0.3, -2.0]])
def test_tables_hold_quadratures_phase_and_decibels(response, output):
    table = response.table(output)
    weights = np.array(output) if isinstance(output, list) else np.array([0.0, 1.0])
    found = table["x"] + 1j * table["y"]
    expected = motion(2 * np.pi * table["frequency"], weights) * table["direct"]
    assert np.abs(found - expected).max() < LINEAR * np.abs(expected).max()
    angle = np.angle(expected * np.exp(-1j * table["phase"]))
    assert np.abs(angle).max() < 1e-6
    decibel = 20 * np.log10(np.abs(expected) / 1e-9)
    np.testing.assert_allclose(table["decibel"], decibel, atol=1e-5)


def test_without_an_output_the_table_is_as_before(response):
    assert not {"x", "y", "phase", "decibel"} & set(response.table())


def test_a_period_of_the_drive_has_nothing_at_half_its_frequency(response):
    assert not response.table("f01", "1/2")["x"].any()
    assert np.abs(response.table("f01", 3)["x"]).max() < 1e-12


@pytest.mark.parametrize(
    ("output", "harmonic", "told"),
    [
        ("f11", 1, "output: found 'f11'; allowed: f01, f02"),
        (2, 1, "output: found mode 2; allowed 0 to 1"),
        ([1.0], 1, r"output: shape \(1,\), expected \(2,\)"),
        ("f01", "half", "harmonic: found 'half'"),
        ("f01", -1, "harmonic: found -1"),
    ],
)
def test_what_is_not_there_is_told(response, output, harmonic, told):
    with pytest.raises(ContinuationError, match=told):
        response.table(output, harmonic)


def test_the_picture_shows_the_peak_in_decibels_and_half_a_turn_of_phase(response):
    upper, lower = reading_figure(response, "f01").axes
    heights = sorted(line.get_ydata().max() for line in upper.get_lines() if len(line.get_xdata()))
    peaks = [20 * np.log10(level / LOSS / 1e-9) for level in (LEVEL, 2 * LEVEL)]
    np.testing.assert_allclose(heights, peaks, atol=0.05)
    for line in lower.get_lines():
        assert line.get_ydata()[0] == pytest.approx(0, abs=4)
        assert line.get_ydata()[-1] == pytest.approx(-180, abs=4)


def test_the_command_draws_it_or_says_what_is_wrong(response, tmp_path, capsys):
    path = tmp_path / "response.h5"
    response.save(path)
    assert main(["plot", str(path), "--read", "f02"]) == 0
    assert (tmp_path / "reading.png").stat().st_size > 10_000
    for given, told in (
        (["--read", "f03"], "output: found 'f03'; allowed: f01, f02"),
        (["--read", "1 um, 2 um"], "rom.h5"),
        (["--read", "1 um, 2 um, 3 um"], "--read: found"),
        (["--read", "f01", "--harmonic", "x"], "harmonic: found 'x'"),
    ):
        assert main(["plot", str(path), *given]) != 0
        assert told in capsys.readouterr().err
