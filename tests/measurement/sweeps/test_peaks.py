"""Plain sweeps and ring-downs give back the resonances that they were made of."""

import attrs
import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.continuation import ModalSystem, PeriodicOrbit, ring_down
from nanorom.errors import FileError
from nanorom.measurement.data import MeasuredResponse, RingdownRecord, Trace
from nanorom.measurement.sweeps.peaks import find_peaks
from nanorom.measurement.sweeps.ringdown import fit_ringdown
from tests.measurement.sweeps.truth import NM, PLACE, QUALITY, duffing_sweeps, noisy

NOISE = 0.02
MISSES = 2  # of 8 intervals of 95 %: more have odds of 1 in 170


def found(traces, unit="nm"):
    return find_peaks(MeasuredResponse(tuple(traces), unit))


@pytest.fixture(scope="module")
def clean():
    """Three powers up and down, of a Duffing resonance whose orbits continuation has found."""
    return duffing_sweeps((0.0004, 0.001, 0.002), np.linspace(0.95, 1.1, 120))


def test_intervals_of_noisy_sweeps_hold_the_truth(clean):
    """The long form, coverage over 50 seeds, is tests/benchmarks/peaks.py."""
    misses = 0
    for seed in range(2):
        (peak,) = found(noisy(clean, NOISE, seed))
        misses += not peak.frequency.holds(PLACE)
        misses += not peak.quality_factor.holds(QUALITY)
        misses += not peak.duffing.holds(1 / NM**2)
        misses += not peak.force["0.001"].holds(0.001 * NM)
        assert peak.quality_factor.interval < 0.03 * QUALITY
        assert peak.duffing.interval < 0.03 / NM**2
        assert not peak.misfit and not peak.background
        assert len(peak.falls) == 4
    assert misses <= MISSES


def test_outliers_hardly_matter(clean):
    random = np.random.default_rng(7)
    spoilt = []
    for trace in noisy(clean, NOISE, 7):
        amplitude = trace.amplitude.copy()
        amplitude[random.integers(len(amplitude), size=3)] *= 5
        spoilt.append(attrs.evolve(trace, amplitude=amplitude))
    (peak,) = found(spoilt)
    assert peak.quality_factor.value == pytest.approx(QUALITY, rel=0.02)
    assert peak.duffing.value == pytest.approx(1 / NM**2, rel=0.04)


def test_every_linear_peak_has_its_place_and_width():
    """Two resonances at two unknown scales; noise of a constant size."""
    places, qualities = np.array([20e6, 31e6]), np.array([150.0, 900.0])
    frequency = np.linspace(18e6, 33e6, 3001)
    detuning = places**2 - frequency[:, None] ** 2 + 1j * frequency[:, None] * places / qualities
    sizes = np.abs((np.array([2.0, 0.3]) * places**2 / qualities / detuning).sum(axis=1))
    random = np.random.default_rng(3)
    sizes = np.abs(sizes + 2e-3 * random.standard_normal(len(sizes)))
    first, second = found([Trace(frequency, sizes, "", "")], "mV")
    for peak, place, quality in zip((first, second), places, qualities):
        assert peak.frequency.value == pytest.approx(place, rel=5e-5)
        assert peak.quality_factor.value == pytest.approx(quality, rel=0.03)
        assert not peak.falls


def test_nonlinear_damping_is_seen_where_it_is():
    from nanorom.measurement.sweeps.duffing import Resonance
    from tests.measurement.sweeps.test_duffing import sweeps

    loss = 1 / QUALITY
    exact = sweeps(Resonance(1.0, loss, 1.0, 3 * loss), (1e-3, 3e-3), np.linspace(0.95, 1.1, 120))
    (peak,) = found(noisy(exact, NOISE, 5), "nm")
    assert peak.nonlinear_damping is not None
    assert peak.nonlinear_damping.holds(3.0)
    assert peak.nonlinear_damping.interval < 1.0


def test_a_second_mode_that_the_fit_does_not_have_is_told():
    frequency = np.linspace(0.9, 1.1, 600)
    places = np.array([1.0, 1.012])
    detuning = places**2 - frequency[:, None] ** 2 + 0.01j * frequency[:, None]
    sizes = np.abs((np.array([0.01, 0.006]) / detuning).sum(axis=1))
    random = np.random.default_rng(2)
    sizes *= 1 + 0.01 * random.standard_normal(len(sizes))
    peaks = found([Trace(frequency * 1e6, sizes, "", "up")])
    assert len(peaks) == 1 and peaks[0].misfit


def test_ringdowns_give_rate_frequency_and_hardening():
    system = ModalSystem(stiffness=[1.0], damping=[1 / QUALITY], cubic=[[[[0.05]]]], direct=[1.0])
    start = PeriodicOrbit(np.array([[0.0], [1.0], [0.0]]), 1.02)
    ring = ring_down(system, start, 1500.0)
    random = np.random.default_rng(1)
    size = ring.amplitude + 2e-4 * random.standard_normal(len(ring.amplitude))
    frequency = ring.omega / (2 * np.pi)
    got = fit_ringdown(RingdownRecord(ring.time, size, "nm", frequency))
    assert got.rate.value == pytest.approx(1 / QUALITY, rel=3e-3)
    assert got.frequency.value == pytest.approx(1 / (2 * np.pi), rel=1e-4)
    assert got.duffing.value == pytest.approx(0.05, rel=0.03)
    assert got.nonlinear_damping.value < 0.02


def test_nonlinear_damping_of_ringdowns_is_in_their_shape():
    time, rate, damping = np.linspace(0, 8, 400), 1.0, 2.0
    size = 1 / np.sqrt((1 + damping / 4) * np.exp(rate * time) - damping / 4)
    noise = 2e-3 * np.random.default_rng(4).standard_normal(400)
    got = fit_ringdown(RingdownRecord(time, size + noise, "V"))
    assert got.nonlinear_damping.holds(damping) and got.rate.holds(rate)
    assert got.nonlinear_damping.interval < 0.3


def test_noise_is_no_peak_and_too_few_rows_are_refused():
    random = np.random.default_rng(0)
    with pytest.raises(FileError, match="at least 12 rows"):
        found([Trace(np.arange(1.0, 6), np.ones(5), "", "up")])
    with pytest.raises(FileError, match="does not fall with time"):
        fit_ringdown(RingdownRecord(np.arange(50.0), 1 + 0.1 * random.random(50), "V"))


def test_command_reads_levels_off_files_and_leaves_table_and_pictures(tmp_path, capsys, clean):
    paths = []
    for trace in noisy(clean[2:], NOISE, 1):
        path = tmp_path / f"drum_{1000 * float(trace.level):g}mV_{trace.direction}.csv"
        rows = (f"{f / 1e6:.7f};{y:.6f}" for f, y in zip(trace.frequency, trace.amplitude))
        path.write_text("\n".join(["f/MHz;R/nm", *rows]).replace(".", ","), encoding="latin-1")
        paths.append(str(path))
    assert main(["peaks", *paths, "-o", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert "peak 1" in text and "duffing b/k" in text and "sweep 2 mV up falls between" in text
    assert (tmp_path / "out" / "peak-1.png").stat().st_size > 10_000
    row = (tmp_path / "out" / "peaks.csv").read_text().splitlines()[1].split(",")
    assert float(row[2]) == pytest.approx(PLACE, rel=1e-4)
    assert float(row[8]) == pytest.approx(1e18 / NM**2, rel=0.03)
