"""Voltages that an interferometer makes of a response: Jacobi's and Anger's series."""

import numpy as np
import pytest
from scipy.special import jv

from nanorom.cli.main import main
from nanorom.errors import ContinuationError, SceneError
from nanorom.plots import reading_figure
from nanorom.results.readings import reading, signal
from nanorom.results.respond import respond
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Excitation, Sweep
from nanorom.scene.instrument import Instrument

EXACT = 1e-12
LINEAR = 1e-9  # of the cubic force, 1e-9 of the linear one at the peak, in harmonics
WAVELENGTH, GAP, CONTRAST, OFFSET = 632.8e-9, 245e-9, 0.2, 0.3
FRINGE = Instrument(wavelength=WAVELENGTH, gap=GAP, contrast=CONTRAST, offset=OFFSET)


def drum():
    """One mode that is linear to 1e-18 and moves by 0.4 um at its peak."""
    return ReducedModel(
        frequency=np.array([1.0]) / (2 * np.pi),
        mass=[1.0],
        label=["f01"],
        number=[1],
        stiffness=[[1.0]],
        damping=[[0.05]],
        quadratic=np.zeros((1,) * 3),
        cubic=np.full((1,) * 4, 1e-6),
        drive={"pressure": [1.0]},
        parametric={"tension": [[-1.0]]},
    )


@pytest.fixture(scope="module")
def response():
    return respond(drum(), Drive(2e-8), Sweep("0.8 f1", "1.2 f1"), readout=FRINGE)


@pytest.mark.parametrize("harmonic", [0, 1, 2, 3, 7])
def test_harmonics_of_a_fringe_are_those_of_jacobi_and_anger(response, harmonic):
    """cos(a + z cos t) = J0 cos a + 2 sum J_k cos(a + k pi/2) cos k t."""
    branch = response.diagrams[0].branches[0]
    motion = reading(response, branch, "f01")
    volts = signal(response, branch, "f01", harmonic)
    z = 4 * np.pi / WAVELENGTH * motion.size
    assert z.max() > 2 * np.pi  # more than a fringe
    rest = 4 * np.pi / WAVELENGTH * GAP
    size = (2 if harmonic else 1) * CONTRAST * jv(harmonic, z)
    exact = size * np.cos(rest + harmonic * np.pi / 2) * np.exp(1j * harmonic * motion.phase)
    exact = exact + (OFFSET if harmonic == 0 else 0.0)
    assert volts.amplitude == pytest.approx(exact, abs=LINEAR * CONTRAST)


def test_small_motions_are_read_by_the_slope_of_the_fringe(response):
    small = respond(drum(), Drive(1e-12), Sweep("0.9 f1", "1.1 f1"), readout=FRINGE)
    table = small.table("f01")
    quadratic = (4 * np.pi / WAVELENGTH * np.hypot(table["x"], table["y"])).max() ** 2
    assert table["signal_x"] == pytest.approx(
        FRINGE.responsivity * table["x"], rel=quadratic, abs=1e-18
    )
    step = 1e-10
    slope = (FRINGE.volts(np.array(step)) - FRINGE.volts(np.array(-step))) / (2 * step)
    assert FRINGE.responsivity == pytest.approx(slope, rel=1e-5)


def test_a_slope_reads_volts_per_metre_and_dbm_are_those_of_fifty_ohm():
    linear = respond(
        drum(), Drive(2e-8), Sweep("0.9 f1", "1.1 f1"), readout=Instrument(slope="2 mV/nm")
    )
    table = linear.table("f01")
    assert table["signal_y"] == pytest.approx(2e6 * table["y"], rel=EXACT)
    assert linear.readout.dbm(np.array(1.0)) == pytest.approx(10.0)  # 1 V in 50 ohm: 10 mW
    volts = np.hypot(table["signal_x"], table["signal_y"])
    assert table["dbm"] == pytest.approx(10 * np.log10(volts**2 / 100 / 1e-3), rel=EXACT)


def test_a_readout_is_kept_with_its_response(response, tmp_path):
    response.save(tmp_path / "response.h5")
    kept = Response.load(tmp_path / "response.h5")
    assert kept.readout == FRINGE
    given = Excitation.from_dict(
        {"drive": {"direct": 1.0}, "sweep": {"from": 1, "to": 2}, "readout": {"slope": 1.0}}
    )
    assert Excitation.from_dict({"drive": {"direct": 1.0}, "sweep": {"from": 1, "to": 2}}) != given
    assert reading_figure(kept, "f01").axes[0].get_ylabel() == "f01 (dBm)"


def test_spot_needs_a_place(response, tmp_path, capsys):
    response.save(tmp_path / "response.h5")
    assert main(["plot", str(tmp_path / "response.h5"), "--read", "spot"]) != 0
    assert "has no readout.position" in capsys.readouterr().err


def test_without_a_readout_there_are_no_volts():
    bare = respond(drum(), Drive(2e-8), Sweep("0.9 f1", "1.1 f1"))
    assert "signal_x" not in bare.table("f01")
    with pytest.raises(ContinuationError, match="readout: none"):
        signal(bare, bare.diagrams[0].branches[0], "f01")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"wavelength": "600 nm"}, "readout.contrast: missing"),
        ({"contrast": 1.0}, "readout.wavelength: missing"),
        ({}, "readout.wavelength: missing"),
        ({"slope": 1.0, "contrast": 1.0}, "readout.slope: found beside"),
        ({"slope": "1 m"}, "readout.slope"),
        ({"wavelength": "-1 nm", "contrast": 1.0}, "readout.wavelength: found"),
        ({"slope": 1.0, "impedance": 0.0}, "readout.impedance: found 0.0"),
    ],
)
def test_readouts_that_make_no_sense_are_refused(given, told):
    with pytest.raises(SceneError, match=told):
        Instrument(**given)


def test_motions_through_thousands_of_fringes_are_told():
    far = Instrument(wavelength="1 pm", contrast=1.0)
    wild = respond(drum(), Drive(2e-8), Sweep("0.9 f1", "1.1 f1"), readout=far)
    with pytest.raises(ContinuationError, match=r"readout.wavelength: the motion goes through"):
        signal(wild, wild.diagrams[0].branches[0], "f01")
