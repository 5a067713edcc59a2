"""Numbers of a device come back from its nonlinear sweeps, with intervals that hold them."""

import itertools

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.cli.main import main
from nanorom.continuation import ModalSystem
from nanorom.errors import SceneError
from nanorom.measurement.data import MeasuredResponse
from nanorom.scene.excitation import Damping
from tests.measurement.device.truth import noisy, sweeps, with_outliers

# Davidovikj et al. 2017, doi:10.1038/s41467-017-01351-4, their drum: k3 = 1.35e15 N/m^3
RADIUS, THICKNESS, FREQUENCY, CUBIC, MODULUS = 2.5e-6, 5e-9, 14.7e6, 1.35e15, 594e9
THEIR_INTERVAL = 45e9  # what they give for the modulus
DENSITY, POISSON, QUALITY = 2330.0, 0.16, 100.0
EFFECTIVE = 0.2695  # of a membrane's mass, as J0 has it, J1(j01)^2
FORCE = 3e-11  # N at the highest level
LEVELS = {"-12 dBm": 10 ** (-12 / 20), "0 dBm": 1.0}
NOISE = 0.02
UNKNOWNS = ["tension", "youngs_modulus", "quality_factor", "drive"]


def guess(**changes):
    """A drum whose tension and modulus are hardly known."""
    scene = nanorom.Scene(
        geometry=nanorom.Disc(RADIUS),
        plate=nanorom.Plate(THICKNESS, model="membrane"),
        material=nanorom.Material(1.2e12, POISSON, DENSITY),
        tension=nanorom.Tension(0.05),
        modes=nanorom.Modes(1),
    )
    return attrs.evolve(scene, **changes)


def truth_of_one(shift=0.0):
    """One mode with the paper's numbers; no finite elements.  shift: of the rows, by their step."""
    mass = EFFECTIVE * np.pi * RADIUS**2 * THICKNESS * DENSITY
    omega = 2 * np.pi * FREQUENCY
    system = ModalSystem(
        mass=[mass],
        damping=[mass * omega / QUALITY],
        stiffness=[mass * omega**2],
        cubic=[[[[CUBIC]]]],
        direct=[FORCE],
    )
    rows = FREQUENCY * np.linspace(0.96, 1.11, 90)
    return sweeps(system, [rows + shift * (rows[1] - rows[0])], LEVELS, np.array([1.0]), "m")


@pytest.fixture(scope="module")
def clean():
    return truth_of_one()


@pytest.fixture(scope="module")
def found(clean):
    return nanorom.identify_sweeps(guess(), noisy(clean, NOISE, 2), UNKNOWNS)


def test_modulus_is_that_of_davidovikj_et_al(found):
    modulus = found["youngs_modulus"]
    assert abs(modulus.value - MODULUS) < THEIR_INTERVAL
    assert modulus.holds(MODULUS)
    assert modulus.interval < 0.03 * MODULUS
    assert found["quality_factor"].holds(QUALITY)
    assert found["drive"].holds(FORCE)
    assert not found.misfit
    assert found.open == ()
    assert found.scene.material.youngs_modulus == modulus.value
    assert found.frequency[0] == pytest.approx(FREQUENCY, rel=2e-4)
    shown = repr(found)
    assert "youngs_modulus = 59" in shown and "GPa +- " in shown
    assert len(shown) < 400


def test_outliers_and_a_wrong_start_change_little(clean, found):
    data = with_outliers(noisy(clean, NOISE, 2), 0.05, 2)
    wrong = guess(material=nanorom.Material(2e11, POISSON, DENSITY), tension=nanorom.Tension(0.4))
    other = nanorom.identify_sweeps(wrong, data, UNKNOWNS)
    for title, estimate in found.estimate.items():
        assert other[title].value == pytest.approx(estimate.value, abs=2 * estimate.interval)


