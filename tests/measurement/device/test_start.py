"""Where fits of sweeps begin: by what peaks tell, be it roughly."""

import attrs
import pytest

from nanorom.measurement.data import MeasuredResponse
from nanorom.measurement.device.begin import Begin
from nanorom.measurement.device.request import Request
from nanorom.measurement.device.start import from_peaks
from nanorom.measurement.sweeps.peaks import Estimate, find_peaks
from nanorom.scene.excitation import Damping
from tests.measurement.device.test_device import FORCE, MODULUS, NOISE, guess, truth_of_one
from tests.measurement.device.truth import noisy

GAIN = 3e5  # mV/m
ROUGH = 0.6  # half width of a Duffing coefficient, relative; a seed of tests.benchmarks.identify
FACTOR = 2.0  # within which a start is good


@pytest.mark.parametrize("seed", [2, 3])
def test_a_duffing_coefficient_that_is_hardly_told_still_parts_drive_and_readout(seed):
    """Without it both began at 5e-3, in N and in mV/m, and the first diagram was never finished."""
    traces = noisy(truth_of_one(), NOISE, seed).traces
    scaled = tuple(attrs.evolve(t, amplitude=GAIN * t.amplitude) for t in traces)
    data = MeasuredResponse(scaled, "mV")
    known = guess(damping=Damping(100.0))
    known = attrs.evolve(known, material=attrs.evolve(known.material, youngs_modulus=MODULUS))
    names = ["tension", "quality_factor", "drive", "readout"]
    request = Request.of(known, data, names, 1)
    (peak,) = find_peaks(data)
    rough = Estimate(peak.duffing.value, ROUGH * peak.duffing.value)
    begin = Begin.of(known, [peak], request, (), data.unit)
    start = from_peaks(begin.parameters, [attrs.evolve(peak, duffing=rough)], [0], request.levels)
    values = dict(zip((p.name for p in begin.parameters.sought), begin.parameters.values(start)))
    assert 1 / FACTOR < values["drive"] / FORCE < FACTOR
    assert 1 / FACTOR < values["readout"] / GAIN < FACTOR