def test_two_modes_that_are_fitted_with_one_are_recognised():
    """A neighbour 1.5 linewidths away, with a seventh of the force, coupled to the first."""
    mass = EFFECTIVE * np.pi * RADIUS**2 * THICKNESS * DENSITY
    omega = 2 * np.pi * FREQUENCY * np.array([1.0, 1.015])
    cubic = np.zeros((2,) * 4)
    cubic[0, 0, 0, 0], cubic[1, 1, 1, 1] = CUBIC, 8 * CUBIC
    for place in set(itertools.permutations((0, 0, 1, 1))):
        cubic[place] = 1.5 * CUBIC
    system = ModalSystem(
        mass=[mass, mass],
        damping=mass * omega / QUALITY,
        stiffness=mass * omega**2,
        cubic=cubic,
        direct=[FORCE, 0.15 * FORCE],
    )
    rows = [FREQUENCY * np.linspace(0.96, 1.11, 90)]
    data = noisy(sweeps(system, rows, LEVELS, np.ones(2), "m"), NOISE, 2)
    assert nanorom.identify_sweeps(guess(), data, UNKNOWNS).misfit


def test_what_arbitrary_units_leave_open_is_told(clean):
    traces = [attrs.evolve(t, amplitude=3e5 * t.amplitude) for t in noisy(clean, NOISE, 2).traces]
    data = MeasuredResponse(tuple(traces), "mV")
    found = nanorom.identify_sweeps(guess(), data, [*UNKNOWNS, "readout"])
    (left,) = found.open
    assert set(left.titles) == {"youngs_modulus", "drive", "readout"}
    assert np.isinf(found["youngs_modulus"].interval)
    assert found["quality_factor"].holds(QUALITY)


def test_requests_that_make_no_sense_are_one_line(clean):
    volts = attrs.evolve(clean, unit="mV")
    with pytest.raises(SceneError, match="amplitudes in mV without readout"):
        nanorom.identify_sweeps(guess(), volts, UNKNOWNS)
    with pytest.raises(SceneError, match="found levels '-12 dBm', .* without drive"):
        nanorom.identify_sweeps(guess(), clean, UNKNOWNS[:3])
    with pytest.raises(SceneError, match="found 'tensoin'; allowed: tension, .*readouts, .*offset"):
        nanorom.identify_sweeps(guess(), clean, ["tensoin"])
    with pytest.raises(SceneError, match="quality_factor: missing; allowed: "):
        nanorom.identify_sweeps(guess(), clean, ["tension", "drive"])
    with pytest.raises(SceneError, match="labels: found 2; allowed: 1, one for each peak"):
        nanorom.identify_sweeps(guess(), clean, UNKNOWNS, labels=["f01", "f02"])


def test_command_reads_files_and_leaves_scene_and_picture(clean, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    guess(damping=Damping(QUALITY)).with_(modes=1)
    (tmp_path / "scene.toml").write_text(guess().to_toml(), encoding="utf-8")
    for trace in noisy(clean, NOISE, 2).traces:
        name = f"drum_{trace.level.replace(' ', '')}_{trace.direction}.csv"
        lines = ["Frequenz (MHz);Amplitude (nm)"]
        lines += [
            f"{f / 1e6:.6f};{a * 1e9:.6f}".replace(".", ",")
            for f, a in zip(trace.frequency, trace.amplitude)
        ]
        (tmp_path / name).write_text("\n".join(lines), encoding="latin-1")
    files = sorted(str(path) for path in tmp_path.glob("drum_*.csv"))
    names = ",".join(UNKNOWNS)
    assert main(["identify", "scene.toml", *files, "--unknowns", names, "-o", "found"]) == 0
    text = capsys.readouterr().out
    assert "youngs_modulus" in text
    assert "GPa" in text
    assert "falls between" in text
    scene = nanorom.Scene.from_file("found/identified.toml")
    assert scene.material.youngs_modulus == pytest.approx(MODULUS, rel=0.02)
    assert (tmp_path / "found/sweeps.png").stat().st_size > 10_000
